"""The spring between motor and link and its effects, compiled: deflection, torque, lever, losses.

`p` and `e` are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined

from .. import effects as fx
from .places import K0, K1


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
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
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
    """Return te(d) in N m (paper eq. 3), with dead zone, soft zone or two stiffnesses if on.

    Zones reduce the deflection that the spring sees; its law, cubic part included, stays.
    """
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
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
    stiffness = p[K0]
    if e[fx.ASYMMETRIC_STIFFNESS_RELATIVE] != 0.0:
        more = e[fx.ASYMMETRIC_STIFFNESS_RELATIVE]
        stiffness *= 1.0 + more if d > 0.0 else 1.0 - more
    return d * (stiffness + p[K1] * d * d)


@inlined
def has_kinks(e):
    """Tell whether the spring's slope jumps anywhere."""
    return e[fx.TRANSMISSION_ON] != 0.0 and (
        e[fx.BACKLASH_HALF_GAP_RAD] != 0.0
        or e[fx.PIECEWISE_STIFFNESS_ZONE_RAD] != 0.0
        or e[fx.ASYMMETRIC_STIFFNESS_RELATIVE] != 0.0
    )


@inlined
def _kinks(e):
    """Return the deflections at which the spring's slope jumps, inner and outer (rad).

    Two stiffnesses meet at zero, unless a gap lies there, in which neither acts.
    """
    gap, zone = e[fx.BACKLASH_HALF_GAP_RAD], e[fx.PIECEWISE_STIFFNESS_ZONE_RAD]
    if gap == 0.0 and e[fx.ASYMMETRIC_STIFFNESS_RELATIVE] == 0.0:
        return zone, math.inf
    if zone == 0.0:
        return gap, math.inf
    return gap, gap + zone


@inlined
def spring_region(d, speed, e):
    """Return in which smooth part of the spring a deflection is: 0 inside, +-1, +-2 outside.

    On a kink the speed decides. Where the inner kinks are one, at zero, nothing is inside.
    """
    inner, outer = _kinks(e)
    positive = d > 0.0 or (d == 0.0 and speed >= 0.0)
    side = 1.0 if positive else -1.0
    outward = side * speed > 0.0
    if abs(d) > outer or (abs(d) == outer and outward):
        return 2.0 * side
    if abs(d) > inner or (abs(d) == inner and outward) or inner == 0.0:
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
    side = 1.0 if region > 0.0 or (region == 0.0 and d > 0.0) else -1.0
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
    if d * region - inner >= outer - d * region:
        return 2.0 * region
    return 0.0 if inner > 0.0 else -region


@inlined
def lever(th, e):
    """Return the torque on the motor per transmitted torque, 1 without kinematic error.

    By virtual work it is minus the derivative of the deflection by th.
    """
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
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
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
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
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
        return vq - vth
    return vq - lever(th, e) * vth


@inlined
def transmitted_torque(q, vq, th, vth, flex_level, p, e):
    """Return the torque in the transmission (N m): spring, damping and hysteresis.

    `flex_level` in [-1, 1] is the state of the hysteresis.
    """
    te = spring_torque(deflection(q, th, e), p, e)
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
        return te
    if e[fx.TRANSMISSION_DAMPING_NM_S_RAD] != 0.0:
        te += e[fx.TRANSMISSION_DAMPING_NM_S_RAD] * deflection_speed(vq, th, vth, e)
    return te + e[fx.HYSTERESIS_TORQUE_NM] * flex_level


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
