"""The torque that holds the plant at a place or moves it slowly, without inertia, compiled.

What remembers or waits (bristles, hysteresis, a third mass, delay, lag, a slew limit) has come to
rest, the transmission is bent by so little that motor and link stand at one angle, and friction is
at its level against the direction of travel.
"""

from __future__ import annotations

from fjr_kit.compiled import inlined, jit

from .. import effects as fx
from .places import is_rigid
from .torques import (
    link_drive,
    link_level,
    link_viscous,
    motor_drive,
    motor_level,
    motor_viscous,
    outside,
    torque_ripple,
)


@inlined
def _transmitted(th, v, direction, p, e):
    """Return the torque by which the transmission turns the motor (N m).

    Of one body, what its gear carries, which turns it already.
    """
    if is_rigid(p):
        return 0.0 if e is None else outside(th, th, e)
    friction = link_level(abs(v), p, e) * direction + link_viscous(v, p, e)
    return link_drive(th, v, 0.0, th, v, th, p, e) - friction


@jit
def torque_along(angle, speed, direction, p, e, torque):
    """Set the torque that the motor needs along a slow motion.

    Args:
        angle: of the motor, float64 (n,), rad.
        speed: likewise, rad/s.
        direction: of travel, likewise: 1 or -1.
        p: from `coefficients`.
        e: from `effects.coefficients`, or None.
        torque: likewise, N m; overwritten.
    """
    for k in range(angle.size):
        th, v, way = angle[k], speed[k], direction[k]
        te = _transmitted(th, v, way, p, e)
        needed = motor_level(abs(v), way, th, te, p, e) * way + motor_viscous(v, p, e)
        needed -= motor_drive(th, v, 0.0 if is_rigid(p) else te, 0.0, th, p, e)
        if e is not None and e[fx.DRIVE_ON] != 0.0:
            needed /= 1.0 + torque_ripple(th, e)
        torque[k] = needed
