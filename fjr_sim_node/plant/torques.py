"""Torques of the flexible-joint plant and of every effect of the catalogue, compiled.

Throughout, `p` are the bare plant's parameters and `e` those of the effects (`effects.NAMES`), or
None: then the compiler drops every effect, and the paper's plant (eqs. 2-5) is left.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined

from .. import effects as fx

JM, J, FS, FSM, FV, FVM, K0, K1, LINK_BRISTLES, MOTOR_BRISTLES = range(10)
"""Where the parameters stand; the stiffnesses of `presliding` are there only with effects."""


@inlined
def ripple(angle, ratio, phase):
    """Return sin(angle) with a second harmonic of some ratio and phase."""
    value = math.sin(angle)
    if ratio != 0.0:
        value += ratio * math.sin(2.0 * angle + phase)
    return value


@inlined
def ripple_slope(angle, ratio, phase):
    """Return the derivative of `ripple` by the angle."""
    value = math.cos(angle)
    if ratio != 0.0:
        value += 2.0 * ratio * math.cos(2.0 * angle + phase)
    return value


@inlined
def deflection(q, th, e):
    """Return the deflection of the transmission q - th (rad), with kinematic error if on."""
    if e is None:
        return q - th
    d = q - th
    if e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] != 0.0:
        angle = e[fx.KINEMATIC_ERROR_CYCLES_PER_TURN] * th + e[fx.KINEMATIC_ERROR_PHASE_RAD]
        d += e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] * ripple(
            angle, e[fx.KINEMATIC_ERROR_SECOND_RATIO], e[fx.KINEMATIC_ERROR_SECOND_PHASE_RAD]
        )
    return d


@inlined
def spring_torque(d, p, e):
    """Return te(d) in N m (paper eq. 3), with dead zone or soft zone if on.

    Both reduce the deflection that the spring sees; its law, cubic part included, stays.
    """
    if e is None:
        return d * (p[K0] + p[K1] * d * d)
    gap, zone = e[fx.BACKLASH_HALF_GAP_RAD], e[fx.PIECEWISE_STIFFNESS_ZONE_RAD]
    if gap != 0.0:
        if d > gap:
            d -= gap
        elif d < -gap:
            d += gap
        else:
            d = 0.0
    if zone != 0.0:
        soft = e[fx.PIECEWISE_STIFFNESS_SOFT_RATIO]
        if d > zone:
            d -= zone * (1.0 - soft)
        elif d < -zone:
            d += zone * (1.0 - soft)
        else:
            d *= soft
    return d * (p[K0] + p[K1] * d * d)


@inlined
def _kinks(e):
    """Return the deflections at which the spring's slope jumps, inner and outer (rad)."""
    if e[fx.BACKLASH_HALF_GAP_RAD] == 0.0:
        return e[fx.PIECEWISE_STIFFNESS_ZONE_RAD], math.inf
    if e[fx.PIECEWISE_STIFFNESS_ZONE_RAD] == 0.0:
        return e[fx.BACKLASH_HALF_GAP_RAD], math.inf
    return e[fx.BACKLASH_HALF_GAP_RAD], e[fx.BACKLASH_HALF_GAP_RAD] + e[
        fx.PIECEWISE_STIFFNESS_ZONE_RAD
    ]


@inlined
def spring_region(d, speed, e):
    """Return in which smooth part of the spring a deflection is: 0 inside, +-1, +-2 outside.

    On a kink the speed decides.
    """
    inner, outer = _kinks(e)
    side = 1.0 if d > 0.0 else -1.0
    outward = side * speed > 0.0
    if abs(d) > outer or (abs(d) == outer and outward):
        return 2.0 * side
    if abs(d) > inner or (abs(d) == inner and outward):
        return side
    return 0.0


@inlined
def region_margin(d, region, e):
    """Return how far a deflection is inside a region of the spring (rad), negative outside."""
    inner, outer = _kinks(e)
    if region == 0.0:
        return inner - abs(d)
    if abs(region) == 1.0:
        return min(d * region - inner, outer - d * region)
    return 0.5 * d * region - outer


@inlined
def region_slope(d, speed, region, e):
    """Return the time derivative of `region_margin` (rad/s)."""
    inner, outer = _kinks(e)
    side = 1.0 if d > 0.0 else -1.0
    if region == 0.0 or (abs(region) == 1.0 and d * region - inner >= outer - d * region):
        return -side * speed
    return side * speed


@inlined
def next_region(d, region, e):
    """Return the region beyond the kink that a deflection in a region is at."""
    inner, outer = _kinks(e)
    if region == 0.0:
        return 1.0 if d > 0.0 else -1.0
    if abs(region) == 2.0:
        return 0.5 * region
    return 0.0 if d * region - inner < outer - d * region else 2.0 * region


@inlined
def lever(th, e):
    """Return the torque on the motor per transmitted torque, 1 without kinematic error.

    By virtual work it is minus the derivative of the deflection by th.
    """
    if e is None:
        return 1.0
    if e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] == 0.0:
        return 1.0
    cycles = e[fx.KINEMATIC_ERROR_CYCLES_PER_TURN]
    slope = ripple_slope(
        cycles * th + e[fx.KINEMATIC_ERROR_PHASE_RAD],
        e[fx.KINEMATIC_ERROR_SECOND_RATIO],
        e[fx.KINEMATIC_ERROR_SECOND_PHASE_RAD],
    )
    return 1.0 - e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] * cycles * slope


@inlined
def lever_slope(th, e):
    """Return the derivative of the lever by the motor angle (1/rad)."""
    if e is None:
        return 0.0
    cycles = e[fx.KINEMATIC_ERROR_CYCLES_PER_TURN]
    angle = cycles * th + e[fx.KINEMATIC_ERROR_PHASE_RAD]
    bend = math.sin(angle)
    if e[fx.KINEMATIC_ERROR_SECOND_RATIO] != 0.0:
        second = math.sin(2.0 * angle + e[fx.KINEMATIC_ERROR_SECOND_PHASE_RAD])
        bend += 4.0 * e[fx.KINEMATIC_ERROR_SECOND_RATIO] * second
    return e[fx.KINEMATIC_ERROR_AMPLITUDE_RAD] * cycles * cycles * bend


@inlined
def deflection_speed(vq, th, vth, e):
    """Return the time derivative of the deflection (rad/s)."""
    if e is None:
        return vq - vth
    return vq - lever(th, e) * vth


@inlined
def transmitted_torque(q, vq, th, vth, flex_level, p, e):
    """Return the torque in the transmission (N m): spring, damping and hysteresis.

    `flex_level` in [-1, 1] is the state of the hysteresis.
    """
    te = spring_torque(deflection(q, th, e), p, e)
    if e is not None:
        if e[fx.TRANSMISSION_DAMPING_NM_S_RAD] != 0.0:
            te += e[fx.TRANSMISSION_DAMPING_NM_S_RAD] * deflection_speed(vq, th, vth, e)
        te += e[fx.HYSTERESIS_TORQUE_NM] * flex_level
    return te


@inlined
def link_level(speed, p, e):
    """Return the Coulomb level of the link (N m) at a slip speed >= 0, 0 being breakaway."""
    if e is None:
        return p[FS]
    level = p[FS]
    if e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM] != 0.0:
        ratio = speed / e[fx.STRIBECK_FRICTION_LINK_VELOCITY_RAD_S]
        level += e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM] * math.exp(-ratio * ratio)
    return level


@inlined
def motor_level(speed, direction, th, te, p, e):
    """Return the Coulomb level of the motor (N m) in a slip direction; never below zero."""
    if e is None:
        return p[FSM]
    level = p[FSM]
    if e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] != 0.0:
        ratio = speed / e[fx.STRIBECK_FRICTION_MOTOR_VELOCITY_RAD_S]
        level += e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] * math.exp(-ratio * ratio)
    if e[fx.POSITION_FRICTION_AMPLITUDE_NM] != 0.0:
        angle = e[fx.POSITION_FRICTION_CYCLES_PER_TURN] * th + e[fx.POSITION_FRICTION_PHASE_RAD]
        second = e[fx.POSITION_FRICTION_SECOND_RATIO]
        level += e[fx.POSITION_FRICTION_AMPLITUDE_NM] * ripple(
            angle, second, e[fx.POSITION_FRICTION_SECOND_PHASE_RAD]
        )
    level += e[fx.ASYMMETRIC_FRICTION_COULOMB_NM] * direction
    level += e[fx.LOAD_FRICTION_COEFFICIENT] * abs(te)
    return max(level, 0.0)


@inlined
def motor_level_bound(te, p, e):
    """Return the highest Coulomb level of the motor at a transmitted torque (N m)."""
    ripples = e[fx.POSITION_FRICTION_AMPLITUDE_NM] * (1.0 + e[fx.POSITION_FRICTION_SECOND_RATIO])
    level = p[FSM] + e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] + ripples
    return level + abs(e[fx.ASYMMETRIC_FRICTION_COULOMB_NM]) + e[fx.LOAD_FRICTION_COEFFICIENT] * te


@inlined
def motor_has_coulomb(p, e):
    """Tell whether the motor can have a Coulomb level at any angle, load or direction."""
    if e is None:
        return p[FSM] != 0.0
    return (
        p[FSM] != 0.0
        or e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] != 0.0
        or e[fx.POSITION_FRICTION_AMPLITUDE_NM] != 0.0
        or e[fx.ASYMMETRIC_FRICTION_COULOMB_NM] != 0.0
        or e[fx.LOAD_FRICTION_COEFFICIENT] != 0.0
    )


@inlined
def link_drive(q, vq, te, q3, v3, p, e):
    """Return the torque that drives the link against its friction (N m)."""
    if e is None:
        return -te
    drive = -te
    if e[fx.GRAVITY_TORQUE_NM] != 0.0:
        drive -= e[fx.GRAVITY_TORQUE_NM] * math.sin(q + e[fx.GRAVITY_ANGLE_RAD])
    if e[fx.EXTRA_MODE_INERTIA_KG_M2] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ]
        damping = 2.0 * e[fx.EXTRA_MODE_DAMPING_RATIO] * rate
        drive += e[fx.EXTRA_MODE_INERTIA_KG_M2] * (rate * rate * (q3 - q) + damping * (v3 - vq))
    return drive


@inlined
def motor_drive(th, te, torque, e):
    """Return the torque that drives the motor against its friction (N m)."""
    if e is None:
        return torque + te
    drive = torque + te * lever(th, e)
    drive += e[fx.TORQUE_BIAS_TORQUE_NM]
    if e[fx.COGGING_AMPLITUDE_NM] != 0.0:
        angle = e[fx.COGGING_CYCLES_PER_TURN] * th + e[fx.COGGING_PHASE_RAD]
        drive += e[fx.COGGING_AMPLITUDE_NM] * ripple(
            angle, e[fx.COGGING_SECOND_RATIO], e[fx.COGGING_SECOND_PHASE_RAD]
        )
    return drive


@inlined
def link_viscous(v, p, e):
    """Return velocity-dependent friction of the link beyond Coulomb's (N m)."""
    if e is None:
        return p[FV] * v
    return p[FV] * v + e[fx.QUADRATIC_FRICTION_LINK_NM_S2_RAD2] * abs(v) * v


@inlined
def motor_viscous(v, p, e):
    """Return velocity-dependent friction of the motor beyond Coulomb's (N m)."""
    if e is None:
        return p[FVM] * v
    return p[FVM] * v + (
        e[fx.QUADRATIC_FRICTION_MOTOR_NM_S2_RAD2] * v + e[fx.ASYMMETRIC_FRICTION_VISCOUS_NM_S_RAD]
    ) * abs(v)


@inlined
def build_up(level, direction, moved, distance):
    """Return the state in [-1, 1] of a hysteresis that builds up over a distance.

    Dahl's model dw/dx = (direction - w)/distance along a motion of one direction, solved exactly.

    Args:
        level: state at the start of the motion.
        direction: direction of the motion, +-1.
        moved: displacement since then, of that direction (rad).
        distance: displacement over which it builds up.
    """
    if moved == 0.0:
        return level
    return direction + (level - direction) * math.exp(-abs(moved) / distance)
