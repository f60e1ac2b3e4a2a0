"""The BLA of a campaign that is still being recorded: `fjr run --live` and `--until-db`."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.results.result import BlaEstimate
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.reader import BagReader
from fjr_records.lines import Grid
from fjr_records.realization import read_realization, signal_blocks
from fjr_records.spectra import RealizationSpectra

from .chart import chart
from .plan import Campaign

FEWEST = 4
"""Realizations from which a level may be said to be good enough: of fewer, the scatter is not known
well enough."""
_DB = 20.0 / math.log(10.0)


class LiveBla:
    """Follows the levels of a campaign, realization by realization, by the robust method."""

    def __init__(
        self,
        campaign: Campaign,
        say: Callable[[str], None],
        until_db: float | None = None,
        *,
        draw: bool = False,
    ) -> None:
        """Begin without a realization.

        Args:
            campaign: what is recorded.
            say: where sentences and charts go.
            until_db: standard deviation of the BLA that is good enough; None for none.
            draw: whether to draw the BLA after each realization.
        """
        self._campaign, self._say, self._until_db, self._draw = campaign, say, until_db, draw
        self._grids = [Grid.of(campaign.experiment(level, 0)) for level in range(campaign.levels)]
        self._spectra: list[list[RealizationSpectra]] = [[] for _ in self._grids]
        self._estimates: list[BlaEstimate | None] = [None for _ in self._grids]
        self._said: set[int] = set()

    def take_up(self, folder: Path, pending: list[tuple[int, int]]) -> None:
        """Take in the bags that are there already."""
        for level, realization in self._campaign.runs:
            if (level, realization) not in pending:
                self._take(level, realization, bag_folder(folder, level, realization))

    def take(self, level: int, realization: int, bag: Path) -> None:
        """Take a bag in, and say how well its level is known now.

        Raises:
            InputError: the bag is not whole.
        """
        self._take(level, realization, bag)
        deviations = self.deviations_db(level)
        if deviations is None:
            return
        estimate = self._estimates[level]
        if self._draw and estimate is not None:
            deviation = np.sqrt(estimate.var_total / 2.0)
            curves = {"o": np.abs(estimate.g), ".": deviation}
            self._say(chart(estimate.frequency_hz, curves))
            self._say("o: magnitude of the BLA, .: its standard deviation; dB re 1 rad/(N m), Hz")
        self._say(
            f"level {level}: {len(self._spectra[level])} realizations, standard deviation of the "
            f"BLA {np.median(deviations):.2f} dB (median of the lines; 90 % of them below "
            f"{np.quantile(deviations, 0.9):.2f} dB)."
        )

    def _take(self, level: int, realization: int, bag: Path) -> None:
        grid = self._grids[level]
        blocks = signal_blocks(BagReader(bag), grid.samples_per_period)
        self.add(level, read_realization(bag.name, level, realization, blocks, grid).spectra)

    def add(self, level: int, spectra: RealizationSpectra) -> None:
        """Take the spectra of a realization in."""
        self._spectra[level].append(spectra)
        if len(self._spectra[level]) > 1:
            excited = self._grids[level].lines.excited
            self._estimates[level] = robust_bla(self._spectra[level], excited)

    def estimate(self, level: int) -> BlaEstimate | None:
        """Return the BLA of a level so far; None before the second realization."""
        return self._estimates[level]

    def deviations_db(self, level: int) -> np.ndarray | None:
        """Return the standard deviation of the BLA's magnitude at each excited line.

        Half of the total variance of a complex G lies along its magnitude, so that the deviation
        is 8.69 dB times sqrt(var/2)/|G|, to first order.

        Returns:
            float64 of shape (excited lines,) in dB; None before the second realization.
        """
        estimate = self._estimates[level]
        if estimate is None:
            return None
        deviations: np.ndarray = _DB * np.sqrt(estimate.var_total / 2.0) / np.abs(estimate.g)
        return deviations

    def enough(self, level: int) -> bool:
        """Return whether a level is known well enough; say so once."""
        deviations = self.deviations_db(level)
        count, wanted = len(self._spectra[level]), self._until_db
        if wanted is None or deviations is None or count < FEWEST:
            return False
        reached = float(np.median(deviations))
        if reached > wanted:
            return False
        if level not in self._said:
            self._said.add(level)
            planned = self._campaign.values["excitation"]["realizations"]
            self._say(
                f"level {level}: good enough after {count} of {planned} realizations: "
                f"{reached:.2f} dB, {wanted:g} dB asked for."
            )
        return True
