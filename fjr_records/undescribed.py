"""Bags without a description: what their signals say, and which of them are of one level."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fjr_interface.bags.reader import BagReader
from fjr_interface.experiment import Experiment

from .discover import Found, NoPeriodError, discover, read_prefix
from .experiment_bag import ExperimentBag, Override, Understood
from .lines import Grid, classify
from .realization import signal_blocks

SAME_LEVEL = 1.05
"""Bags without description are of one level if their references agree in rms up to this factor."""
BLOCK = 2**16


def undescribed(readers: Sequence[BagReader], override: Override) -> Understood:
    """Return what bags without a description are together, found in their signals.

    Raises:
        NoPeriodError: no period can be found, bags that do not belong to one experiment, naming two
            of them, or hold too few periods.
    """
    found: list[Found] = []
    totals = []
    for reader in readers:
        r, y, samples = read_prefix(signal_blocks(reader, BLOCK))
        found.append(discover(reader.path.name, r, y, override.samples_per_period))
        totals.append(samples // found[-1].samples_per_period)
    first = found[0]
    for reader, other in zip(readers, found, strict=True):
        rates_agree = abs(reader.sample_rate_hz / readers[0].sample_rate_hz - 1.0) < 1e-6
        lines_agree = np.array_equal(other.excited, first.excited)
        if (
            not (rates_agree and lines_agree)
            or other.samples_per_period != first.samples_per_period
        ):
            raise NoPeriodError(
                f"{readers[0].path.name} and {reader.path.name} differ in sample rate, period or "
                "excited lines; put them into separate folders."
            )
    longest = max(each.transient_periods for each in found)
    transient, periods = override.kept(min(totals), longest)
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
