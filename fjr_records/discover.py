"""Finding period, excited lines and transient of a bag that nobody described."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.fft

from fjr_kit.errors import InputError

from .spectra import Samples, line_spectrum

PREFIX_SAMPLES = 2**21
"""At most so many samples from the start of a bag are looked at, so memory stays bounded."""
LEAST_PERIOD = 8
REPEATS = 0.3
"""Greatest rms difference between two periods, relative to the rms, that counts as a repetition."""
WHOLE = 0.02
"""Greatest distance of the period from a whole number of samples, in samples."""
LINE_GAP = 3.0
"""Least ratio between the weakest excited line and the strongest of the others."""
SETTLED = 0.01
"""Difference of y from its last period, relative to its rms, below which a period is settled."""

_MEND = "give samples_per_period, or add an experiment description"


class NoPeriodError(InputError):
    """The signals show no period, or no lines that stand out."""


@dataclass(frozen=True)
class Found:
    """What the signals themselves tell.

    Attributes:
        samples_per_period: N.
        excited: (F,), excited harmonics.
        amplitudes: (F,), |R| there, in rad.
        transient_periods: leading periods that differ in y.
        periods: whole periods after those in the part looked at.
    """

    samples_per_period: int
    excited: np.ndarray
    amplitudes: np.ndarray
    transient_periods: int
    periods: int


def read_prefix(blocks: Iterable[Samples]) -> tuple[np.ndarray, np.ndarray, int]:
    """Return r and y of the first `PREFIX_SAMPLES` samples, and the bag's number of samples."""
    kept, total = [], 0
    for r, _, y in blocks:
        if total < PREFIX_SAMPLES:
            kept.append(np.stack([r, y])[:, : PREFIX_SAMPLES - total])
        total += r.size
    if not kept:
        return np.empty(0), np.empty(0), 0
    reference, position = np.concatenate(kept, axis=1)
    return reference, position, total


def discover(
    name: str, reference: np.ndarray, position: np.ndarray, samples_per_period: int | None = None
) -> Found:
    """Find period, excited lines and transient.

    Args:
        name: name of the bag, for messages.
        reference: r, (samples,) in rad.
        position: y, (samples,) in rad.
        samples_per_period: N, if it is known.

    Raises:
        NoPeriodError: the reference is constant, does not repeat, its period is not a whole number
            of samples, or its lines do not stand out.
    """
    period = samples_per_period or find_period(name, reference)
    count = reference.size // period
    if count < 1:
        raise InputError(f"{name}: holds fewer than one period of {period} samples; record more.")
    periods = reference[: count * period].reshape(count, period)
    transient = find_transient(position[: count * period].reshape(count, period))
    excited, amplitudes = find_lines(name, periods[transient:].mean(axis=0))
    divisor = int(np.gcd.reduce(excited))
    if divisor > 1 and samples_per_period is None:
        if period % divisor:
            raise _not_whole(name, period / divisor)
        return discover(name, reference, position, period // divisor)
    return Found(period, excited, amplitudes, transient, count - transient)


def find_period(name: str, reference: np.ndarray) -> int:
    """Return the period in whole samples.

    Peaks of the normalised autocorrelation are candidates; of those after which the end of the
    record repeats as well as after any other (within a factor of two of the rms difference), the
    shortest is the period. The beginning is not compared: it may be a soft start.

    Raises:
        NoPeriodError: the reference is constant, does not repeat, or its period is not a whole
            number of samples.
    """
    x = reference - reference.mean()
    if not x.any():
        raise NoPeriodError(f"{name}: the reference is constant; map the topic that carries it.")
    candidates = _peaks(x)
    difference = np.array([_difference(x, lag) for lag in candidates])
    best = difference.min(initial=np.inf)
    if best > REPEATS:
        raise NoPeriodError(
            f"{name}: the reference does not repeat within {x.size} samples; record two or more "
            f"periods, or {_MEND}."
        )
    period = int(candidates[np.flatnonzero(difference <= max(2.0 * best, 1e-9))[0]])
    sharpest = int(candidates[difference.argmin()])
    exact = (sharpest + _shift(x, sharpest)) / round(sharpest / period)
    if abs(exact - period) > WHOLE:
        raise _not_whole(name, exact / round(exact / candidates[0]))
    return period


def _not_whole(name: str, period: float) -> NoPeriodError:
    return NoPeriodError(
        f"{name}: the period of the reference is about {period:.2f} samples, which is not a whole "
        "number; choose sample rate and base frequency so that it is, or resample."
    )


def _peaks(x: np.ndarray) -> np.ndarray:
    """Return lags at peaks of the normalised autocorrelation, ascending, up to half the record."""
    size = scipy.fft.next_fast_len(2 * x.size, real=True)
    power = np.abs(scipy.fft.rfft(x, size)) ** 2
    lags = np.arange(x.size // 2 + 1)
    energy = np.concatenate([[0.0], np.cumsum(x**2)])
    overlap = energy[x.size - lags] + energy[-1] - energy[lags]
    product = scipy.fft.irfft(power, size)[: lags.size]
    similarity = 2.0 * product / np.maximum(overlap, np.finfo(float).tiny)
    inner = similarity[LEAST_PERIOD:]
    padded = np.concatenate([similarity[LEAST_PERIOD - 1 : LEAST_PERIOD], inner, [-np.inf]])
    peak = (inner >= padded[:-2]) & (inner >= padded[2:])
    peak &= inner > inner.max(initial=0.0) - 0.3
    return LEAST_PERIOD + np.flatnonzero(peak)[:500]


def _difference(x: np.ndarray, lag: int) -> float:
    """Return the rms difference between the last two stretches of `lag` samples over their rms.

    The worst sample is left out: records often end in one that was cut off.
    """
    last, before = x[-lag:], x[-2 * lag : -lag]
    squares = (last - before) ** 2
    return float(np.sqrt((squares.sum() - squares.max()) / max(np.sum(last**2), 1e-300)))


def _shift(x: np.ndarray, lag: int) -> float:
    """Return how much longer than `lag` the period is, in samples, to first order.

    Like `_difference` it leaves the worst sample out.
    """
    difference, slope = x[-lag:] - x[-2 * lag : -lag], np.gradient(x)[-lag:]
    difference[np.abs(difference).argmax()] = 0.0
    return float(-np.sum(difference * slope) / max(np.sum(slope**2), 1e-300))


def find_lines(name: str, period: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return excited harmonics and their amplitudes: those above the widest gap in level.

    Raises:
        NoPeriodError: no lines stand out.
    """
    level = np.abs(line_spectrum(period))[1 : (period.size - 1) // 2 + 1]
    ranked = np.sort(np.maximum(level, 1e-9 * level.max(initial=0.0)))[::-1]
    ratio = ranked[:-1] / ranked[1:]
    if ratio.max(initial=1.0) < LINE_GAP:
        raise NoPeriodError(
            f"{name}: no excited lines stand out in the spectrum of the reference; add an "
            "experiment description."
        )
    weakest = ranked[int(ratio.argmax())]
    excited = 1 + np.flatnonzero(level >= weakest)
    return excited, level[excited - 1]


def find_transient(position: np.ndarray) -> int:
    """Return how many leading periods of y, of shape (periods, N), differ from the last one.

    A period is settled if it differs from the last by no more than twice what the last but one does
    (noise), or by less than `SETTLED`.
    """
    count = len(position)
    scale = max(float(np.std(position[-1])), 1e-300)
    difference = np.std(position - position[-1], axis=1) / scale
    noise = difference[-2] if count > 2 else 0.0
    unsettled = np.flatnonzero(difference > max(2.0 * noise, SETTLED))
    return int(unsettled[-1]) + 1 if unsettled.size else 0
