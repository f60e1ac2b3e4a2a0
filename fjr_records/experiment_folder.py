"""The one reader of experiments: a folder's grid, and which level and realization each bag holds.

Analysis and diagnosis both begin here, so that they agree on periods, lines, levels and overrides.
What the samples are is read later, bag by bag: in one pass (`realization`) or whole (`recorded`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from fjr_interface.bags.reader import DEFAULT, BagReader, SignalMap, find_bags
from fjr_interface.experiment import Experiment, periodic
from fjr_interface.resampling.accuracy import Resampling
from fjr_interface.resampling.resampled_reader import ResampledReader, open_bag, resampled
from fjr_kit.errors import InputError

from .discover import Found, discover, read_prefix
from .lines import Grid, classify
from .realization import signal_blocks

SAME_LEVEL = 1.05
"""Bags without description are of one level if their references agree in rms up to this factor."""
BLOCK = 2**16
SHARED = (
    "sample_rate_hz",
    "samples_per_period",
    "periods",
    "transient_periods",
    "excited_harmonics",
    "detection_harmonics",
    "controller",
)
"""Fields of the description that all bags of a folder must share."""


@dataclass(frozen=True)
class Override:
    """What the user sets instead of what the bags say; None leaves it.

    Attributes:
        period_samples: N.
        transient_periods: periods to discard.
        periods: P to keep.
    """

    period_samples: int | None = None
    transient_periods: int | None = None
    periods: int | None = None


@dataclass(frozen=True)
class ExperimentBag:
    """One bag and its place in the experiment.

    Attributes:
        reader: gives its samples.
        experiment: its description with the user's overrides, or what was found in its signals.
    """

    reader: BagReader
    experiment: Experiment

    @property
    def name(self) -> str:
        """The name of the bag's folder."""
        return self.reader.path.name

    @property
    def level(self) -> int:
        """Index of the excitation level."""
        return self.experiment.level

    @property
    def realization(self) -> int:
        """Index of the realization within its level."""
        return self.experiment.realization


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
    for field, value, least in (
        ("period_samples", override.period_samples, 2),
        ("transient_periods", override.transient_periods, 0),
        ("periods", override.periods, 1),
    ):
        if value is not None and value < least:
            raise InputError(f"{field} must be {least} or more, not {value}.")
    experiments = _descriptions(readers)
    if experiments is None:
        grid, bags, notes = _discovered(readers, override)
    else:
        grid, bags, notes = _described(readers, experiments, override)
    _refuse_lines_beyond_band(readers, grid)
    missing = (note for reader in readers for note in reader.notes)
    return ExperimentFolder(
        str(folder),
        grid,
        bags,
        experiments is not None,
        (*notes, *missing, *resampled(readers)),
    )


_Understood = tuple[Grid, tuple[ExperimentBag, ...], list[str]]


def _descriptions(readers: Sequence[BagReader]) -> list[Experiment] | None:
    """Return the description of each bag; None if no bag has one."""
    described = [reader for reader in readers if reader.experiment is not None]
    if not described:
        return None
    for reader in readers:
        if reader.experiment is None:
            raise InputError(
                f"{reader.path.name} has no experiment description but {described[0].path.name} "
                "has one; put them into separate folders."
            )
    return [
        periodic(reader.experiment, str(reader.path))
        for reader in readers
        if reader.experiment is not None
    ]


def _described(
    readers: Sequence[BagReader], experiments: Sequence[Experiment], override: Override
) -> _Understood:
    first = experiments[0]
    for reader, experiment in zip(readers, experiments, strict=True):
        for field in SHARED:
            if getattr(experiment, field) != getattr(first, field):
                raise InputError(
                    f"{readers[0].path.name} and {reader.path.name} differ in {field}; put "
                    "them into separate folders."
                )
    if override.period_samples not in (None, first.samples_per_period):
        raise InputError(
            f"{readers[0].path.name}: period_samples {override.period_samples} contradicts the "
            f"description, which says {first.samples_per_period}; leave it out."
        )
    transient, periods = _kept(first.transient_periods + first.periods, first, override)
    grid = Grid(
        first.sample_rate_hz,
        first.samples_per_period,
        transient,
        periods,
        classify(first.excited_harmonics, first.detection_harmonics),
    )
    kept = {"transient_periods": transient, "periods": periods}
    bags = [
        ExperimentBag(reader, _in_order(each).model_copy(update=kept))
        for reader, each in zip(readers, experiments, strict=True)
    ]
    bags.sort(key=lambda bag: (bag.level, bag.realization))
    for one, two in pairwise(bags):
        if (one.level, one.realization) == (two.level, two.realization):
            raise InputError(
                f"{one.name} and {two.name} are both level {one.level}, realization "
                f"{one.realization}; remove one of them."
            )
        same = np.allclose(one.experiment.amplitudes_rad, two.experiment.amplitudes_rad)
        if one.level == two.level and not same:
            raise InputError(
                f"{one.name} and {two.name} are of one level but differ in amplitude_rad; put "
                "them into separate folders."
            )
    return grid, tuple(bags), _missing(bags, experiments)


def _in_order(experiment: Experiment) -> Experiment:
    """Return a description whose excited harmonics ascend, each with its amplitude."""
    harmonics = experiment.excited_harmonics
    order = np.argsort(harmonics)
    amplitudes: float | list[float] = experiment.amplitude_rad
    if isinstance(amplitudes, list) and len(amplitudes) > 1:
        amplitudes = [amplitudes[i] for i in order]
    ascending = {"excited_harmonics": [harmonics[i] for i in order], "amplitude_rad": amplitudes}
    return experiment.model_copy(update=ascending)


def _kept(total: int, found: Experiment | Found, override: Override) -> tuple[int, int]:
    """Return (transient periods, periods to keep) of `total` periods."""
    transient = found.transient_periods
    if override.transient_periods is not None:
        transient = override.transient_periods
    periods = total - transient if override.periods is None else override.periods
    if periods < 1 or transient + periods > total:
        raise InputError(
            f"The bags hold {total} periods, too few for {transient} transient periods and "
            f"{max(periods, 1)} to keep; lower transient_periods or periods."
        )
    return transient, periods


def _missing(bags: Sequence[ExperimentBag], experiments: Sequence[Experiment]) -> list[str]:
    notes = []
    count = Counter(bag.level for bag in bags)
    for level in range(max(e.levels for e in experiments)):
        planned = max((e.realizations for e in experiments if e.level == level), default=None)
        if planned is None:
            notes.append(f"level {level} is missing: there is no bag of it.")
        elif count[level] < planned:
            notes.append(f"level {level} has {count[level]} of {planned} planned realizations.")
    return notes


def _discovered(readers: Sequence[BagReader], override: Override) -> _Understood:
    found: list[Found] = []
    totals = []
    for reader in readers:
        r, y, samples = read_prefix(signal_blocks(reader, BLOCK))
        found.append(discover(reader.path.name, r, y, override.period_samples))
        totals.append(samples // found[-1].samples_per_period)
    first = found[0]
    for reader, other in zip(readers, found, strict=True):
        rates_agree = abs(reader.sample_rate_hz / readers[0].sample_rate_hz - 1.0) < 1e-6
        lines_agree = np.array_equal(other.excited, first.excited)
        if (
            not (rates_agree and lines_agree)
            or other.samples_per_period != first.samples_per_period
        ):
            raise InputError(
                f"{readers[0].path.name} and {reader.path.name} differ in sample rate, period or "
                "excited lines; put them into separate folders."
            )
    common = replace(first, transient_periods=max(each.transient_periods for each in found))
    transient, periods = _kept(min(totals), common, override)
    grid = Grid(
        readers[0].sample_rate_hz,
        first.samples_per_period,
        transient,
        periods,
        classify(first.excited.tolist()),
    )
    notes = [
        "No bag has an experiment description; found in the reference: a period of "
        f"{first.samples_per_period} samples, {first.excited.size} excited lines from "
        f"{_hz(grid, first.excited[0])} to {_hz(grid, first.excited[-1])}, {transient} transient "
        f"and {periods} kept periods."
    ]
    if len(set(totals)) > 1:
        notes.append(
            f"The bags hold {min(totals)} to {max(totals)} periods; only the first {min(totals)} "
            "of each are used."
        )
    return grid, tuple(_grouped(readers, found, grid)), notes


def _hz(grid: Grid, harmonic: int) -> str:
    return f"{harmonic * grid.sample_rate_hz / grid.samples_per_period:g} Hz"


def _grouped(
    readers: Sequence[BagReader], found: Sequence[Found], grid: Grid
) -> list[ExperimentBag]:
    """Give bags of like reference rms one level, in ascending order of amplitude.

    Within a level they keep the order of their names.
    """
    rms = [float(np.sqrt(np.mean(each.amplitudes**2))) for each in found]
    levels = [0] * len(rms)
    level, base = -1, 0.0
    for index in sorted(range(len(rms)), key=lambda i: rms[i]):
        if level < 0 or rms[index] > SAME_LEVEL * base:
            level, base = level + 1, rms[index]
        levels[index] = level
    realizations: Counter[int] = Counter()
    places: list[tuple[int, int, int]] = []
    for index, level in sorted(enumerate(levels), key=lambda place: (place[1], place[0])):
        places.append((index, level, realizations[level]))
        realizations[level] += 1
    return [
        ExperimentBag(
            readers[index],
            Experiment.of(
                str(readers[index].path),
                sample_rate_hz=grid.sample_rate_hz,
                samples_per_period=grid.samples_per_period,
                periods=grid.periods,
                transient_periods=grid.transient_periods,
                realization=realization,
                realizations=realizations[level],
                level=level,
                levels=len(realizations),
                amplitude_rad=found[index].amplitudes.tolist(),
                excited_harmonics=grid.lines.excited.tolist(),
            ),
        )
        for index, level, realization in places
    ]


def _refuse_lines_beyond_band(readers: Sequence[BagReader], grid: Grid) -> None:
    """Raise InputError if lines lie where a bag's resampled signals are not faithful."""
    last_hz = grid.lines.last * grid.sample_rate_hz / grid.samples_per_period
    for reader in readers:
        if isinstance(reader, ResampledReader) and last_hz > reader.band_hz:
            raise InputError(
                f"{reader.path.name}: lines up to {last_hz:g} Hz are excited, but resampling is "
                f"faithful up to {reader.band_hz:.4g} Hz only; record with a higher rate."
            )
