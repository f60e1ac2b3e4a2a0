"""Torques on motor and link of the flexible-joint plant, with every effect, compiled.

Throughout, `p` are the bare plant's parameters and `e` those of the effects (`effects.NAMES`), or
None: then the compiler drops every effect, and the paper's plant (eqs. 2-5) is left.
"""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined, jit

from .. import effects as fx
from .places import FS, FSM, FV, FVM, is_rigid
from .spring import lever, ripple


@inlined
def link_level(speed, p, e):
    """Return the Coulomb level of the link (N m) at a slip speed >= 0, 0 being breakaway."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FS]
    level = p[FS]
    if e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM] != 0.0:
        ratio = speed / e[fx.STRIBECK_FRICTION_LINK_VELOCITY_RAD_S]
        level += e[fx.STRIBECK_FRICTION_LINK_TORQUE_NM] * math.exp(-ratio * ratio)
    return level


@inlined
def motor_level(speed, direction, th, load, p, e):
    """Return the Coulomb level of the motor (N m) in a slip direction; never below zero.

    It may grow with the load of the gear (N m), see `gear_load`.
    """
    if e is None or e[fx.FRICTION_ON] == 0.0:
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
    if e[fx.LUGRE_FRICTION_STRIBECK_NM] != 0.0:
        ratio = speed / e[fx.LUGRE_FRICTION_VELOCITY_RAD_S]
        level += e[fx.LUGRE_FRICTION_STRIBECK_NM] * math.exp(-ratio * ratio)
    level += e[fx.LOAD_FRICTION_COEFFICIENT] * abs(load)
    if load * direction < 0.0:
        level += e[fx.DIRECTIONAL_LOSS_FORWARD] * abs(load)
    else:
        level += e[fx.DIRECTIONAL_LOSS_BACKWARD] * abs(load)
    return max(level, 0.0)


@inlined
def motor_level_bound(te, p, e):
    """Return the highest Coulomb level of the motor at a transmitted torque (N m)."""
    ripples = e[fx.POSITION_FRICTION_AMPLITUDE_NM] * (1.0 + e[fx.POSITION_FRICTION_SECOND_RATIO])
    level = p[FSM] + e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] + ripples
    level += abs(e[fx.ASYMMETRIC_FRICTION_COULOMB_NM]) + e[fx.LUGRE_FRICTION_STRIBECK_NM]
    return level + load_coefficient(e) * te


@inlined
def load_coefficient(e):
    """Return the greatest Coulomb level of the motor per transmitted torque."""
    directional = max(e[fx.DIRECTIONAL_LOSS_FORWARD], e[fx.DIRECTIONAL_LOSS_BACKWARD])
    return e[fx.LOAD_FRICTION_COEFFICIENT] + directional


@inlined
def motor_has_coulomb(p, e):
    """Tell whether the motor can have a Coulomb level at any angle, load or direction."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FSM] != 0.0
    return (
        p[FSM] != 0.0
        or e[fx.STRIBECK_FRICTION_MOTOR_TORQUE_NM] != 0.0
        or e[fx.POSITION_FRICTION_AMPLITUDE_NM] != 0.0
        or e[fx.ASYMMETRIC_FRICTION_COULOMB_NM] != 0.0
        or e[fx.LUGRE_FRICTION_STRIBECK_NM] != 0.0
        or load_coefficient(e) != 0.0
    )


@inlined
def cable_pull(angle, slack, e):
    """Return the torque (N m) of a cable on its body at an angle; it pulls nowhere at `slack`."""
    return e[fx.CABLE_STIFFNESS_NM_RAD] * (slack - angle)


@inlined
def hardening_pull(angle, e):
    """Return the torque (N m) of a spring that hardens on its body at an angle."""
    stretched = angle - e[fx.HARDENING_SPRING_REST_RAD]
    cubic = e[fx.HARDENING_SPRING_CUBIC_NM_RAD3] * stretched * stretched
    return -(e[fx.HARDENING_SPRING_STIFFNESS_NM_RAD] + cubic) * stretched


@inlined
def outside(angle, slack, e):
    """Return the torque (N m) of gravity, springs and a cable on the body that they act on."""
    torque = 0.0
    if e[fx.GRAVITY_TORQUE_NM] != 0.0:
        torque -= e[fx.GRAVITY_TORQUE_NM] * math.sin(angle + e[fx.GRAVITY_ANGLE_RAD])
    if e[fx.EXTERNAL_SPRING_STIFFNESS_NM_RAD] != 0.0:
        torque -= e[fx.EXTERNAL_SPRING_STIFFNESS_NM_RAD] * (angle - e[fx.EXTERNAL_SPRING_REST_RAD])
    if e[fx.CABLE_STIFFNESS_NM_RAD] != 0.0:
        torque += cable_pull(angle, slack, e)
    return torque + hardening_pull(angle, e)


@inlined
def link_drive(q, vq, te, q3, v3, slack, p, e):
    """Return the torque that drives the link against its friction (N m)."""
    if e is None or e[fx.TRANSMISSION_ON] == 0.0:
        return -te
    drive = outside(q, slack, e) - te
    if e[fx.EXTRA_MODE_INERTIA_KG_M2] != 0.0:
        rate = 2.0 * math.pi * e[fx.EXTRA_MODE_FREQUENCY_HZ]
        damping = 2.0 * e[fx.EXTRA_MODE_DAMPING_RATIO] * rate
        drive += e[fx.EXTRA_MODE_INERTIA_KG_M2] * (rate * rate * (q3 - q) + damping * (v3 - vq))
    return drive


@inlined
def available(torque, vth, e):
    """Return what a drive of limited voltage gives of a torque (N m) at a motor speed.

    In the direction of motion the limit falls linearly with the speed, to zero at no load.
    """
    if e[fx.TORQUE_SPEED_LIMIT_STALL_NM] == math.inf:
        return torque
    speed = vth if torque > 0.0 else -vth
    share = 1.0 - max(speed, 0.0) / e[fx.TORQUE_SPEED_LIMIT_NO_LOAD_RAD_S]
    limit = e[fx.TORQUE_SPEED_LIMIT_STALL_NM] * max(share, 0.0)
    return min(max(torque, -limit), limit)


@inlined
def torque_ripple(th, e):
    """Return the relative ripple of the torque constant at a motor angle."""
    angle = e[fx.TORQUE_CONSTANT_RIPPLE_CYCLES_PER_TURN] * th
    angle += e[fx.TORQUE_CONSTANT_RIPPLE_PHASE_RAD]
    second = e[fx.TORQUE_CONSTANT_RIPPLE_SECOND_RATIO]
    phase = e[fx.TORQUE_CONSTANT_RIPPLE_SECOND_PHASE_RAD]
    return e[fx.TORQUE_CONSTANT_RIPPLE_AMPLITUDE] * ripple(angle, second, phase)


@inlined
def driven(th, vth, torque, e):
    """Return what the drive makes of a torque at a motor angle and speed (N m), with cogging."""
    drive = available(torque, vth, e)
    if e[fx.TORQUE_CONSTANT_RIPPLE_AMPLITUDE] != 0.0:
        drive *= 1.0 + torque_ripple(th, e)
    drive += e[fx.TORQUE_BIAS_TORQUE_NM]
    if e[fx.COGGING_AMPLITUDE_NM] != 0.0:
        angle = e[fx.COGGING_CYCLES_PER_TURN] * th + e[fx.COGGING_PHASE_RAD]
        drive += e[fx.COGGING_AMPLITUDE_NM] * ripple(
            angle, e[fx.COGGING_SECOND_RATIO], e[fx.COGGING_SECOND_PHASE_RAD]
        )
    return drive


@inlined
def motor_drive(th, vth, te, torque, slack, p, e):
    """Return the torque that drives the motor against its friction (N m)."""
    if e is None:
        return torque + te
    drive = torque
    if e[fx.DRIVE_ON] != 0.0:
        drive = driven(th, vth, torque, e)
    if e[fx.TRANSMISSION_ON] == 0.0:
        return drive + te
    drive += te * lever(th, e)
    if is_rigid(p):
        drive += outside(th, slack, e)
    return drive


@inlined
def link_viscous(v, p, e):
    """Return velocity-dependent friction of the link beyond Coulomb's (N m)."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FV] * v
    return p[FV] * v + e[fx.QUADRATIC_FRICTION_LINK_NM_S2_RAD2] * abs(v) * v


@inlined
def motor_viscous(v, p, e):
    """Return velocity-dependent friction of the motor beyond Coulomb's (N m)."""
    if e is None or e[fx.FRICTION_ON] == 0.0:
        return p[FVM] * v
    return p[FVM] * v + (
        e[fx.QUADRATIC_FRICTION_MOTOR_NM_S2_RAD2] * v + e[fx.ASYMMETRIC_FRICTION_VISCOUS_NM_S_RAD]
    ) * abs(v)


@jit
def gear_load(th, vth, te, torque, slack, direction, p, e):
    """Return the torque (N m) of the gear on the motor, with which the losses in it grow.

    A rigid axis has rotor and load on the two sides of its gear, so that what the gear carries lies
    between what the motor has left beside its friction and what the load needs at rest. Half way is
    taken, as if the inertias of both were equal; at slow motion both are the same.
    """
    if e is None or not is_rigid(p):
        return te
    if load_coefficient(e) == 0.0:
        return 0.0
    friction = motor_viscous(vth, p, e) + direction * motor_level(
        abs(vth), direction, th, 0.0, p, e
    )
    carried = 0.5 * (torque - friction)
    if e[fx.TRANSMISSION_ON] != 0.0:
        carried -= 0.5 * outside(th, slack, e)
    forward = carried * direction > 0.0
    lost = e[fx.LOAD_FRICTION_COEFFICIENT]
    if forward:
        lost += e[fx.DIRECTIONAL_LOSS_FORWARD]
        return -carried / (1.0 + 0.5 * lost)
    lost += e[fx.DIRECTIONAL_LOSS_BACKWARD]
    return -carried / (1.0 - 0.5 * lost)
