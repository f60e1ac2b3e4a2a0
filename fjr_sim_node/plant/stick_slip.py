"""Stick and slip: which way each side goes, when that ends, and the motion through such events.

An event is a velocity that reaches zero, a torque on a stuck side that reaches the Coulomb level, a
deflection that turns round or enters another part of the spring. It is located by root finding on
the Runge-Kutta step in which it falls, and that step ends there. Symbols as in `motion`.

What only an event or a side at rest calls for is compiled apart, so that what every step does stays
short.
"""

from __future__ import annotations

from fjr_kit.compiled import inlined, jit

from .. import effects as fx
from .motion import (
    derivative,
    flex_state,
    link_friction,
    link_torque,
    load_of,
    motor_built_up,
    motor_friction,
    motor_torque,
    runge_kutta,
    transmitted,
)
from .places import LINK_BRISTLES, MOTOR_BRISTLES, is_rigid
from .spring import (
    deflection,
    deflection_speed,
    has_kinks,
    lever_slope,
    next_region,
    region_margin,
    region_slope,
)
from .torques import link_level, motor_has_coulomb, motor_level

_MAX_EVENTS = 32
_FROM_ZERO = 1e-9  # a margin that starts below this share of its fall starts from zero


@inlined
def _creep_direction(excess, direction):
    """Return where a side with presliding friction goes from rest under an excess of torque.

    In balance neither direction is right; if one has just proved wrong it is the other.
    """
    if excess == 0.0:
        return -direction if direction != 0.0 else 1.0
    return 1.0 if excess > 0.0 else -1.0


@jit
def _link_direction_from_rest(s, m, w, p, e):
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
def link_direction(s, m, w, p, e):
    """Return the link's slip direction, 0 if it sticks; a side without friction always slips."""
    if is_rigid(p):
        return 0.0
    if s[1] > 0.0:
        return 1.0
    if s[1] < 0.0:
        return -1.0
    return _link_direction_from_rest(s, m, w, p, e)


@jit
def _motor_direction_from_rest(s, torque, m, w, p, e):
    te = transmitted(s, m, w, p, e)
    drive = motor_torque(s, te, torque, p, e)
    if e is not None and p[MOTOR_BRISTLES] != 0.0:
        return _creep_direction(drive - motor_friction(s, te, torque, m, w, p, e), m[1])
    if not motor_has_coulomb(p, e):
        return 1.0
    direction = 1.0 if drive > 0.0 else -1.0
    level = motor_level(0.0, direction, s[2], load_of(s, te, torque, direction, p, e), p, e)
    return direction if abs(drive) > level else 0.0


@inlined
def motor_direction(s, torque, m, w, p, e):
    """Return the motor's slip direction, 0 if it sticks."""
    if s[3] > 0.0:
        return 1.0
    if s[3] < 0.0:
        return -1.0
    return _motor_direction_from_rest(s, torque, m, w, p, e)


@inlined
def _deflection_acceleration(s, d, e):
    return deflection_speed(d[1], s[2], d[3], e) - lever_slope(s[2], e) * s[3] * s[3]


@jit
def _bending(s, torque, m, w, p, e):
    """Return how fast the speed of the deflection changes (rad/s2)."""
    return _deflection_acceleration(s, derivative(s, torque, m, w, p, e), e)


@inlined
def flex_direction(s, torque, m, w, p, e):
    """Return the direction in which the deflection changes."""
    speed = deflection_speed(s[1], s[2], s[3], e)
    if speed == 0.0:
        speed = _bending(s, torque, m, w, p, e)
    return 1.0 if speed >= 0.0 else -1.0


@inlined
def _link_margin(s, m, w, p, e):
    """Return what must stay positive: speed along the slip, or torque left before breakaway.

    A side without Coulomb friction has no events, its margin is constant.
    """
    if is_rigid(p):
        return 1.0
    if e is not None and p[LINK_BRISTLES] != 0.0:
        return s[1] * m[0]
    level = link_level(0.0, p, e)
    if level == 0.0:
        return 1.0
    if m[0] == 0.0:
        return level - abs(link_torque(s, transmitted(s, m, w, p, e), p, e))
    return s[1] * m[0]


@inlined
def _motor_margin(s, torque, m, w, p, e):
    if e is not None and p[MOTOR_BRISTLES] != 0.0:
        return s[3] * m[1]
    if not motor_has_coulomb(p, e):
        return 1.0
    if m[1] != 0.0:
        return s[3] * m[1]
    te = transmitted(s, m, w, p, e)
    drive = motor_torque(s, te, torque, p, e)
    direction = 1.0 if drive > 0.0 else -1.0
    level = motor_level(0.0, direction, s[2], load_of(s, te, torque, direction, p, e), p, e)
    return level - abs(drive)


@inlined
def _margin(which, s, torque, m, w, p, e):
    """Return the margin of link (0), motor (1), the deflection's direction (2) or region (3)."""
    if which == 0:
        return _link_margin(s, m, w, p, e)
    if which == 1:
        return _motor_margin(s, torque, m, w, p, e)
    if e is None:
        return 1.0
    if which == 2:
        if e[fx.HYSTERESIS_TORQUE_NM] == 0.0:
            return 1.0
        return deflection_speed(s[1], s[2], s[3], e) * m[2]
    if not has_kinks(e):
        return 1.0
    return region_margin(deflection(s[0], s[2], e), m[3], e)


@inlined
def _margin_slope(which, s, torque, m, w, p, e):
    """Return the time derivative of a margin; 0 for that of a stuck side."""
    d = derivative(s, torque, m, w, p, e)
    if which == 0:
        return d[1] * m[0]
    if which == 1 or e is None:
        return d[3] * m[1]
    if which == 2:
        return _deflection_acceleration(s, d, e) * m[2]
    speed = deflection_speed(s[1], s[2], s[3], e)
    return region_slope(deflection(s[0], s[2], e), speed, m[3], e)


@jit
def _event_time(which, s, torque, m, w, h, high_value, p, e):
    """Return the time in (0, h) at which a margin reaches zero; `high_value` < 0 is that at h.

    Illinois method on margin(t); where it starts from zero (a motion from rest, or just after an
    event), on margin(t)/t, which has no root at the start.
    """
    low_value = _margin(which, s, torque, m, w, p, e)
    from_zero = low_value <= _FROM_ZERO * -high_value
    if from_zero:
        low_value = _margin_slope(which, s, torque, m, w, p, e)
        if low_value <= 0.0:
            return 0.0
        high_value /= h
    low, high = 0.0, h
    time = h
    side = -1
    for _ in range(60):
        before = time
        time = (low * high_value - high * low_value) / (high_value - low_value)
        if time == 0.0 or abs(time - before) <= 1e-11 * h:  # 0 by underflow
            break
        s1 = runge_kutta(s, torque, m, w, time, p, e)
        value = _margin(which, s1, torque, m, w, p, e)
        if from_zero:
            value /= time
        if value < 0.0:
            high, high_value = time, value
            if side == -1:
                low_value *= 0.5
            side = -1
        else:
            low, low_value = time, value
            if side == 1:
                high_value *= 0.5
            side = 1
        if high - low <= 1e-10 * h or value == 0.0:
            break
    return time


@inlined
def _stopped(s, link, motor):
    """Return s with the velocities of the sides that stop set to zero."""
    vq = 0.0 if link else s[1]
    vth = 0.0 if motor else s[3]
    return s[0], vq, s[2], vth, s[4], s[5], s[6], s[7]


@inlined
def remembered(s, torque, m, w, p, e):
    """Return w with what has built up until now, counted from here on; `facing` completes it."""
    if e is None or (e[fx.FRICTION_ON] == 0.0 and e[fx.TRANSMISSION_ON] == 0.0):
        return w
    link, motor = 0.0, 0.0
    if p[LINK_BRISTLES] != 0.0:
        link = link_friction(s, m, w, p, e)
    if p[MOTOR_BRISTLES] != 0.0:
        load = load_of(s, transmitted(s, m, w, p, e), torque, m[1], p, e)
        level = motor_level(abs(s[3]), m[1], s[2], load, p, e)
        motor = motor_built_up(s, level, m, w, p)
    built_up = link, motor, flex_state(s, m, w, e)
    return (*built_up, s[0], s[2], deflection(s[0], s[2], e), w[6], w[7])


@inlined
def facing(s, torque, m, w, p, e):
    """Return w with the levels of presliding friction in the directions that now begin."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return w
    link, motor = 0.0, 0.0
    if p[LINK_BRISTLES] != 0.0:
        link = link_level(abs(s[1]), p, e)
    if p[MOTOR_BRISTLES] != 0.0:
        load = load_of(s, transmitted(s, m, w, p, e), torque, m[1], p, e)
        motor = motor_level(abs(s[3]), m[1], s[2], load, p, e)
    return w[0], w[1], w[2], w[3], w[4], w[5], link, motor


@inlined
def _breaks_away(which, s, torque, m, w, p, e):
    """Return the direction in which a stuck side starts to slip."""
    te = transmitted(s, m, w, p, e)
    drive = link_torque(s, te, p, e) if which == 0 else motor_torque(s, te, torque, p, e)
    return 1.0 if drive > 0.0 else -1.0


@jit
def _after_event(which, s, torque, m, w, p, e):
    """Return state, directions and memory just after an event."""
    w = remembered(s, torque, m, w, p, e)
    link, motor, flex, region = m
    if which == 0:
        if link == 0.0:
            link = _breaks_away(0, s, torque, m, w, p, e)
        else:
            s = _stopped(s, True, False)
            link = link_direction(s, m, w, p, e)
    elif which == 1:
        if motor == 0.0:
            motor = _breaks_away(1, s, torque, m, w, p, e)
        else:
            s = _stopped(s, False, True)
            motor = motor_direction(s, torque, m, w, p, e)
    elif which == 2:
        flex = -flex
    elif e is not None:
        region = next_region(deflection(s[0], s[2], e), region, e)
    m = (link, motor, flex, region)
    return s, m, facing(s, torque, m, w, p, e)


@jit
def _without_reversal(s, torque, m, w, p, e):
    """Return the state with the sides stopped that have reversed."""
    link_reversed = _margin(0, s, torque, m, w, p, e) < 0.0
    motor_reversed = _margin(1, s, torque, m, w, p, e) < 0.0
    return _stopped(s, link_reversed, motor_reversed)


@jit
def advance_smoothly(s, torque, m, w, h, p, e):
    """Return state, directions and memory after h seconds, through any number of events."""
    for _ in range(_MAX_EVENTS):
        if h <= 0.0:
            return s, m, w
        if e is None and m[0] == 0.0 and m[1] == 0.0:
            return s, m, w
        s1 = runge_kutta(s, torque, m, w, h, p, e)
        first, time = -1, h
        for which in range(2 if e is None or e[fx.TRANSMISSION_ON] == 0.0 else 4):
            value = _margin(which, s1, torque, m, w, p, e)
            if value < 0.0:
                event_time = _event_time(which, s, torque, m, w, h, value, p, e)
                if first < 0 or event_time < time:
                    first, time = which, event_time
        if first < 0:
            return s1, m, w
        s = runge_kutta(s, torque, m, w, time, p, e)
        h -= time
        s, m, w = _after_event(first, s, torque, m, w, p, e)
    # Only a torque that grazes the Coulomb level comes here: stop a side that would reverse.
    s = runge_kutta(s, torque, m, w, h, p, e)
    return _without_reversal(s, torque, m, w, p, e), m, w
