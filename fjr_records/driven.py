"""Does the torque drive the axis? What a wrong sign of torque, position or reference shows."""

from __future__ import annotations

import numpy as np
import scipy.fft

BRAKES = -0.1
"""Correlation of torque and velocity below which nothing passive can have moved, unless the drive
is late: of the runs of 44 emulated rigs none has less than -0.03 but for late drives."""
_BACKWARDS, _FORWARDS = -0.5, 0.3
"""Correlation of torque and acceleration, beside what goes with the angle, below which a mass would
be negative, and above which it is none that the torque only brakes: of 353 runs of emulated rigs
none has less than -0.06."""
_FIRST = 4  # line: those before hold drift
_FEWEST = 20  # lines
_SLOWER = 8
"""How far below half the sample rate lines end: above, signals that were logged a sample apart seem
to go with the acceleration where they go with the velocity."""
_OPPOSED = (0.5, 2.0)
"""Range of |Y/R| at the lowest lines within which a position is that of a position loop."""
_LOWEST = 0.1  # of the power of the reference


def drives(torque: np.ndarray, position: np.ndarray) -> float:
    """Return the correlation of torque and velocity, in [-1, 1]: the work done, over the most.

    A motor that moves masses and friction from rest to rest does positive work.

    Args:
        torque: u, float64 (samples,), N m.
        position: y, likewise, rad.
    """
    steps, held = np.diff(position), torque[:-1]
    steps, held = steps / (np.abs(steps).max() or 1.0), held / (np.abs(held).max() or 1.0)
    most = float(np.sqrt((held @ held) * (steps @ steps)))
    return float(held @ steps) / most if most > 0.0 else 0.0


def accelerates(torque: np.ndarray, position: np.ndarray) -> float:
    """Return the correlation of torque and acceleration beside what goes with the angle.

    In [-1, 1]. It is near 1 where the torque moves a mass, small where it works against friction or
    a spring, and never far below zero: masses are positive. Lines up to half of the velocity's
    power count, below an eighth of half the sample rate.

    Args:
        torque: u, float64 (samples,), N m.
        position: y, likewise, rad.
    """
    u, y = _lines(torque), _lines(position)
    k = np.arange(y.size, dtype=float)
    power = (k * np.abs(y)) ** 2
    power[:_FIRST] = 0.0
    total = np.cumsum(power)
    if not total.size or not total[-1] > 0.0:
        return 0.0
    top = min(int(np.searchsorted(total, 0.5 * total[-1])) + 1, y.size // _SLOWER)
    top = max(top, min(_FEWEST, y.size))
    u, y, k = u[_FIRST:top], y[_FIRST:top], k[_FIRST:top] / top
    beside = [x - np.vdot(y, x).real / np.vdot(y, y).real * y for x in (u, -(k**2) * y)]
    most = float(np.prod([np.linalg.norm(x) for x in beside]))
    return float(np.vdot(*beside).real) / most if most > 0.0 else 0.0


def _lines(signal: np.ndarray) -> np.ndarray:
    moved = signal - signal.mean()
    return scipy.fft.rfft(moved / (np.abs(moved).max() or 1.0) * np.hanning(moved.size))


def goes_backwards(torque: np.ndarray, position: np.ndarray) -> bool:
    """Tell whether the torque would accelerate a negative mass."""
    return accelerates(torque, position) < _BACKWARDS


def wrong_sign(torque: np.ndarray, position: np.ndarray) -> str | None:
    """Return the clause that doubts the sign of a torque against the motion, or None."""
    mass, work = accelerates(torque, position), drives(torque, position)
    if mass < _BACKWARDS:
        return (
            "the torque goes against the acceleration, as if it moved a negative mass (correlation "
            f"{mass:.2f}), so torque or position has the wrong sign"
        )
    if work < BRAKES and mass < _FORWARDS:
        return (
            f"the torque brakes the motion more than it drives it (correlation with the velocity "
            f"{work:.2f}); unless something else moves the axis, torque or position has the wrong "
            "sign"
        )
    return None


def opposes(reference: np.ndarray, position: np.ndarray) -> str | None:
    """Return the clause that doubts the sign of a reference which the position mirrors, or None.

    At the lowest frequencies a position loop follows its reference.

    Args:
        reference: r, float64 (samples,), rad.
        position: y, likewise.
    """
    r, y = (scipy.fft.rfft((x - x.mean()) * np.hanning(x.size)) for x in (reference, position))
    power = np.abs(r) ** 2
    power[: _FIRST // 2] = 0.0
    total = np.cumsum(power)
    if not total.size or not 0.0 < total[-1] < np.inf:
        return None
    top = max(int(np.searchsorted(total, _LOWEST * total[-1])) + 1, _FIRST)
    lowest = slice(_FIRST // 2, top)
    ratio = complex(np.vdot(r[lowest], y[lowest]) / power[lowest].sum())
    mirrored = ratio.real < -2.0 * abs(ratio.imag)
    if not (mirrored and _OPPOSED[0] < abs(ratio) < _OPPOSED[1]):
        return None
    return (
        "the position goes against the reference at the lowest frequencies (Y/R "
        f"{ratio.real:.2f}), which no position loop does, so position or reference has the wrong "
        "sign"
    )
