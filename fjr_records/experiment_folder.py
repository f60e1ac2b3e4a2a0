"""The one reader of experiments: a folder's grid, and which level and realization each bag holds.

Analysis and diagnosis both begin here, so that they agree on periods, lines, levels and overrides.
What the samples are is read later, bag by bag: in one pass (`realization`) or whole (`recorded`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.resampling.accuracy import Resampling
from fjr_interface.resampling.resampled_reader import ResampledReader, open_bag, resampled
from fjr_kit.errors import InputError

from .described import described, descriptions
from .experiment_bag import ExperimentBag, Override
from .lines import Grid
from .undescribed import undescribed


@dataclass(frozen=True)
class ExperimentFolder:
    """The experiment as a whole.

    Attributes:
        source: the folder as the user gave it.
        grid: rate, period and lines that all bags share.
        bags: ordered by (level, realization).
        described: whether the bags describe themselves; if not, the grid was found in the signals.
        notes: sentences that a reader of any result must see.
    """

    source: str
    grid: Grid
    bags: tuple[ExperimentBag, ...]
    described: bool
    notes: tuple[str, ...]

    @property
    def controller(self) -> dict | None:
        """Description of the controller; None if it is not known."""
        return self.bags[0].experiment.controller


def open_experiment(
    folder: Path | str,
    signal_map: SignalMap = DEFAULT,
    *,
    override: Override | None = None,
    resampling: Resampling | None = None,
) -> ExperimentFolder:
    """Open all bags of a folder and find what experiment they are.

    Args:
        folder: experiment folder, or one bag.
        signal_map: which topics and fields are the signals.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.

    Raises:
        InputError: a damaged bag, a signal that is missing, no description and no period that can
            be found, or bags that do not belong to one experiment, naming two of them.
    """
    readers = [open_bag(bag, signal_map, resampling) for bag in find_bags(folder)]
    override = override or Override()
    override.check()
    experiments = descriptions(readers)
    if experiments is None:
        grid, bags, notes = undescribed(readers, override)
    else:
        grid, bags, notes = described(readers, experiments, override)
    _refuse_lines_beyond_band(readers, grid)
    missing = dict.fromkeys(note for reader in readers for note in reader.notes)
    return ExperimentFolder(
        str(folder),
        grid,
        bags,
        experiments is not None,
        (*notes, *missing, *resampled(readers)),
    )


def _refuse_lines_beyond_band(readers: Sequence[BagReader], grid: Grid) -> None:
    """Raise InputError if lines lie where a bag's resampled signals are not faithful."""
    last_hz = grid.lines.last * grid.sample_rate_hz / grid.samples_per_period
    for reader in readers:
        if isinstance(reader, ResampledReader) and last_hz > reader.band_hz:
            raise InputError(
                f"{reader.path.name}: lines up to {last_hz:g} Hz are excited, but resampling is "
                f"faithful up to {reader.band_hz:.4g} Hz only; record with a higher rate."
            )
