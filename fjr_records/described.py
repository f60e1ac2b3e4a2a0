"""Bags that describe themselves: whether they belong together, and what they are together."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fjr_interface.bags.reader import BagReader
from fjr_interface.experiment import Experiment, periodic
from fjr_kit.errors import InputError

from .experiment_bag import ExperimentBag, Override, Understood
from .lines import Grid, classify

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


def descriptions(readers: Sequence[BagReader]) -> list[Experiment] | None:
    """Return the description of each bag; None if no bag has one.

    Raises:
        InputError: some have one and some have none, or one is of a record that is not periodic.
    """
    with_one = [reader for reader in readers if reader.experiment is not None]
    if not with_one:
        return None
    for reader in readers:
        if reader.experiment is None:
            raise InputError(
                f"{reader.path.name} has no experiment description but {with_one[0].path.name} "
                "has one; put them into separate folders."
            )
    return [
        periodic(reader.experiment, str(reader.path))
        for reader in readers
        if reader.experiment is not None
    ]


def described(
    readers: Sequence[BagReader], experiments: Sequence[Experiment], override: Override
) -> Understood:
    """Return what described bags are together.

    Args:
        readers: the bags.
        experiments: their descriptions, in the same order.
        override: what the user sets instead.

    Raises:
        InputError: bags that do not belong to one experiment, naming two of them, or an override
            that contradicts them.
    """
    first = experiments[0]
    for reader, experiment in zip(readers, experiments, strict=True):
        for field in SHARED:
            if getattr(experiment, field) != getattr(first, field):
                raise InputError(
                    f"{readers[0].path.name} and {reader.path.name} differ in {field}; put "
                    "them into separate folders."
                )
    if override.samples_per_period not in (None, first.samples_per_period):
        raise InputError(
            f"{readers[0].path.name}: samples_per_period {override.samples_per_period} contradicts "
            f"the description, which says {first.samples_per_period}; leave it out."
        )
    total = first.transient_periods + first.periods
    transient, periods = override.kept(total, first.transient_periods)
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
