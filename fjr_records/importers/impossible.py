"""Signals that no axis gives: magnitudes in place of signed ones, and positions that jump.

They are told from the signals alone and may be meant, so they are doubts: an import goes on.
"""

from __future__ import annotations

import numpy as np

TORQUE = (
    "the torque has one sign while the motion goes both ways, and turns at zero, as the magnitude "
    "of one does; map a column that has the sign"
)
SPEED = (
    "the speed has one sign, but leaves zero under torques of both signs, as the magnitude of one "
    "does; map a column that has the sign, or the angle"
)
_NEAR = 0.1  # of the rms: so near to zero is a dip
_CLEAR = 0.3  # of the rms: so far from zero the dip is over
_DIPS = 5  # fewest that tell anything
_BOTH_WAYS = 0.2  # of the path, or of the dips, at least, in each direction
_BELOW = 0.02  # of the greatest speed: noise below zero
_JUMP, _PART = 10.0, 5e-3  # times the steps beside it; and of the travelled range
_BESIDE = 20  # samples on either side


def magnitude_of_torque(torque: np.ndarray, position: np.ndarray) -> str | None:
    """Return the clause that doubts a torque of one sign which comes to zero again and again.

    The motion must reverse. A weight takes a torque of one sign as well, but one that passes zero
    where it comes near.

    Args:
        torque: u, float64 (samples,), of any unit.
        position: y, likewise.
    """
    signed = torque if torque.mean() >= 0.0 else -torque
    steps = np.diff(position)
    path = float(np.abs(steps).sum())
    back = min(steps[steps > 0.0].sum(), -steps[steps < 0.0].sum())
    if signed.min() < 0.0 or not back > _BOTH_WAYS * path or len(_dips(signed)) < _DIPS:
        return None
    return TORQUE


def magnitude_of_speed(speed: np.ndarray, torque: np.ndarray) -> str | None:
    """Return the clause that doubts a speed of one sign which leaves zero under either torque.

    An axis that stops and goes on the same way is set off by a torque of one sign.

    Args:
        speed: float64 (samples,), of any unit.
        torque: u, likewise.
    """
    signed = speed if speed.mean() >= 0.0 else -speed
    if not signed.max() > 0.0 or signed.min() < -_BELOW * signed.max():
        return None
    off = [float(torque[dip].mean()) for dip in _dips(signed)]
    forwards = float(np.mean(np.array(off) > 0.0)) if len(off) >= _DIPS else 0.0
    if not _BOTH_WAYS <= forwards <= 1.0 - _BOTH_WAYS:
        return None
    return SPEED


def jump(position: np.ndarray, stamps_s: np.ndarray) -> str | None:
    """Return the clause that tells of a position which jumps as no axis moves, or None.

    Args:
        position: y, float64 (samples,), of any unit.
        stamps_s: when it was taken, float64 (samples,), s.
    """
    steps = np.abs(np.diff(position))
    moved = steps[steps > 0.0]
    if steps.size <= 2 * _BESIDE or not moved.size:
        return None
    speed = steps / np.diff(stamps_s)
    beside = np.zeros(steps.size)
    for lag in range(1, _BESIDE + 1):
        beside[lag:] = np.maximum(beside[lag:], speed[:-lag])
        beside[:-lag] = np.maximum(beside[:-lag], speed[lag:])
    least = max(_PART * float(np.ptp(position)), _JUMP * float(moved.min()))
    found = np.flatnonzero((speed > _JUMP * beside) & (steps > least))
    if not found.size:
        return None
    at = int(found[steps[found].argmax()])
    more = f" (and {found.size - 1} times more)" if found.size > 1 else ""
    return (
        f"the position jumps from {position[at]:.4g} to {position[at + 1]:.4g} after sample {at}, "
        f"at {stamps_s[at]:.6g} s{more}, {_times(speed[at], beside[at])} as fast as it moves "
        "beside that; of runs that were joined make a file each, or keep one by --skip-samples "
        "and --keep-samples"
    )


def _times(speed: float, beside: float) -> str:
    return f"{speed / beside:.3g} times" if beside > 0.0 else "infinitely"


def _dips(signal: np.ndarray) -> list[slice]:
    """Return the samples at which a signal, not negative, rises again after each dip to zero."""
    size = float(np.sqrt(np.mean(signal**2)))
    low, high = signal < _NEAR * size, signal > _CLEAR * size
    marked = np.flatnonzero(low | high)
    ends = np.flatnonzero(low[marked[:-1]] & high[marked[1:]])
    return [slice(int(marked[end]), int(marked[end + 1]) + 1) for end in ends]
