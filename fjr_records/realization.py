"""One realization, read once from its samples: spectra and the figures that the checks need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy

from fjr_interface.bags.audit import LARGEST
from fjr_interface.bags.reader import BagReader
from fjr_kit.errors import InputError
from fjr_kit.result_types import Array, EqualArrays

from .lines import Grid, Lines
from .spectra import PeriodSums, RealizationSpectra, Samples

SENSITIVITY_POWER = 4.0
"""White encoder noise v appears in y as S v, and |S|^2 stays below 4 (M_s = 2) in any loop fit for
use: noise explains a mismatch up to this factor above the floor at high frequencies."""
FALSE_ALARM = 1e-4
"""Probability, at the most, that noise alone in one realization passes for a response that does not
repeat: of each of the two tests of `period_mismatch`."""
REFERENCE_REPEATS = 0.05
"""Greatest rms difference of the reference between periods, relative to its rms."""
SEGMENTS = 10
_OF_MEDIAN = 2.0 / np.pi  # efficiency of a median beside a mean


@dataclass(frozen=True)
class Mismatch:
    """What does not repeat from period to period, in the band, relative to the mean period.

    Attributes:
        position, torque: rms of the scatter of one period over rms of the mean, y and u.
        unexplained: the same of y beyond what noise reaches with the probability FALSE_ALARM.
        All are NaN where P = 1.
    """

    position: float
    torque: float
    unexplained: float


class TimeSignals(EqualArrays):
    """The last period of the first realization of a level, for plots: arrays of shape (N,)."""

    time_s: Annotated[np.ndarray, Array("s")]
    reference_rad: Annotated[np.ndarray, Array("rad")]
    torque_nm: Annotated[np.ndarray, Array("N m")]
    position_rad: Annotated[np.ndarray, Array("rad")]


@dataclass(frozen=True)
class Realization:
    """One realization after the single pass over its samples.

    Attributes:
        name: name of the bag.
        level, realization: indices.
        spectra: mean spectra and noise covariance.
        mismatch: period-to-period mismatch.
        transient: greatest rms of what has not yet settled, over rms of y; NaN where P = 1.
        mean_square: (3,) of r, u and y over the kept periods.
        peak: (3,) greatest magnitude of r, u and y.
        signals: the last period, if asked for.
    """

    name: str
    level: int
    realization: int
    spectra: RealizationSpectra
    mismatch: Mismatch
    transient: float
    mean_square: np.ndarray
    peak: np.ndarray
    signals: TimeSignals | None


def read_realization(
    name: str,
    level: int,
    realization: int,
    periods: Iterable[Samples],
    grid: Grid,
    keep_signals: bool = False,
) -> Realization:
    """Reduce the samples of one bag; memory is that of a few periods however many there are.

    Args:
        name: name of the bag.
        level: index of the level.
        realization: index within the level.
        periods: r, u, y, perhaps q, of one period after the other, from the start of the bag; a
            shorter one at the end is ignored.
        grid: grid of the experiment.
        keep_signals: whether to keep the last period.

    Raises:
        InputError: too few samples, a reference that does not repeat, or none on an excited line.
    """
    period_rms = _Extremes()
    sums = PeriodSums(grid.samples_per_period)
    discarded = first = previous = last = None
    for index, period in enumerate(periods):
        if index < grid.transient_periods:
            discarded = period[2]
            continue
        if sums.periods == grid.periods or period[0].size < grid.samples_per_period:
            continue  # go on reading: the bag is audited to its end
        previous, last = last, period
        first = period if first is None else first
        _check_repeats(name, first[0], period[0])
        period_rms.add(period)
        sums.add(period)
    if sums.periods < grid.periods or first is None or last is None:
        raise InputError(
            f"{name}: holds fewer than {grid.transient_periods + grid.periods} periods of "
            f"{grid.samples_per_period} samples; record it whole or analyze fewer periods."
        )
    spectra = sums.spectra(grid.sample_rate_hz / grid.samples_per_period, grid.lines.last)
    _check_excited(name, spectra, grid.lines.excited)
    mismatch, transient = Mismatch(np.nan, np.nan, np.nan), float("nan")
    if previous is not None:
        mismatch = period_mismatch(sums, grid.lines)
        transient = unsettled(discarded, first[2], previous[2], last[2])
    return Realization(
        name,
        level,
        realization,
        spectra,
        mismatch,
        transient,
        period_rms.squares / sums.periods,
        period_rms.peak,
        _time_signals(last, grid) if keep_signals else None,
    )


class _Extremes:
    def __init__(self) -> None:
        self.squares = np.zeros(3)
        self.peak = np.zeros(3)

    def add(self, period: Samples) -> None:
        self.squares += [np.mean(signal**2) for signal in period[:3]]
        self.peak = np.maximum(self.peak, [np.abs(signal).max() for signal in period[:3]])


def _check_repeats(name: str, first: np.ndarray, period: np.ndarray) -> None:
    difference, scale = np.std(period - first), np.std(first)
    if difference > REFERENCE_REPEATS * scale:
        raise InputError(
            f"{name}: the reference does not repeat after {first.size} samples (rms difference "
            f"{difference / scale if scale else np.inf:.1%}); correct samples_per_period or "
            "transient_periods."
        )


LEAST_POWER = 1.0 / LARGEST**2
"""Power of a line (squared unit of its signal) that counts as none: its squares underflow."""


def _check_excited(name: str, spectra: RealizationSpectra, excited: np.ndarray) -> None:
    for signal, symbol, least in (
        (spectra.reference, "reference", 1e-14),
        (spectra.torque, "torque", 1e-14),
        (spectra.position, "position", 0.0),  # which may fall steeply with the frequency
    ):
        power = np.abs(signal[excited]) ** 2
        silent = np.flatnonzero(power <= max(least * power.mean(), LEAST_POWER))
        if silent.size:
            line = int(excited[silent[0]])
            raise InputError(
                f"{name}: the {symbol} is zero on excited harmonic {line} "
                f"({spectra.frequency_hz[line]:g} Hz); correct excited_harmonics or the signal."
            )


def period_mismatch(sums: PeriodSums, lines: Lines) -> Mismatch:
    """Measure the scatter between periods over the band.

    Two tests of significance, each at the level FALSE_ALARM; the greater excess counts:

    - By spectrum. Encoder noise is as strong above the band as in it, up to the sensitivity of the
      loop, while a motion of masses that does not repeat falls off by two or more decades of power
      above the band. The scatter in the band over `SENSITIVITY_POWER` times its median at high
      lines is held against the F distribution; noise in a loop with |S| < 2 stays below it.
    - By order, with three periods or more. Noise of any spectrum scatters as much with signs that
      alternate from period to period as otherwise; a motion of twice the period scatters so
      alone. The ratio follows F; degrees of freedom are those of the lines that carry the scatter.
    """
    degrees = sums.periods - 1
    top = sums.position.size - 1
    start = min(max((lines.last + top) // 2, lines.last + 1), top * 7 // 8)
    median_of_gamma = (1.0 - 1.0 / (9.0 * degrees)) ** 3
    high = sums.scatter_position[start:]
    floor = float(np.median(high)) / degrees / median_of_gamma
    band = slice(lines.first, lines.last + 1)
    scatter = float(sums.scatter_position[band].sum()) / degrees
    level = float((np.abs(sums.position[band]) ** 2).sum())
    torque_scatter = float(sums.scatter_torque[band].sum()) / degrees
    torque_level = float((np.abs(sums.torque[band]) ** 2).sum())
    count = band.stop - band.start
    beyond = scipy.stats.f.isf(
        FALSE_ALARM, 2 * degrees * count, _OF_MEDIAN * 2 * degrees * high.size
    )
    excess = scatter - beyond * SENSITIVITY_POWER * floor * count
    unexplained = max(excess, _alternating(sums, band), 0.0)
    return Mismatch(
        np.sqrt(_over(scatter, level)),
        np.sqrt(_over(torque_scatter, torque_level)),
        np.sqrt(_over(unexplained, level)),
    )


def _alternating(sums: PeriodSums, band: slice) -> float:
    """Return the power in the band that alternates from period to period beyond noise.

    In units of the scatter of one period; 0 for two periods, which cannot tell.
    """
    rest = sums.periods - 2
    if rest < 1:
        return 0.0
    odd = sums.periods % 2
    weight = sums.periods - odd / sums.periods
    alternating = sums.alternating[band] - odd * sums.position[band]
    power = np.abs(alternating) ** 2 / weight
    scatter = sums.scatter_position[band]
    if not scatter.any():
        return 0.0
    carrying = float(scatter.sum() ** 2 / (scatter**2).sum())
    others = max(float((scatter - power).sum()), 0.0) / rest
    beyond = scipy.stats.f.isf(FALSE_ALARM, 2.0 * carrying, 2.0 * carrying * rest)
    return max(float(power.sum()) - beyond * others, 0.0) / (sums.periods - 1)


def unsettled(
    discarded: np.ndarray | None,
    first: np.ndarray,
    previous: np.ndarray,
    last: np.ndarray,
    step: float = 0.0,
) -> float:
    """Return the rms of a transient still present, over rms of y.

    A transient decays: it is sought where the first kept period begins and, as that period
    continues the discarded one, where the discarded one ends. Each difference from the last period
    counts only above twice the power that the last two periods differ by (in the noisiest tenth of
    their second half), which noise does not reach, and above one step of a coarse encoder.

    Args:
        discarded: y of the last discarded period, (N,); None if there is none.
        first: y of the first kept period, (N,).
        previous: y of the last but one, (N,).
        last: y of the last, (N,).
        step: of the encoder; a difference of one step is no transient.
    """
    floor = max(2.0 * _tenths(previous - last)[SEGMENTS // 2 :].max(), step**2)
    excess = _tenths(first - last)[0] - floor
    if discarded is not None:
        excess = max(excess, _tenths(discarded - last)[-1] - floor)
    return float(np.sqrt(_over(max(excess, 0.0), np.var(last))))


def _over(part: float, whole: float) -> float:
    return part / whole if whole else float("inf" if part else "nan")


def _tenths(difference: np.ndarray) -> np.ndarray:
    """Return the mean square of each tenth of a period, (SEGMENTS,)."""
    edges = np.linspace(0, difference.size, SEGMENTS + 1).astype(int)
    sums = np.concatenate([[0.0], np.cumsum(difference**2)])[edges]
    return np.diff(sums) / np.maximum(np.diff(edges), 1)


def _time_signals(period: Samples, grid: Grid) -> TimeSignals:
    r, u, y = (signal.copy() for signal in period[:3])
    time_s = np.arange(r.size) / grid.sample_rate_hz
    return TimeSignals(time_s=time_s, reference_rad=r, torque_nm=u, position_rad=y)


def signal_blocks(reader: BagReader, samples: int) -> Iterator[Samples]:
    """Yield (r, u, y), or (r, u, y, q) of a bag that has a link position, in blocks.

    u stands for r where no reference is read.
    """
    for block in reader.blocks(samples):
        reference = block.torque if block.reference is None else block.reference
        link = () if block.link is None else (block.link,)
        yield reference, block.torque, block.position, *link
