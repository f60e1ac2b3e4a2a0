"""Smooth motion of the plant between events: torques on each side, one Runge-Kutta step.

In this module, in `stick_slip` and in `plant`
    s = (q, vq, th, vth, q3, v3, lagged torque), the last three at rest without effects;
    m = (link, motor, flex, region): slip directions, 0 while a side sticks, direction in which the
        deflection changes, smooth part of the spring that it is in;
    w = state of build-up of link, motor and flex at the last reversal, and where that was:
        (w_link, w_motor, w_flex, q, th, deflection); unused without effects;
    p and e are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_interface.compiled import inlined, jit

from . import effects as fx
from .torques import (
    JM,
    J,
    build_up,
    deflection,
    link_drive,
    link_level,
    link_viscous,
    motor_drive,
    motor_level,
    motor_viscous,
    transmitted_torque,
)


@inlined
def flex_state(s, m, w, e):
    """Return the present state of the hysteresis in [-1, 1]."""
    if e is None:
        return 0.0
    if e[fx.HYSTERESIS] == 0.0:
        return 0.0
    return build_up(w[2], m[2], deflection(s[0], s[2], e) - w[5], e[fx.HYSTERESIS_DISPLACEMENT])


@inlined
def transmitted(s, m, w, p, e):
    """Return the torque of the transmission on the motor (N m)."""
    return transmitted_torque(s[0], s[1], s[2], s[3], flex_state(s, m, w, e), p, e)


@inlined
def link_state(s, m, w, e):
    """Return link friction over its level: the slip direction, or what has built up."""
    if e is None:
        return m[0]
    return build_up(w[0], m[0], s[0] - w[3], e[fx.PRESLIDING_LINK])


@inlined
def motor_state(s, m, w, e):
    """Return motor friction over its level."""
    if e is None:
        return m[1]
    return build_up(w[1], m[1], s[2] - w[4], e[fx.PRESLIDING_MOTOR])


@inlined
def link_torque(s, te, p, e):
    """Return the torque that drives the link against its Coulomb friction."""
    if e is None:
        return link_drive(s[0], s[1], te, 0.0, 0.0, p, e)
    return link_drive(s[0], s[1], te, s[4], s[5], p, e)


@inlined
def motor_torque(s, te, torque, e):
    """Return the torque that drives the motor against its Coulomb friction."""
    if e is None:
        return motor_drive(s[2], te, torque, e)
    if e[fx.LAG] != 0.0:
        torque = s[6]
    return motor_drive(s[2], te, torque, e)


@inlined
def derivative(s, torque, m, w, p, e):
    """Return the time derivative of s for given slip directions."""
    te = transmitted(s, m, w, p, e)
    aq = 0.0
    ath = 0.0
    if m[0] != 0.0:
        friction = link_viscous(s[1], p, e) + link_level(abs(s[1]), p, e) * link_state(s, m, w, e)
        aq = (link_torque(s, te, p, e) - friction) / p[J]
    if m[1] != 0.0:
        level = motor_level(abs(s[3]), m[1], s[2], te, p, e)
        friction = motor_viscous(s[3], p, e) + level * motor_state(s, m, w, e)
        ath = (motor_torque(s, te, torque, e) - friction) / p[JM]
    if e is None:
        return s[1], aq, s[3], ath, 0.0, 0.0, 0.0
    a3 = 0.0
    if e[fx.EXTRA_INERTIA] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_FREQUENCY]
        a3 = rate * rate * (s[0] - s[4]) + 2.0 * e[fx.EXTRA_DAMPING] * rate * (s[1] - s[5])
    lag = 0.0
    if e[fx.LAG] != 0.0:
        lag = (torque - s[6]) / e[fx.LAG]
    return s[1], aq, s[3], ath, s[5], a3, lag


@inlined
def moved(s, h, d, e):
    """Return s + h d."""
    if e is None:
        return (
            s[0] + h * d[0],
            s[1] + h * d[1],
            s[2] + h * d[2],
            s[3] + h * d[3],
            0.0,
            0.0,
            0.0,
        )
    return (
        s[0] + h * d[0],
        s[1] + h * d[1],
        s[2] + h * d[2],
        s[3] + h * d[3],
        s[4] + h * d[4],
        s[5] + h * d[5],
        s[6] + h * d[6],
    )


@jit
def runge_kutta(s, torque, m, w, h, p, e):
    """Return the state after h seconds of smooth motion in given slip directions."""
    d1 = derivative(s, torque, m, w, p, e)
    d2 = derivative(moved(s, 0.5 * h, d1, e), torque, m, w, p, e)
    d3 = derivative(moved(s, 0.5 * h, d2, e), torque, m, w, p, e)
    d4 = derivative(moved(s, h, d3, e), torque, m, w, p, e)
    # sum the stages as (d1 + 2 (d2 + d3)) + d4, component by component
    slope = moved(moved(d1, 2.0, moved(d2, 1.0, d3, e), e), 1.0, d4, e)
    return moved(s, h / 6.0, slope, e)
