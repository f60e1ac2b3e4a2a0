"""Bounds on the plant's motion within a hold, by which its integration step is chosen.

`s` and `w` are as in `motion`, `p` and `e` are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined, jit

from .. import effects as fx
from .motion import link_torque, load_of, motor_torque
from .places import FS, FV, FVM, JM, K0, K1, LINK_BRISTLES, MOTOR_BRISTLES, J, is_rigid
from .spring import deflection, deflection_speed, transmitted_torque
from .torques import (
    cable_pull,
    hardening_pull,
    link_level,
    link_viscous,
    load_coefficient,
    motor_level,
    motor_level_bound,
    motor_viscous,
)

_SURELY_ON = 3.0  # times the change of speed that a hold can make


@inlined
def pushes(s, torque, w, p, e):
    """Return the greatest torques that may feed energy to link and motor (N m)."""
    if e is None:
        return 0.0, abs(torque)
    ripples = 1.0 + e[fx.TORQUE_CONSTANT_RIPPLE_SECOND_RATIO]
    motor = max(abs(torque), abs(s[6])) * (1.0 + e[fx.TORQUE_CONSTANT_RIPPLE_AMPLITUDE] * ripples)
    motor += abs(e[fx.TORQUE_BIAS_TORQUE_NM]) + e[fx.HYSTERESIS_TORQUE_NM]
    motor += e[fx.COGGING_AMPLITUDE_NM] * (1.0 + e[fx.COGGING_SECOND_RATIO])
    if p[MOTOR_BRISTLES] != 0.0:
        motor += max(abs(w[1]), motor_level_bound(0.0, p, e))
    link = e[fx.HYSTERESIS_TORQUE_NM]
    stiffness, rest = e[fx.EXTERNAL_SPRING_STIFFNESS_NM_RAD], e[fx.EXTERNAL_SPRING_REST_RAD]
    if is_rigid(p):
        motor += e[fx.GRAVITY_TORQUE_NM] + stiffness * abs(s[2] - rest)
        motor += abs(cable_pull(s[2], s[7], e)) + abs(hardening_pull(s[2], e))
    else:
        link += e[fx.GRAVITY_TORQUE_NM] + stiffness * abs(s[0] - rest)
        link += abs(cable_pull(s[0], s[7], e)) + abs(hardening_pull(s[0], e))
    if p[LINK_BRISTLES] != 0.0:
        link += max(abs(w[0]), p[FS] + e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM])
    if e[fx.EXTRA_MODE_INERTIA_KG_M2] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ]
        pull = rate * abs(s[4] - s[0]) + 2.0 * e[fx.EXTRA_MODE_DAMPING_RATIO] * abs(s[5] - s[1])
        link += e[fx.EXTRA_MODE_INERTIA_KG_M2] * rate * pull
    return link, motor


@inlined
def bends_more(p, e):
    """Tell whether the transmission's stiffness, or its lever, changes with the deflection."""
    if p[K1] != 0.0:
        return True
    return e is not None and e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] != 0.0


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
    stiff, soft = p[K0], p[K0]
    if e is not None:
        uneven = abs(e[fx.ASYMMETRIC_STIFFNESS_RELATIVE])
        stiff, soft = p[K0] * (1.0 + uneven), p[K0] * (1.0 - uneven)
    energy = 0.5 * (kinetic + (stiff + 0.5 * p[K1] * twist2) * twist2)
    root = motor / math.sqrt(2.0 * p[JM]) + link / math.sqrt(2.0 * p[J])
    slack = 0.0
    if e is not None:
        slack = e[fx.BACKLASH_HALF_GAP_RAD] + e[fx.PIECEWISE_STIFFNESS_ZONE_RAD]
        rate = 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ]
        swing = rate * (s[4] - s[0])
        energy += 0.5 * e[fx.EXTRA_MODE_INERTIA_KG_M2] * (s[5] * s[5] + swing * swing)
    root = math.sqrt(energy) + duration * root
    peak = math.sqrt(soft * soft + 4.0 * p[K1] * root * root)
    if p[K1] > 0.0:
        return slack + math.sqrt(max(peak - soft, 0.0) / p[K1])
    return slack + root * math.sqrt(2.0 / soft) if soft > 0.0 else math.inf


@inlined
def _still_bent(state, level, speed, acceleration, duration):
    """Return which share of their stiffness bristles show in a hold that cannot turn the motion.

    Once they hold as much as they can they only slip: dF/dx = sigma (1 - F / level), F along the
    motion.

    Args:
        state: torque of the bristles (N m).
        level: Coulomb level in the direction of motion (N m).
        speed: with its sign (rad/s).
        acceleration: greatest one against the motion (rad/s2).
        duration: of the hold (s).
    """
    if level <= 0.0 or abs(speed) < _SURELY_ON * acceleration * duration:
        return 1.0
    along = state if speed > 0.0 else -state
    return min(2.0 * abs(1.0 - along / level), 1.0)


@jit
def slackened(s, torque, w, duration, p, e):
    """Return the parameters with no more stiffness of bristles than the motion of a hold can show.

    Args:
        s: state.
        torque: motor torque (N m).
        w: what has built up where the hold begins.
        duration: of the hold (s).
        p: parameters with the bristles' stiffnesses.
        e: parameters of the effects.
    """
    link, motor = p[LINK_BRISTLES], p[MOTOR_BRISTLES]
    te = transmitted_torque(s[0], s[1], s[2], s[3], w[2], p, e)
    if link != 0.0:
        level = link_level(abs(s[1]), p, e)
        drive = abs(link_torque(s, te, p, e)) + level + abs(link_viscous(s[1], p, e))
        link *= _still_bent(w[0], level, s[1], drive / p[J], duration)
    if motor != 0.0:
        direction = 1.0 if s[3] > 0.0 else -1.0
        load = load_of(s, te, torque, direction, p, e)
        level = motor_level(abs(s[3]), direction, s[2], load, p, e)
        drive = abs(motor_torque(s, te, torque, p, e)) + level + abs(motor_viscous(s[3], p, e))
        motor *= _still_bent(w[1], level, s[3], drive / p[JM], duration)
    return p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], link, motor


@inlined
def fastest_rate(twist, s, torque, duration, p, e):
    """Return in rad/s how fast the motion may oscillate or decay in a hold, up to a deflection.

    The squared frequency is bounded by the sum over all springs of stiffness times mobility. A
    spring whose cubic part outweighs the linear one is counted up to twice, since its stiffness
    itself goes from nearly nothing to the greatest within a quarter of a swing.
    """
    hardened = 3.0 * p[K1] * twist * twist
    stiffness = p[K0] + hardened
    if hardened > p[K0]:
        stiffness += hardened - p[K0]
    link_mobility, motor_mobility = 1.0 / p[J], 1.0 / p[JM]
    decay = p[FV] * link_mobility + p[FVM] * motor_mobility
    if e is None:
        return math.sqrt(stiffness * (link_mobility + motor_mobility)) + decay
    mobilities = link_mobility, motor_mobility
    return _fastest_rate(stiffness, twist, decay, mobilities, s, torque, duration, p, e)


@jit
def _fastest_rate(stiffness, twist, decay, mobilities, s, torque, duration, p, e):
    link_mobility, motor_mobility = mobilities
    link, motor = p[LINK_BRISTLES], p[MOTOR_BRISTLES]
    mobility = link_mobility + motor_mobility
    if e[fx.TRANSMISSION_ON] != 0.0:
        stiffness += p[K0] * abs(e[fx.ASYMMETRIC_STIFFNESS_RELATIVE])
        ratio, bend = _kinematic_bounds(e)
        motor += stiffness * twist * bend
        if e[fx.HYSTERESIS_TORQUE_NM] != 0.0:
            stiffness += e[fx.HYSTERESIS_TORQUE_NM] / e[fx.HYSTERESIS_DISPLACEMENT_RAD]
        mobility = link_mobility + ratio * (ratio + load_coefficient(e)) * motor_mobility
        decay += e[fx.TRANSMISSION_DAMPING_NM_S_RAD] * mobility
        outside = e[fx.GRAVITY_TORQUE_NM] + e[fx.EXTERNAL_SPRING_STIFFNESS_NM_RAD]
        outside += e[fx.CABLE_STIFFNESS_NM_RAD] + _hardened(s, torque, duration, p, e)
        if is_rigid(p):
            motor += outside
        else:
            link += outside
    elif e[fx.FRICTION_ON] != 0.0:
        mobility += load_coefficient(e) * motor_mobility
    if e[fx.FRICTION_ON] != 0.0:
        friction = e[fx.POSITION_FRICTION_AMPLITUDE_NM] * e[fx.POSITION_FRICTION_CYCLES_PER_TURN]
        motor += friction * (1.0 + 2.0 * e[fx.POSITION_FRICTION_SECOND_RATIO])
        decay += _decay_by_friction(s, link_mobility, motor_mobility, p, e)
    if e[fx.DRIVE_ON] != 0.0:
        cogging = e[fx.COGGING_AMPLITUDE_NM] * e[fx.COGGING_CYCLES_PER_TURN]
        motor += cogging * (1.0 + 2.0 * e[fx.COGGING_SECOND_RATIO])
        decay += _decay_at_limit(s, torque, e) * motor_mobility
    rate = math.sqrt(stiffness * mobility + link * link_mobility + motor * motor_mobility) + decay
    rate = max(rate, 0.3 * ripple_rate(s[3], e))
    if e[fx.EXTRA_MODE_INERTIA_KG_M2] != 0.0:
        share = 1.0 + e[fx.EXTRA_MODE_INERTIA_KG_M2] / p[J]
        factor = max(math.sqrt(share), 2.0 * e[fx.EXTRA_MODE_DAMPING_RATIO] * share)
        rate = max(rate, 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ] * factor)
    if e[fx.CABLE_STIFFNESS_NM_RAD] != 0.0:
        rate = max(rate, 0.2 / e[fx.CABLE_RELAXATION_S])
    if e[fx.ACTUATOR_LAG_TIME_CONSTANT_S] != 0.0:
        rate = max(rate, 0.2 / e[fx.ACTUATOR_LAG_TIME_CONSTANT_S])
    return rate


@inlined
def _hardened(s, torque, duration, p, e):
    """Return the greatest stiffness (N m/rad) of a hardening spring where a hold may carry it."""
    cubic = e[fx.HARDENING_SPRING_CUBIC_NM_RAD3]
    if cubic == 0.0:
        return e[fx.HARDENING_SPRING_STIFFNESS_NM_RAD]
    if is_rigid(p):
        angle, speed, mass, drive = s[2], s[3], p[JM], abs(torque)
    else:
        angle, speed, mass = s[0], s[1], p[J]
        drive = abs(transmitted_torque(s[0], s[1], s[2], s[3], 0.0, p, e))
    far = abs(angle - e[fx.HARDENING_SPRING_REST_RAD])
    drive += abs(hardening_pull(angle, e))
    far += duration * (abs(speed) + 0.5 * duration * drive / mass)
    return e[fx.HARDENING_SPRING_STIFFNESS_NM_RAD] + 3.0 * cubic * far * far


@inlined
def _kinematic_bounds(e):
    """Return the greatest lever of a kinematic error, and its greatest slope by the angle."""
    cycles, second = e[fx.KINEMATIC_ERROR_CYCLES_PER_TURN], e[fx.KINEMATIC_ERROR_SECOND_RATIO]
    slope = e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] * cycles
    return 1.0 + slope * (1.0 + 2.0 * second), slope * cycles * (1.0 + 4.0 * second)


@inlined
def _decay_by_friction(s, link_mobility, motor_mobility, p, e):
    """Return how fast friction that falls or grows with speed may damp or drive a side (1/s)."""
    link = 2.0 * e[fx.QUADRATIC_FRICTION_LINK_NM_S2_RAD2] * abs(s[1])
    link += e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM] / e[fx.STRIBECK_FRICTION_LINK_VELOCITY_RAD_S]
    motor = 2.0 * e[fx.QUADRATIC_FRICTION_MOTOR_NM_S2_RAD2] * abs(s[3])
    motor += abs(e[fx.ASYMMETRIC_FRICTION_VISCOUS_NM_S_RAD])
    motor += e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] / e[fx.STRIBECK_FRICTION_MOTOR_VELOCITY_RAD_S]
    motor += e[fx.LUGRE_FRICTION_STRIBECK_NM] / e[fx.LUGRE_FRICTION_VELOCITY_RAD_S]
    if e[fx.LUGRE_FRICTION_BRISTLE_NM_RAD] != math.inf:
        # sigma1 exp(-u^2) (1 - F / L) v: |1 - F / L| <= 2, and L falls as fast as sigma1 does
        share = p[MOTOR_BRISTLES] / e[fx.LUGRE_FRICTION_BRISTLE_NM_RAD]  # see `slackened`
        motor += 3.0 * share * e[fx.LUGRE_FRICTION_DAMPING_NM_S_RAD]
    return link * link_mobility + motor * motor_mobility


@inlined
def _decay_at_limit(s, torque, e):
    """Return by how much the torque falls per speed where the drive's limit may be reached."""
    stall, no_load = e[fx.TORQUE_SPEED_LIMIT_STALL_NM], e[fx.TORQUE_SPEED_LIMIT_NO_LOAD_RAD_S]
    asked = max(abs(torque), abs(s[6]))
    if stall == math.inf or asked < stall * (1.0 - 2.0 * abs(s[3]) / no_load):
        return 0.0
    return stall / no_load


@inlined
def _finest(cycles, second):
    return 2.0 * cycles if second != 0.0 else cycles


@inlined
def ripple_rate(vth, e):
    """Return how fast the motor passes the finest of the angle-periodic ripples (rad/s)."""
    cycles = 0.0
    if e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] != 0.0:
        cycles = _finest(e[fx.KINEMATIC_ERROR_CYCLES_PER_TURN], e[fx.KINEMATIC_ERROR_SECOND_RATIO])
    if e[fx.COGGING_AMPLITUDE_NM] != 0.0:
        cycles = max(cycles, _finest(e[fx.COGGING_CYCLES_PER_TURN], e[fx.COGGING_SECOND_RATIO]))
    if e[fx.POSITION_FRICTION_AMPLITUDE_NM] != 0.0:
        second = e[fx.POSITION_FRICTION_SECOND_RATIO]
        cycles = max(cycles, _finest(e[fx.POSITION_FRICTION_CYCLES_PER_TURN], second))
    if e[fx.TORQUE_CONSTANT_RIPPLE_AMPLITUDE] != 0.0:
        second = e[fx.TORQUE_CONSTANT_RIPPLE_SECOND_RATIO]
        cycles = max(cycles, _finest(e[fx.TORQUE_CONSTANT_RIPPLE_CYCLES_PER_TURN], second))
    return cycles * abs(vth)
