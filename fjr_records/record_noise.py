"""Noise of records that do not repeat in periods: from repeats, a standstill, or the highest lines.

Encoder noise is white, a motion of masses is not: it falls off by four powers of frequency in
power. So the highest lines show the noise of the position where they are flat. Where a record
stands still its own scatter shows it, unless that is far from white: an axis that starts may seem
to stand beside the many turns that follow. Where a reference was played twice half the power of the
difference does, line by line, friction that scatters from run to run included. An encoder that
counts in steps rounds, which is noise of a variance of step^2/12 whatever else is seen: one that
stands still reads the same count for ever.

A position that is the integral of a speed walks at random with the white noise of that speed, and
its power falls off by two powers of frequency. Where the speed is itself the difference of encoder
counts its noise rises with frequency, and its integral is the encoder's again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.signal import welch

from fjr_interface.experiment import Experiment

from .encoder_step import position_step
from .records import Record, RecordSet

NoiseSource = Literal["repeats", "standstill", "residual", "none"]

_TOP = 0.75  # of the lines, above which only noise is expected
_TRAPEZOID = 0.9  # of the lines, up to which the trapezoidal rule leaves noise to be seen
_MIDDLE = 0.25, 0.5  # of the lines, with which those below _TRAPEZOID are compared
_RISES = 2.0  # ratio of power above these from which noise is that of differences of encoder counts
_FLAT = 2.0  # greatest ratio of power between the halves of these lines that counts as flat
_ABOVE = 4.0  # times the power of noise, from which a line holds a signal
_SEGMENTS, _LEAST_SEGMENT = 8, 256  # of a record, whose spectra are averaged; samples of one
_LINE = 4  # bins from the middle of a line to its end in the spectrum's window
_STILL_S = 0.2
_STILL = 1e-3  # of the travelled range: the most that a standing axis moves
_LEAST_STILL = 50  # samples
_SCATTERS = 1e-9  # of the travelled range: less is the arithmetic's
_QUIETEST = 0.1  # of the pieces that stand still: in others the motion may still settle
_WHITE = 3.0  # times what second differences show of white noise: more scatter is not white


@dataclass(frozen=True)
class RecordNoise:
    """What is known of the noise of the position.

    Attributes:
        source: what it was found from; none if nothing shows it.
        std_rad: standard deviation of one sample of white noise, at least that of rounding; NaN if
            not known.
        step_rad: of the encoder; None where the positions show none.
        walks: whether std_rad is that of what each sample adds to the noise of the one before.
        seen_rad: what scatter from repeat to repeat, or at a standstill, shows, which rounding
            takes no part in where it repeats; NaN where none does.
    """

    source: NoiseSource
    std_rad: float
    step_rad: float | None = None
    walks: bool = False
    seen_rad: float = math.nan

    @property
    def known(self) -> bool:
        """Whether any noise is known, so that something can be significant."""
        return self.source != "none"

    @property
    def rounds(self) -> bool:
        """Whether what counts as noise is what the encoder rounds away, since no more is seen."""
        return self.step_rad is not None and self.std_rad <= self.step_rad / math.sqrt(12.0)

    def power(self, cycles: np.ndarray) -> np.ndarray:
        """Return the variance of a line of an orthonormal transform (rad2), of the shape of cycles.

        Args:
            cycles: frequency of the line in cycles per sample, above 0.
        """
        white = np.full(cycles.shape, self.std_rad**2)
        if not self.walks:
            return white
        seen = np.minimum(cycles, 0.5 * _TRAPEZOID)
        return white / (2.0 * np.tan(np.pi * seen)) ** 2


def record_noise(records: RecordSet) -> RecordNoise:
    """Return the noise of the position, by the best evidence that the records hold."""
    if any(record.description.integrated for record in records.records):
        walks = [w for w in (_walk(r.position) for r in records.records) if w is not None]
        if walks:
            return RecordNoise("residual", float(np.median(walks)), walks=True)
    step = position_step([r.position for r in records.records])
    rounding = 0.0 if step is None else step / math.sqrt(12.0)
    seen = _seen(records, rounding)
    if not seen.known and step is not None:
        return RecordNoise("residual", rounding, step)
    scatters = seen.source in ("repeats", "standstill") and seen.std_rad > 0.0
    by_scatter = seen.std_rad if scatters else math.nan
    return RecordNoise(seen.source, max(seen.std_rad, rounding), step, seen_rad=by_scatter)


def _seen(records: RecordSet, rounding: float) -> RecordNoise:
    """Return the noise that scatter shows; what stands still without any shows that of rounding.

    White noise of a standstill is in second differences of the whole record, beside its motion.
    """
    repeated = _of_differences([*_between_repeats(records), *_between_periods(records)])
    if repeated is not None:
        return RecordNoise("repeats", repeated)
    still = [s for s in map(_standstill, records.records) if s is not None]
    scatter = float(np.sqrt(np.mean(np.square(still)))) if still else 0.0
    stands = bool(still) and max(scatter, rounding) > 0.0
    white = max(_steps(r.position) or 0.0 for r in records.records)
    if stands and scatter <= max(_WHITE * white, math.sqrt(12.0) * rounding):
        return RecordNoise("standstill", scatter)
    found = [floor for floor in (_floor(r.position) for r in records.records) if floor is not None]
    if found and not (stands and np.median(found) > scatter):
        return RecordNoise("residual", float(np.median(found)))
    if stands:
        return RecordNoise("standstill", scatter)
    return RecordNoise("none", float("nan"))


def stands_above_noise(records: RecordSet, frequency_hz: np.ndarray) -> np.ndarray:
    """Return at which frequencies the position of some record holds more than its noise, bool (F,).

    Everywhere, if the noise is not known. The ends of the band are known to the width of a line of
    the spectrum's window, which is taken off.
    """
    noise, rate = record_noise(records), records.sample_rate_hz
    if not noise.known:
        return np.ones(frequency_hz.shape, bool)
    above = np.zeros(frequency_hz.shape, bool)
    for record in records.records:
        length = min(max(record.samples // _SEGMENTS, _LEAST_SEGMENT), record.samples)
        at, density = welch(record.position, rate, "blackmanharris", length, detrend="linear")
        limit = _ABOVE * 2.0 * noise.power(np.maximum(at, 0.5 * at[1]) / rate) / rate
        held = np.flatnonzero(density > limit)
        if not held.size:
            continue
        low = at[held[0] + _LINE] if held[0] > _LINE else 0.0
        high = at[held[-1] - _LINE] if held[-1] < at.size - _LINE else at[-1]
        inside = (frequency_hz >= low) & (frequency_hz <= high)
        above |= inside & (np.interp(frequency_hz, at, density - limit) > 0.0)
    return above


def _between_repeats(records: RecordSet) -> list[np.ndarray]:
    """Return what differs between records that repeat each other."""
    return [
        records.records[one].position - records.records[other].position
        for group in records.repeats
        for one, other in pairwise(group)
    ]


def _between_periods(records: RecordSet) -> list[np.ndarray]:
    """Return what differs between the periods after the transient."""
    found = []
    for record in records.records:
        description = record.description
        if isinstance(description, Experiment):
            length = description.samples_per_period
            whole = record.position[: record.samples // length * length]
            periods = whole.reshape(-1, length)
            found += list(np.diff(periods[description.transient_periods :], axis=0))
    return found


def _of_differences(differences: Sequence[np.ndarray]) -> float | None:
    """Return the white part of differences between repeats; None where none shows it."""
    floors = []
    for difference in differences:
        floor = _floor(difference)
        if floor is None:
            floor = _steps(difference)
        if floor is not None:
            floors.append(floor / np.sqrt(2.0))
    return float(np.median(floors)) if floors else None


def _floor(signal: np.ndarray) -> float | None:
    """Return the standard deviation of white noise that the highest lines show; None if not."""
    window = np.hanning(signal.size)
    power = np.abs(np.fft.rfft((signal - signal.mean()) * window)) ** 2 / np.sum(window**2)
    top = power[int(_TOP * power.size) : -1]
    lower, upper = (float(np.median(half)) / np.log(2.0) for half in np.array_split(top, 2))
    if not upper > 0.0 or lower > _FLAT * upper:
        return None
    return float(np.sqrt(0.5 * (lower + upper)))


def _walk(signal: np.ndarray) -> float | None:
    """Return what each sample of the trapezoidal integral of white noise adds; None if not seen."""
    steps = np.diff(signal)
    window = np.hanning(steps.size)
    power = np.abs(np.fft.rfft((steps - steps.mean()) * window)) ** 2 / np.sum(window**2)
    seen = power.size * np.array([*_MIDDLE, _TOP, 0.5 * (_TOP + _TRAPEZOID), _TRAPEZOID])
    cycles = np.arange(power.size) / steps.size
    white = power[: int(seen[-1])] / np.cos(np.pi * cycles[: int(seen[-1])]) ** 2
    middle, _, lower, upper = (
        float(np.median(part)) / np.log(2.0) if part.size else 0.0
        for part in np.split(white, seen[:-1].astype(int))[1:]
    )
    if not lower > 0.0 or lower > _FLAT * upper or upper > _RISES * middle:
        return None
    return float(np.sqrt(0.5 * (lower + upper)))


def _steps(difference: np.ndarray) -> float | None:
    """Return what second differences show of white noise; None if they show nothing."""
    second = np.diff(difference, 2)
    deviation = float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6.0)
    return deviation or None


def _standstill(record: Record) -> float | None:
    """Return the scatter of the position where the axis stands; None if it never does.

    Zero if it reads the same value there for ever. Times at which a brake held the axis, which are
    left out of the record, count as well.
    """
    least = _LEAST_STILL, _STILL_S * record.description.sample_rate_hz
    length = int(max(least))
    travel = float(np.ptp(record.position))
    own = [record.position] if record.samples >= 2 * length else []
    pieces = [p for each in (*own, *record.held) for p in _pieces(each, length)]
    still = [_detrended(piece) for piece in pieces if np.ptp(piece) < _STILL * travel]
    if not still:
        return None
    scatter = float(np.quantile(still, _QUIETEST))
    return scatter if scatter > _SCATTERS * travel else 0.0


def _pieces(signal: np.ndarray, length: int) -> np.ndarray:
    return signal[: signal.size // length * length].reshape(-1, length)


def _detrended(piece: np.ndarray) -> float:
    time = np.arange(piece.size)
    rest = piece - np.polyval(np.polyfit(time, piece, 2), time)
    return float(np.sqrt(np.sum(rest**2) / (piece.size - 3)))


def band_lines(
    power: Sequence[float] | np.ndarray, noise_power: float | np.ndarray, least: int = 8
) -> int:
    """Return how many lines from the lowest on hold a signal.

    Args:
        power: (lines,), mean power of each line over windows and records.
        noise_power: of one line, or of each; NaN if not known.
        least: fewest lines to return.
    """
    power = np.asarray(power)
    known = bool(np.isfinite(noise_power).all())
    floor = _ABOVE * noise_power if known else 1e-12 * power.max(initial=0.0)
    smooth = np.convolve(power, np.ones(5) / 5.0, "same")
    above = np.flatnonzero(smooth > floor)
    last = int(above[-1]) + 1 if above.size else 0
    return min(max(last, least), power.size)
