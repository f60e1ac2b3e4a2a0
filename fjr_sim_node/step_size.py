"""How far and how fast the plant may move within a hold: what its integration step is chosen by.

`s` is the state as in `plant`, `p` and `e` are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_interface.compiled import inlined, jit

from . import effects as fx
from .torques import FS, FV, FVM, JM, K0, K1, J, deflection, deflection_speed, motor_level_bound


@inlined
def pushes(s, torque, p, e):
    """Return the greatest torques that may feed energy to link and motor (N m)."""
    if e is None:
        return 0.0, abs(torque)
    motor = max(abs(torque), abs(s[6])) + abs(e[fx.BIAS]) + e[fx.HYSTERESIS]
    motor += e[fx.COGGING] * (1.0 + e[fx.COGGING_SECOND])
    if e[fx.PRESLIDING_MOTOR] != 0.0:
        motor += motor_level_bound(0.0, p, e)
    link = e[fx.GRAVITY] + e[fx.HYSTERESIS]
    if e[fx.PRESLIDING_LINK] != 0.0:
        link += p[FS] + e[fx.STRIBECK_LINK]
    if e[fx.EXTRA_INERTIA] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_FREQUENCY]
        pull = rate * abs(s[4] - s[0]) + 2.0 * e[fx.EXTRA_DAMPING] * abs(s[5] - s[1])
        link += e[fx.EXTRA_INERTIA] * rate * pull
    return link, motor


@inlined
def reach(s, link, motor, duration, p, e):
    """Return the greatest deflection that free flight under these torques would reach (rad)."""
    speed = abs(deflection_speed(s[1], s[2], s[3], e))
    acceleration = motor / p[JM]
    if e is not None:
        acceleration += link / p[J]
    return abs(deflection(s[0], s[2], e)) + duration * (speed + 0.5 * duration * acceleration)


@jit
def reach_within_energy(s, link, motor, duration, p, e):
    """Return the greatest deflection that the energy E allows (rad).

    Friction only takes energy, and dE/dt <= motor sqrt(2 E / Jm) + link sqrt(2 E / J); the
    deflection follows from te's potential. A soft zone lowers that by a ramp of its own width.
    """
    twist2 = deflection(s[0], s[2], e) ** 2
    kinetic = p[J] * s[1] * s[1] + p[JM] * s[3] * s[3]
    energy = 0.5 * (kinetic + (p[K0] + 0.5 * p[K1] * twist2) * twist2)
    root = motor / math.sqrt(2.0 * p[JM]) + link / math.sqrt(2.0 * p[J])
    slack = 0.0
    if e is not None:
        slack = e[fx.HALF_GAP] + e[fx.SOFT_ZONE]
        rate = 2.0 * math.pi * e[fx.EXTRA_FREQUENCY]
        swing = rate * (s[4] - s[0])
        energy += 0.5 * e[fx.EXTRA_INERTIA] * (s[5] * s[5] + swing * swing)
    root = math.sqrt(energy) + duration * root
    peak = math.sqrt(p[K0] * p[K0] + 4.0 * p[K1] * root * root)
    if p[K1] > 0.0:
        return slack + math.sqrt(max(peak - p[K0], 0.0) / p[K1])
    return slack + root * math.sqrt(2.0 / p[K0]) if p[K0] > 0.0 else math.inf


@inlined
def fastest_rate(twist, s, p, e):
    """Return in rad/s how fast the motion may oscillate or decay up to a deflection.

    The squared frequency is bounded by the sum over all springs of stiffness times mobility.
    """
    stiffness = p[K0] + 3.0 * p[K1] * twist * twist
    decay = p[FV] / p[J] + p[FVM] / p[JM]
    if e is None:
        return math.sqrt(stiffness * (1.0 / p[J] + 1.0 / p[JM])) + decay
    return _fastest_rate(stiffness, twist, decay, s, p, e)


@jit
def _fastest_rate(stiffness, twist, decay, s, p, e):
    te = stiffness * twist
    if e[fx.HYSTERESIS] != 0.0:
        stiffness += e[fx.HYSTERESIS] / e[fx.HYSTERESIS_DISPLACEMENT]
    cycles = e[fx.KINEMATIC_CYCLES]
    slope = e[fx.KINEMATIC] * cycles * (1.0 + 2.0 * e[fx.KINEMATIC_SECOND])
    bend = e[fx.KINEMATIC] * cycles * cycles * (1.0 + 4.0 * e[fx.KINEMATIC_SECOND])
    ratio = 1.0 + slope
    mobility = 1.0 / p[J] + ratio * (ratio + e[fx.LOAD]) / p[JM]
    link = e[fx.GRAVITY]
    motor = e[fx.COGGING] * e[fx.COGGING_CYCLES] * (1.0 + 2.0 * e[fx.COGGING_SECOND]) + te * bend
    friction = e[fx.POSITION_FRICTION] * e[fx.POSITION_FRICTION_CYCLES]
    motor += friction * (1.0 + 2.0 * e[fx.POSITION_FRICTION_SECOND])
    if e[fx.PRESLIDING_LINK] != 0.0:
        link += (p[FS] + e[fx.STRIBECK_LINK]) / e[fx.PRESLIDING_LINK]
    if e[fx.PRESLIDING_MOTOR] != 0.0:
        motor += motor_level_bound(te, p, e) / e[fx.PRESLIDING_MOTOR]
    decay += e[fx.FLEX_DAMPING] * mobility
    decay += e[fx.STRIBECK_LINK] / (e[fx.STRIBECK_LINK_VELOCITY] * p[J])
    decay += e[fx.STRIBECK_MOTOR] / (e[fx.STRIBECK_MOTOR_VELOCITY] * p[JM])
    decay += 2.0 * e[fx.DRAG_LINK] * abs(s[1]) / p[J]
    decay += (2.0 * e[fx.DRAG_MOTOR] * abs(s[3]) + abs(e[fx.ASYMMETRIC_VISCOUS])) / p[JM]
    squared = stiffness * mobility + link / p[J] + motor / p[JM]
    rate = max(math.sqrt(squared) + decay, 0.3 * ripple_rate(s[3], e))
    if e[fx.EXTRA_INERTIA] != 0.0:
        share = 1.0 + e[fx.EXTRA_INERTIA] / p[J]
        factor = max(math.sqrt(share), 2.0 * e[fx.EXTRA_DAMPING] * share)
        rate = max(rate, 2.0 * math.pi * e[fx.EXTRA_FREQUENCY] * factor)
    if e[fx.LAG] != 0.0:
        rate = max(rate, 0.2 / e[fx.LAG])
    return rate


@inlined
def _finest(cycles, second):
    return 2.0 * cycles if second != 0.0 else cycles


@inlined
def ripple_rate(vth, e):
    """Return how fast the motor passes the finest of the angle-periodic ripples (rad/s)."""
    cycles = 0.0
    if e[fx.KINEMATIC] != 0.0:
        cycles = _finest(e[fx.KINEMATIC_CYCLES], e[fx.KINEMATIC_SECOND])
    if e[fx.COGGING] != 0.0:
        cycles = max(cycles, _finest(e[fx.COGGING_CYCLES], e[fx.COGGING_SECOND]))
    if e[fx.POSITION_FRICTION] != 0.0:
        second = e[fx.POSITION_FRICTION_SECOND]
        cycles = max(cycles, _finest(e[fx.POSITION_FRICTION_CYCLES], second))
    return cycles * abs(vth)
