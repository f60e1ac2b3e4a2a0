"""Realizations of a campaign ready for estimation: simulated in memory, or read from its bags."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bla_analyzer.checks import periodicity
from fjr_kit.errors import InputError
from fjr_records.experiment_folder import open_experiment
from fjr_records.lines import Grid, Lines
from fjr_records.realization import Realization, read_realization, signal_blocks
from fjr_records.spectra import RealizationSpectra, Samples
from fjr_sim_node.simulation.closed_loop import Trajectory
from fjr_sim_node.simulation.simulator import run_realization

from ..campaign.plan import Campaign


@dataclass(frozen=True)
class MeasuredLevel:
    """All realizations of one level.

    Attributes:
        grid: grid of the experiment.
        amplitudes_rad: (F,), reference amplitude of each excited line.
        realizations: at least one.
    """

    grid: Grid
    amplitudes_rad: np.ndarray
    realizations: tuple[Realization, ...]

    @property
    def lines(self) -> Lines:
        """Excited and detection lines."""
        return self.grid.lines

    @property
    def frequency_hz(self) -> np.ndarray:
        """(F,), excited frequencies."""
        return self.lines.excited * self.grid.sample_rate_hz / self.grid.samples_per_period

    @property
    def spectra(self) -> list[RealizationSpectra]:
        """Spectra of all realizations."""
        return [one.spectra for one in self.realizations]

    @property
    def is_periodic(self) -> bool:
        """Whether every realization repeats from period to period (true if P = 1)."""
        return all(periodicity(one).passed for one in self.realizations)

    @property
    def rms(self) -> np.ndarray:
        """(3,), rms of r, u and y over all kept periods."""
        return np.sqrt(np.mean([one.mean_square for one in self.realizations], axis=0))

    @property
    def peak(self) -> np.ndarray:
        """(3,), greatest magnitude of r, u and y over all kept periods."""
        return np.max([one.peak for one in self.realizations], axis=0)


def periods_of(trajectory: Trajectory, samples_per_period: int) -> Iterator[Samples]:
    """Yield r, u, y of one period after the other, the discarded ones first."""
    signals = (trajectory.reference, trajectory.torque, trajectory.position)
    for start in range(0, trajectory.reference.size, samples_per_period):
        r, u, y = (signal[start : start + samples_per_period] for signal in signals)
        yield r, u, y


def simulate_level(
    campaign: Campaign, level: int = 0, realizations: Sequence[int] | None = None
) -> MeasuredLevel:
    """Simulate one level of a campaign in memory, without bags.

    Args:
        campaign: what to simulate.
        level: index of the level.
        realizations: which ones; None for all.

    Raises:
        InputError: the motion diverges.
    """
    first = campaign.experiment(level, 0)
    grid = Grid.of(first)
    chosen = range(first.realizations) if realizations is None else realizations
    return MeasuredLevel(
        grid,
        first.amplitudes_rad,
        tuple(_simulated(campaign, level, number, grid) for number in chosen),
    )


def _simulated(campaign: Campaign, level: int, number: int, grid: Grid) -> Realization:
    experiment = campaign.experiment(level, number)
    trajectory = run_realization(campaign.values["simulator"], experiment)
    periods = periods_of(trajectory, grid.samples_per_period)
    return read_realization(f"realization {number}", level, number, periods, grid)


def read_levels(folder: Path) -> list[MeasuredLevel]:
    """Read all levels of an experiment folder, in the order of their index.

    Raises:
        InputError: bags that are not whole, do not belong together or cannot be used.
    """
    experiment = open_experiment(folder)
    levels: dict[int, list[Realization]] = {}
    for bag in experiment.bags:
        blocks = signal_blocks(bag.reader, experiment.grid.samples_per_period)
        one = read_realization(bag.name, bag.level, bag.realization, blocks, experiment.grid)
        levels.setdefault(bag.level, []).append(one)
    amplitudes = {bag.level: bag.experiment.amplitudes_rad for bag in experiment.bags}
    return [
        MeasuredLevel(experiment.grid, amplitudes[level], tuple(levels[level]))
        for level in sorted(levels)
    ]


def require_periodic(level: MeasuredLevel, where: str) -> None:
    """Raise InputError if the response of a level is not periodic."""
    if not level.is_periodic:
        raise InputError(
            f"{where}: the response is not periodic, so there is no BLA; lower the amplitude or "
            "raise the sample rate."
        )
