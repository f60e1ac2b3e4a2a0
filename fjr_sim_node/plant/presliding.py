"""Presliding friction: bristles that store energy and slip, never giving more than they took.

Dahl's law with the torque F as the state, and the Coulomb level L of the moment:

    dF = sigma (dx - |dx| F / L)

The bristles hold F^2 / (2 sigma), and F dx less what they gain is |dx| F^2 / L >= 0. So the law
takes energy whatever L does along the way, for sigma never changes: L may depend on velocity,
direction, angle and load. LuGre adds the damping of bristles; here they damp only while they bend
further, for it could push else where L has just fallen. `p` and `e` are parameters as in `torques`.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined

from .. import effects as fx
from .places import FS, FSM, FV, FVM, JM, K0, K1, J
from .torques import motor_level_bound


@inlined
def with_bristles(p, factor, e):
    """Return the bare parameters, friction times a factor, then the bristles' stiffnesses.

    Stiffness (N m/rad) is the highest level without load and drift over the displacement, or that
    of the LuGre law. It is 0, which is Coulomb friction at once, without presliding and where all
    friction is that of load.
    """
    link, motor = 0.0, 0.0
    if e[fx.PRESLIDING_FRICTION_LINK_RAD] != 0.0:
        link = (p[FS] + e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM]) / e[fx.PRESLIDING_FRICTION_LINK_RAD]
    if e[fx.PRESLIDING_FRICTION_MOTOR_RAD] != 0.0:
        motor = motor_level_bound(0.0, p, e) / e[fx.PRESLIDING_FRICTION_MOTOR_RAD]
    if e[fx.LUGRE_FRICTION_BRISTLE_NM_RAD] != math.inf:
        motor = e[fx.LUGRE_FRICTION_BRISTLE_NM_RAD]
    return (
        p[JM],
        p[J],
        factor * p[FS],
        factor * p[FSM],
        factor * p[FV],
        factor * p[FVM],
        p[K0],
        p[K1],
        link,
        motor,
    )


@inlined
def has_motor_bristles(e):
    """Tell whether friction of the motor builds up."""
    lugre = e[fx.LUGRE_FRICTION_BRISTLE_NM_RAD] != math.inf
    return lugre or e[fx.PRESLIDING_FRICTION_MOTOR_RAD] != 0.0


@inlined
def bristle_damping(built, level, direction, speed, e):
    """Return the damping of the motor's bristles (N m): sigma1(v) dz/dt, never against the slip.

    sigma1 fades with the Stribeck velocity, as passivity asks, and dz/dt is that of bristles which
    hold no more than the Coulomb level (Olsson 1996, thesis, Lund, ch. 5).

    Args:
        built: torque of the bristles (N m).
        level: Coulomb level (N m).
        direction: direction of the motion, +-1.
        speed: velocity (rad/s).
        e: effects.
    """
    if e[fx.LUGRE_FRICTION_DAMPING_NM_S_RAD] == 0.0 or direction * built >= level:
        return 0.0
    ratio = speed / e[fx.LUGRE_FRICTION_VELOCITY_RAD_S]
    damping = e[fx.LUGRE_FRICTION_DAMPING_NM_S_RAD] * math.exp(-ratio * ratio)
    held = direction * built / level if direction * built > -level else -1.0
    return damping * (1.0 - held) * speed


@inlined
def bristle_torque(before, level_before, level, direction, moved, stiffness):
    """Return F after a motion of one direction (N m).

    It solves the law exactly for a level that is linear along the path, but for a mean level in
    the rate; for a constant level exactly.

    Args:
        before: F at the start of the motion (N m).
        level_before: level at the start, for this direction (N m).
        level: level now (N m).
        direction: direction of the motion, +-1.
        moved: displacement since then, of that direction (rad).
        stiffness: sigma (N m/rad).
    """
    if moved == 0.0:
        return before
    between = 0.5 * (level_before + level)
    if between == 0.0:
        return 0.0
    phase = stiffness * abs(moved) / between
    if phase == 0.0:
        return before
    if level == level_before:
        return direction * level + (before - direction * level) * math.exp(-phase)
    faded = -math.expm1(-phase)
    start = before - direction * level_before
    return before + direction * (level - level_before) * (1.0 - faded / phase) - start * faded
