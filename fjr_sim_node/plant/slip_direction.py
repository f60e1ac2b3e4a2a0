"""Which way each side of the joint goes from where it is, or whether it sticks.

Symbols are those of `motion`.
"""

from __future__ import annotations

from fjr_kit.compiled import inlined

from .deflection import deflection_speed, lever_slope
from .motion import (
    derivative,
    link_friction,
    link_torque,
    motor_friction,
    motor_torque,
    transmitted,
)
from .torques import LINK_BRISTLES, MOTOR_BRISTLES, link_level, motor_has_coulomb, motor_level


@inlined
def _creep_direction(excess, direction):
    """Return where a side with presliding friction goes from rest under an excess of torque.

    In balance neither direction is right; if one has just proved wrong it is the other.
    """
    if excess == 0.0:
        return -direction if direction != 0.0 else 1.0
    return 1.0 if excess > 0.0 else -1.0


@inlined
def link_direction(s, m, w, p, e):
    """Return the link's slip direction, 0 if it sticks; a side without friction always slips."""
    if s[1] > 0.0:
        return 1.0
    if s[1] < 0.0:
        return -1.0
    te = transmitted(s, m, w, p, e)
    drive = link_torque(s, te, p, e)
    if e is not None and p[LINK_BRISTLES] != 0.0:
        return _creep_direction(drive - link_friction(s, m, w, p, e), m[0])
    level = link_level(0.0, p, e)
    if level == 0.0 or drive > level:
        return 1.0
    if drive < -level:
        return -1.0
    return 0.0


@inlined
def motor_direction(s, torque, m, w, p, e):
    """Return the motor's slip direction, 0 if it sticks."""
    if s[3] > 0.0:
        return 1.0
    if s[3] < 0.0:
        return -1.0
    te = transmitted(s, m, w, p, e)
    drive = motor_torque(s, te, torque, e)
    if e is not None and p[MOTOR_BRISTLES] != 0.0:
        return _creep_direction(drive - motor_friction(s, te, m, w, p, e), m[1])
    if not motor_has_coulomb(p, e):
        return 1.0
    direction = 1.0 if drive > 0.0 else -1.0
    level = motor_level(0.0, direction, s[2], te, p, e)
    return direction if abs(drive) > level else 0.0


@inlined
def deflection_acceleration(s, d, e):
    """Return the second derivative of the deflection (rad/s2); d is the derivative of s."""
    return deflection_speed(d[1], s[2], d[3], e) - lever_slope(s[2], e) * s[3] * s[3]


@inlined
def flex_direction(s, torque, m, w, p, e):
    """Return the direction in which the deflection changes."""
    speed = deflection_speed(s[1], s[2], s[3], e)
    if speed == 0.0:
        speed = deflection_acceleration(s, derivative(s, torque, m, w, p, e), e)
    return 1.0 if speed >= 0.0 else -1.0
