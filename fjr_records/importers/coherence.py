"""Whether reference, torque and position belong to one run, in one unit, under one controller."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import signal

from ..spectra import line_spectrum
from ..units import FOLLOWING_LIMIT, following, unit_taken_for_rad
from .repetition import Repetition

UNRELATED = 0.3
"""Squared coherence, and correlation, below which two signals have nothing to do with each other:
chance alone gives about 0.1."""
ROUGH = 0.5
"""Smoothness of the response below which its phases are random: chance alone gives one over the
root of the number of lines."""
LEAST_LINES = 12
_SEGMENTS = 16
_CLEAR = 3.0
_LAG = 0.1
"""Part of the record by which the position may lag behind the reference."""


def unrelated(signals: Mapping[str, np.ndarray], repetition: Repetition | None) -> str | None:
    """Return why the reference seems to be that of another run, or None."""
    if "r" not in signals or not np.ptp(signals["r"]) > 0:
        return None
    if repetition is None:
        r, u, y = (_near_one(signals[s]) for s in "ruy")
        alike, least = max(_coherence(r, u), _coherence(r, y), _correlation(r, y)), UNRELATED
    elif repetition.excited.size >= LEAST_LINES:
        alike, least = max(_smoothness(signals["r"], signals[s], repetition) for s in "uy"), ROUGH
    else:
        return None
    if alike >= least:
        return None
    return (
        f"torque and position do not go with the reference (likeness {alike:.2f} of 1), so it is "
        "that of another run; map the right one, or leave the reference out"
    )


def _near_one(values: np.ndarray) -> np.ndarray:
    """Return a signal times a power of two, so that no product of powers overflows or vanishes."""
    return np.ldexp(values, -np.frexp(np.abs(values).max())[1])


def _coherence(one: np.ndarray, other: np.ndarray) -> float:
    """Return the coherence of two signals, weighted by the power of both."""
    length = max(16, 2 * one.size // (_SEGMENTS + 1))
    if one.size < 2 * length:
        return 1.0
    kind = {"nperseg": length, "detrend": "linear"}
    cross = np.abs(signal.csd(one, other, **kind)[1]) ** 2
    power = signal.welch(one, **kind)[1] * signal.welch(other, **kind)[1]
    weight = np.sqrt(power)
    there = power > 0
    total = float(weight.sum())
    return float((cross[there] / weight[there]).sum() / total) if total > 0 else 0.0


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Return the greatest correlation of the second signal with the first one before it."""
    a, b = one - one.mean(), other - other.mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    if not scale > 0:
        return 0.0
    product = signal.correlate(b, a, method="fft")[one.size - 1 :]
    return float(np.abs(product[: max(1, int(_LAG * one.size))]).max() / scale)


def _smoothness(reference: np.ndarray, other: np.ndarray, found: Repetition) -> float:
    """Return how alike the response is on neighbouring lines: random phases give nearly zero."""
    n = found.samples_per_period
    kept = slice(found.transient_periods * n, found.samples)
    r, x = (
        line_spectrum(each[kept].reshape(-1, n))[:, found.excited] for each in (reference, other)
    )
    mean = x.mean(axis=0)
    response = mean / r.mean(axis=0)
    noise = x.std(axis=0) / np.sqrt(max(found.periods - 1, 1))
    steps = response[1:] * np.conj(response[:-1])
    # A delay turns every step by as much as the lines are apart.
    gaps = np.diff(found.excited)
    clear = np.abs(mean) > _CLEAR * noise
    chosen = (gaps == np.bincount(gaps).argmax()) & clear[1:] & clear[:-1] & (np.abs(steps) > 0)
    if chosen.sum() < LEAST_LINES // 2:
        return 1.0
    return float(np.abs(np.mean(steps[chosen] / np.abs(steps[chosen]))))


def angle_ratio(signals: Mapping[str, np.ndarray], repetition: Repetition | None) -> float:
    """Return how many times larger the position is than the reference; NaN without one."""
    if "r" not in signals:
        return float("nan")
    if repetition is None:
        scale = float(np.std(signals["r"]))
        return float(np.std(signals["y"])) / scale if scale > 0 else float("nan")
    n = repetition.samples_per_period
    periods = slice(repetition.transient_periods * n, repetition.samples)
    mean = signals["y"][periods].reshape(-1, n).mean(axis=0)
    return following(repetition.amplitudes, line_spectrum(mean)[repetition.excited])


def unit_doubt(ratio: float, one: str, other: str) -> str | None:
    """Return what a ratio of two angles, large to small, says against their units, or None."""
    if ratio > FOLLOWING_LIMIT:
        large, small, times = one, other, ratio
    elif 0 < ratio < 1.0 / FOLLOWING_LIMIT:
        large, small, times = other, one, 1.0 / ratio
    else:
        return None
    unit = unit_taken_for_rad(times)
    if unit is None:
        return (
            f"the {large} is {times:.3g} times the {small}, as if it were in counts of an encoder, "
            "in another unit or on the other side of a gear; give its factor to rad, as in "
            f"{large}=COLUMN:FACTOR"
        )
    short = {"degrees": "deg"}.get(unit, unit)
    counts = "" if unit == "degrees" else f", or {large}=COLUMN:FACTOR if it counts encoder steps"
    return (
        f"the {large} is {times:.3g} times the {small}, as if it were in {unit} and taken for rad; "
        f"give its unit, as in {large}=COLUMN:{short}{counts}"
    )
