"""References that are not periodic: chirps, noise, moves and steps.

Each function returns samples k = 1..n at t = k Ts (float64, rad) of a motion that begins at rest at
zero, where the simulated rig stands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from fjr_kit.errors import InputError

SOFT_START_S = 0.5
"""Rise of chirps and noise from zero (raised cosine)."""


def chirp(
    samples: int,
    sample_rate_hz: float,
    *,
    amplitude_rad: float,
    f_min_hz: float,
    f_max_hz: float,
    sweep: Literal["linear", "logarithmic"] = "linear",
    soft_start_s: float = SOFT_START_S,
) -> np.ndarray:
    """Return a sine of constant amplitude whose frequency rises once from f_min to f_max.

    Args:
        samples: how many.
        sample_rate_hz: their rate.
        amplitude_rad: peak of the sine.
        f_min_hz: frequency at the first sample.
        f_max_hz: frequency at the last sample, below half of the rate.
        sweep: whether the frequency rises linearly (flat spectrum) or by equal factors in equal
            times (as much time for each octave).
        soft_start_s: rise of the amplitude.

    Raises:
        InputError: an argument is out of its range.
    """
    _check_band(samples, sample_rate_hz, f_min_hz, f_max_hz)
    _check_positive("amplitude_rad", amplitude_rad)
    t = np.arange(1, samples + 1) / sample_rate_hz
    duration, ratio = samples / sample_rate_hz, f_max_hz / f_min_hz
    if sweep == "linear":
        cycles = f_min_hz * t + (f_max_hz - f_min_hz) * t**2 / (2.0 * duration)
    else:
        cycles = f_min_hz * duration * np.expm1(math.log(ratio) * t / duration) / math.log(ratio)
    return _risen(amplitude_rad * np.sin(2.0 * np.pi * cycles), sample_rate_hz, soft_start_s)


def noise(
    samples: int,
    sample_rate_hz: float,
    *,
    rms_rad: float,
    f_min_hz: float,
    f_max_hz: float,
    seed: int,
    soft_start_s: float = SOFT_START_S,
) -> np.ndarray:
    """Return Gaussian noise of flat spectrum between two frequencies and of none elsewhere.

    It is cut from noise of twice the length, so that it does not repeat and its end does not meet
    its start.

    Args:
        samples: how many.
        sample_rate_hz: their rate.
        rms_rad: expected rms.
        f_min_hz: lower edge of the band.
        f_max_hz: upper edge, below half of the rate.
        seed: seed of the noise.
        soft_start_s: rise of the amplitude.

    Raises:
        InputError: an argument is out of its range, or the record is too short for the band.
    """
    _check_band(samples, sample_rate_hz, f_min_hz, f_max_hz)
    _check_positive("rms_rad", rms_rad)
    whole = 2 * samples
    frequency = np.fft.rfftfreq(whole, 1.0 / sample_rate_hz)
    inside = (frequency >= f_min_hz) & (frequency <= f_max_hz)
    lines = int(inside.sum())
    if not lines:
        raise InputError(
            f"The band from {f_min_hz:g} to {f_max_hz:g} Hz holds no line of {samples} samples; "
            "widen it or make the record longer."
        )
    spectrum = np.zeros(frequency.size, complex)
    parts = np.random.default_rng(seed).standard_normal((lines, 2))
    spectrum[inside] = parts[:, 0] + 1j * parts[:, 1]
    signal = np.fft.irfft(spectrum, whole)[:samples] * (whole / math.sqrt(4.0 * lines))
    return _risen(rms_rad * signal, sample_rate_hz, soft_start_s)


def trapezoid(
    samples: int,
    sample_rate_hz: float,
    *,
    targets_rad: Sequence[float],
    velocity_rad_s: float | Sequence[float],
    acceleration_rad_s2: float,
    dwell_s: float = 0.0,
) -> np.ndarray:
    """Return moves of trapezoidal velocity from target to target, over and over.

    Args:
        samples: how many.
        sample_rate_hz: their rate.
        targets_rad: where each move ends; the first begins at zero.
        velocity_rad_s: greatest speed of the moves, one for all or one for each move in turn.
        acceleration_rad_s2: their acceleration and deceleration; a move that is too short for its
            speed is a triangle.
        dwell_s: standstill after each move.

    Raises:
        InputError: an argument is out of its range, no target differs from zero, or moves are
            shorter than a sample.
    """
    speeds = [float(each) for each in np.atleast_1d(velocity_rad_s)]
    _check_rate(samples, sample_rate_hz)
    _check_targets("targets_rad", targets_rad)
    _check_positive("velocity_rad_s", *speeds)
    _check_positive("acceleration_rad_s2", acceleration_rad_s2)
    _check_not_negative("dwell_s", dwell_s)
    t = np.arange(1, samples + 1) / sample_rate_hz
    out = np.full(samples, float(targets_rad[-1]))  # where a single target is held for ever
    begin, at, moves = 0.0, 0.0, 0
    while begin <= t[-1]:
        target, speed = float(targets_rad[moves % len(targets_rad)]), speeds[moves % len(speeds)]
        distance = abs(target - at)
        ramp = min(speed / acceleration_rad_s2, math.sqrt(distance / acceleration_rad_s2))
        peak = ramp * acceleration_rad_s2
        cruise = distance / peak - ramp if peak > 0.0 else 0.0
        end = begin + 2.0 * ramp + cruise
        now = slice(*np.searchsorted(t, [begin, end + dwell_s]))
        since = t[now] - begin
        rising, falling = np.minimum(since, ramp), np.clip(since - ramp - cruise, 0.0, ramp)
        travelled = 0.5 * acceleration_rad_s2 * (rising**2 - falling**2)
        travelled += peak * (np.clip(since - ramp, 0.0, cruise) + falling)
        moving = at + math.copysign(1.0, target - at) * travelled
        out[now] = np.where(t[now] < end, moving, target)
        if moves and dwell_s == 0.0 and not np.ptp(targets_rad):
            break
        begin, at, moves = end + dwell_s, target, moves + 1
        if moves > samples:
            raise InputError(
                "targets_rad are reached in less than a sample; choose them further apart."
            )
    return out


def steps(
    samples: int, sample_rate_hz: float, *, targets_rad: Sequence[float], hold_s: float
) -> np.ndarray:
    """Return steps from target to target, over and over; zero before the first one.

    Args:
        samples: how many.
        sample_rate_hz: their rate.
        targets_rad: the positions.
        hold_s: how long each is held, zero before the first one included.

    Raises:
        InputError: an argument is out of its range, or no target differs from zero.
    """
    _check_rate(samples, sample_rate_hz)
    _check_targets("targets_rad", targets_rad)
    _check_positive("hold_s", hold_s)
    # A step at a whole sample falls there, whatever the last bit of the time says.
    number = np.floor(np.arange(1, samples + 1) / (sample_rate_hz * hold_s) + 1e-9).astype(int)
    held = np.asarray(targets_rad, float)[(number - 1) % len(targets_rad)]
    return np.where(number > 0, held, 0.0)


def _risen(signal: np.ndarray, sample_rate_hz: float, soft_start_s: float) -> np.ndarray:
    _check_not_negative("soft_start_s", soft_start_s)
    rise = min(round(soft_start_s * sample_rate_hz), signal.size)
    signal[:rise] *= 0.5 - 0.5 * np.cos(np.pi * np.arange(1, rise + 1) / max(rise, 1))
    return signal


def _check_rate(samples: int, sample_rate_hz: float) -> None:
    _check_positive("samples", samples)
    _check_positive("sample_rate_hz", sample_rate_hz)


def _check_band(samples: int, sample_rate_hz: float, f_min_hz: float, f_max_hz: float) -> None:
    _check_rate(samples, sample_rate_hz)
    if not 0.0 < f_min_hz < f_max_hz < sample_rate_hz / 2.0:
        raise InputError(
            f"f_min_hz {f_min_hz:g} and f_max_hz {f_max_hz:g} must be a band within 0 and half of "
            f"sample_rate_hz, {sample_rate_hz / 2.0:g} Hz; correct them."
        )


def _check_targets(name: str, targets: Sequence[float]) -> None:
    if not len(targets) or not np.isfinite(targets).all() or not np.any(targets):
        raise InputError(f"{name} must hold finite positions, one at least other than zero.")


def _check_positive(name: str, *values: float) -> None:
    if not values or not all(0.0 < value < math.inf for value in values):
        raise InputError(f"{name} must be greater than zero and finite.")


def _check_not_negative(name: str, value: float) -> None:
    if not 0.0 <= value < math.inf:
        raise InputError(f"{name} must be zero or greater, and finite.")
