"""Does the torque drive the axis, or only brake it? What a wrong sign of either signal shows."""

from __future__ import annotations

import numpy as np

BRAKES = -0.1
"""Correlation of torque and velocity below which nothing passive can have moved: of the runs of 44
emulated rigs none has less than -0.03, by a late drive."""


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


def wrong_sign(torque: np.ndarray, position: np.ndarray) -> str | None:
    """Return the clause that doubts the sign of a torque which brakes the motion, or None."""
    found = drives(torque, position)
    if found >= BRAKES:
        return None
    return (
        f"the torque brakes the motion more than it drives it (correlation with the velocity "
        f"{found:.2f}); unless something else moves the axis, torque or position has the wrong sign"
    )
