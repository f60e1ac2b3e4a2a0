"""Smooth motion of the plant between events: torques on each side, one Runge-Kutta step.

In this module, in `stick_slip` and in `plant`
    s = (q, vq, th, vth, q3, v3, lagged torque, angle at which a cable pulls nowhere), the last four
        at rest without effects;
    m = (link, motor, flex, region): slip directions, 0 while a side sticks, direction in which the
        deflection changes, smooth part of the spring that it is in;
    w = what has built up where the present motion began, and where that was: presliding torque of
        link and motor (N m), state of the hysteresis, q, th, deflection, Coulomb level of link and
        motor in its direction (N m); unused without effects;
    p and e are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined, jit

from .. import effects as fx
from .places import FS, FSM, JM, LINK_BRISTLES, MOTOR_BRISTLES, J, is_rigid
from .presliding import bristle_damping, bristle_torque
from .spring import build_up, deflection, transmitted_torque
from .torques import (
    gear_load,
    link_drive,
    link_level,
    link_viscous,
    motor_drive,
    motor_level,
    motor_viscous,
)


@inlined
def flex_state(s, m, w, e):
    """Return the present state of the hysteresis in [-1, 1]."""
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
        return 0.0
    if e[fx.HYSTERESIS_TORQUE_NM] == 0.0:
        return 0.0
    return build_up(w[2], m[2], deflection(s[0], s[2], e) - w[5], e[fx.HYSTERESIS_DISPLACEMENT_RAD])


@inlined
def transmitted(s, m, w, p, e):
    """Return the torque of the transmission on the motor (N m)."""
    return transmitted_torque(s[0], s[1], s[2], s[3], flex_state(s, m, w, e), p, e)


@inlined
def link_friction(s, m, w, p, e):
    """Return Coulomb friction of the link (N m): its level, or what has built up of it."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FS] * m[0]
    level = link_level(abs(s[1]), p, e)
    if p[LINK_BRISTLES] == 0.0:
        return level * m[0]
    return bristle_torque(w[0], w[6], level, m[0], s[0] - w[3], p[LINK_BRISTLES])


@inlined
def motor_built_up(s, level, m, w, p):
    """Return the torque of the motor's bristles (N m) at a Coulomb level."""
    return bristle_torque(w[1], w[7], level, m[1], s[2] - w[4], p[MOTOR_BRISTLES])


@inlined
def load_of(s, te, torque, direction, p, e):
    """Return the `gear_load` (N m) under a torque that the drive is asked for (N m)."""
    if e is None:
        return te
    if e[fx.ACTUATOR_LAG_TIME_CONSTANT_S] != 0.0:
        torque = s[6]
    return gear_load(s[2], s[3], te, torque, s[7], direction, p, e)


@inlined
def motor_friction(s, te, torque, m, w, p, e):
    """Return Coulomb friction of the motor (N m), with the damping of its bristles."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FSM] * m[1]
    level = motor_level(abs(s[3]), m[1], s[2], load_of(s, te, torque, m[1], p, e), p, e)
    if p[MOTOR_BRISTLES] == 0.0:
        return level * m[1]
    built = motor_built_up(s, level, m, w, p)
    return built + bristle_damping(built, level, m[1], s[3], e)


@inlined
def link_torque(s, te, p, e):
    """Return the torque that drives the link against its Coulomb friction."""
    if e is None:
        return link_drive(s[0], s[1], te, 0.0, 0.0, 0.0, p, e)
    return link_drive(s[0], s[1], te, s[4], s[5], s[7], p, e)


@inlined
def motor_torque(s, te, torque, p, e):
    """Return the torque that drives the motor against its Coulomb friction."""
    if e is None:
        return motor_drive(s[2], s[3], te, torque, 0.0, p, e)
    if e[fx.ACTUATOR_LAG_TIME_CONSTANT_S] != 0.0:
        torque = s[6]
    return motor_drive(s[2], s[3], te, torque, s[7], p, e)


@inlined
def derivative(s, torque, m, w, p, e):
    """Return the time derivative of s for given slip directions."""
    te = transmitted(s, m, w, p, e)
    aq = 0.0
    ath = 0.0
    if m[0] != 0.0:
        friction = link_viscous(s[1], p, e) + link_friction(s, m, w, p, e)
        aq = (link_torque(s, te, p, e) - friction) / p[J]
    if m[1] != 0.0:
        friction = motor_viscous(s[3], p, e) + motor_friction(s, te, torque, m, w, p, e)
        ath = (motor_torque(s, te, torque, p, e) - friction) / p[JM]
    if e is None:
        return s[1], aq, s[3], ath, 0.0, 0.0, 0.0, 0.0
    if e[fx.TRANSMISSION_ON] == 0.0 and e[fx.DRIVE_ON] == 0.0:
        return s[1], aq, s[3], ath, 0.0, 0.0, 0.0, 0.0
    a3 = 0.0
    if e[fx.EXTRA_MODE_INERTIA_KG_M2] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ]
        a3 = rate * rate * (s[0] - s[4]) + 2.0 * e[fx.EXTRA_MODE_DAMPING_RATIO] * rate * (
            s[1] - s[5]
        )
    lag = 0.0
    if e[fx.ACTUATOR_LAG_TIME_CONSTANT_S] != 0.0:
        lag = (torque - s[6]) / e[fx.ACTUATOR_LAG_TIME_CONSTANT_S]
    slack = 0.0
    if e[fx.CABLE_STIFFNESS_NM_RAD] != 0.0:
        slack = ((s[2] if is_rigid(p) else s[0]) - s[7]) / e[fx.CABLE_RELAXATION_S]
    return s[1], aq, s[3], ath, s[5], a3, lag, slack


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
        s[7] + h * d[7],
    )


_STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@jit
def runge_kutta(s, torque, m, w, h, p, e):
    """Return the state after h seconds of smooth motion in given slip directions.

    The stages are a loop, since four copies of the derivative are slower to compile and to run.
    """
    point, total, pair = s, _STILL, _STILL
    for stage in range(4):
        d = derivative(point, torque, m, w, p, e)
        if stage == 0:
            total = d
        elif stage == 3:
            total = moved(moved(total, 2.0, pair, e), 1.0, d, e)
        else:
            pair = moved(pair, 1.0, d, e)
        point = moved(s, h if stage == 2 else 0.5 * h, d, e)
    return moved(s, h / 6.0, total, e)
