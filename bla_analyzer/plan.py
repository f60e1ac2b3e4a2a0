"""What the bags of a folder are: one grid, and which level and realization each bag holds."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fjr_interface.bag_reader import BagReader
from fjr_interface.errors import InputError
from fjr_interface.experiment import Experiment

from .discover import Found, discover, read_prefix
from .lines import classify
from .realization import Grid, signal_blocks

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
class PlannedBag:
    """One bag and its place: level and realization index, |R| at the excited lines (F,) in rad."""

    reader: BagReader
    level: int
    realization: int
    amplitudes_rad: np.ndarray

    @property
    def name(self) -> str:
        """The name of the bag's folder."""
        return self.reader.path.name


@dataclass(frozen=True)
class Plan:
    """The experiment as a whole; bags are ordered by (level, realization)."""

    grid: Grid
    bags: tuple[PlannedBag, ...]
    described: bool
    controller: dict | None
    notes: tuple[str, ...]


def plan(readers: Sequence[BagReader], override: Override) -> Plan:
    """Take the plan from the descriptions in the bags, or from the references if there is none.

    Raises:
        InputError: bags that do not belong to one experiment, naming two of them.
    """
    for field, value, least in (
        ("period_samples", override.period_samples, 2),
        ("transient_periods", override.transient_periods, 0),
        ("periods", override.periods, 1),
    ):
        if value is not None and value < least:
            raise InputError(f"{field} must be {least} or more, not {value}.")
    experiments = [reader.experiment for reader in readers]
    if all(experiment is None for experiment in experiments):
        return _discovered(readers, override)
    for reader, experiment in zip(readers, experiments, strict=True):
        if experiment is None:
            other = next(r for r, e in zip(readers, experiments, strict=True) if e is not None)
            raise InputError(
                f"{reader.path.name} has no experiment description but {other.path.name} has one; "
                "analyze them in separate folders."
            )
    return _described(readers, [e for e in experiments if e is not None], override)


def _described(
    readers: Sequence[BagReader], experiments: Sequence[Experiment], override: Override
) -> Plan:
    first = experiments[0]
    for reader, experiment in zip(readers, experiments, strict=True):
        for field in SHARED:
            if getattr(experiment, field) != getattr(first, field):
                raise InputError(
                    f"{readers[0].path.name} and {reader.path.name} differ in {field}; analyze "
                    "them in separate folders."
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
    order = np.argsort(first.excited_harmonics)
    bags = [
        PlannedBag(reader, e.level, e.realization, e.amplitudes_rad[order])
        for reader, e in zip(readers, experiments, strict=True)
    ]
    bags.sort(key=lambda bag: (bag.level, bag.realization))
    for one, two in pairwise(bags):
        if (one.level, one.realization) == (two.level, two.realization):
            raise InputError(
                f"{one.name} and {two.name} are both level {one.level}, realization "
                f"{one.realization}; remove one of them."
            )
        if one.level == two.level and not np.allclose(one.amplitudes_rad, two.amplitudes_rad):
            raise InputError(
                f"{one.name} and {two.name} are of one level but differ in amplitude_rad; analyze "
                "them in separate folders."
            )
    return Plan(grid, tuple(bags), True, first.controller, tuple(_missing(bags, experiments)))


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


def _missing(bags: Sequence[PlannedBag], experiments: Sequence[Experiment]) -> list[str]:
    notes = []
    count = Counter(bag.level for bag in bags)
    for level in range(max(e.levels for e in experiments)):
        planned = max((e.realizations for e in experiments if e.level == level), default=None)
        if planned is None:
            notes.append(f"level {level} is missing: there is no bag of it.")
        elif count[level] < planned:
            notes.append(f"level {level} has {count[level]} of {planned} planned realizations.")
    return notes


def _discovered(readers: Sequence[BagReader], override: Override) -> Plan:
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
                "excited lines; analyze them in separate folders."
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
    return Plan(grid, tuple(_grouped(readers, found)), False, None, tuple(notes))


def _hz(grid: Grid, harmonic: int) -> str:
    return f"{harmonic * grid.sample_rate_hz / grid.samples_per_period:g} Hz"


def _grouped(readers: Sequence[BagReader], found: Sequence[Found]) -> list[PlannedBag]:
    """Give bags of like reference rms one level, in ascending order of amplitude."""
    rms = [float(np.sqrt(np.mean(each.amplitudes**2))) for each in found]
    bags: list[PlannedBag] = []
    level, base = -1, 0.0
    realizations: defaultdict[int, int] = defaultdict(int)
    for index in sorted(range(len(rms)), key=lambda i: rms[i]):
        if level < 0 or rms[index] > SAME_LEVEL * base:
            level, base = level + 1, rms[index]
        amplitudes = found[index].amplitudes
        bags.append(PlannedBag(readers[index], level, realizations[level], amplitudes))
        realizations[level] += 1
    return bags
