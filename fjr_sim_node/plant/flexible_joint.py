"""The flexible-joint plant (paper eqs. 2-5) and its effects, integrated with exact sticking.

    J  q''  + fv  q'  + fs  sgn(q')  + te(q - th) = 0        link
    Jm th'' + fvm th' + fsm sgn(th') - te(q - th) = tau      motor
    te(d) = k0 d + k1 d^3

sgn is set-valued. Between events each side slips one way or sticks, and the motion is smooth: it is
integrated by the classical Runge-Kutta method of order 4. An event (a velocity reaches zero, or the
torque on a stuck side reaches the Coulomb level) is located by root finding on the same
Runge-Kutta step, which then ends there; so the method keeps its order across stick and slip.

Presliding friction and transmission hysteresis build up over the displacement; along one direction
that is an explicit function, so they add no stiff state to integrate, only the reversal of the
deflection as a third kind of event.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.compiled import jit

from .. import effects as fx
from .places import FS, FSM, FV, FVM, JM, K0, K1, LINK_BRISTLES, MOTOR_BRISTLES, J
from .presliding import with_bristles
from .spring import deflection, deflection_speed, spring_region
from .step_size import bends_more, fastest_rate, pushes, reach, reach_within_energy, slackened
from .stick_slip import (
    advance_smoothly,
    facing,
    flex_direction,
    link_direction,
    motor_direction,
    remembered,
)

PLANT = ParameterGroup(
    Parameter("jm", 0.2, "kg m2", "Motor inertia", 1e-9, 1e4, symbol="Jm", source="paper eq. 5"),
    Parameter(
        "j",
        0.3,
        "kg m2",
        "Link inertia; .inf: the link is held",
        1e-9,
        symbol="J",
        source="paper eq. 5",
    ),
    Parameter("fs", 5.0, "N m", "Link Coulomb friction", 0.0, 1e5, symbol="fs", source="eq. 2"),
    Parameter("fsm", 6.0, "N m", "Motor Coulomb friction", 0.0, 1e5, symbol="fsm", source="eq. 2"),
    Parameter(
        "fv", 4.0, "N m s/rad", "Link viscous friction", 0.0, 1e5, symbol="fv", source="eq. 2"
    ),
    Parameter(
        "fvm", 2.0, "N m s/rad", "Motor viscous friction", 0.0, 1e5, symbol="fvm", source="eq. 2"
    ),
    Parameter(
        "k0",
        1500.0,
        "N m/rad",
        "Transmission stiffness; .inf: rigid axis",
        0.0,
        symbol="k0",
        source="eq. 3",
    ),
    Parameter("k1", 3000.0, "N m/rad3", "Cubic stiffness", 0.0, 1e15, symbol="k1", source="eq. 3"),
)
"""Physical parameters of the bare plant with the paper's values."""

_PHASE_PER_STEP = 0.2  # rad of the fastest oscillation in one Runge-Kutta step
_CHEAP_SUBSTEPS = 8  # above, a second bound on the stiffness is worth its cost
_MAX_SUBSTEPS = 10_000


def moves_as_one(values: Mapping[str, Any]) -> bool:
    """Tell whether motor and link are one body: a rigid axis whose transmission does not yield.

    Args:
        values: bare parameters and those of effects by full name; missing effects are off.
    """
    compliance = values.get("transmission_stiffness.compliance_rad_nm", 0.0)
    return math.isinf(values["k0"]) and compliance == 0.0


def rigid_sums(parameters: Mapping[str, Any]) -> dict[str, float] | None:
    """Return inertia and friction of the one body of a rigid axis (k0 infinite), else None.

    They stand under the motor's names jm, fsm and fvm.
    """
    if not math.isinf(parameters["k0"]):
        return None
    sums = (("jm", "j"), ("fsm", "fs"), ("fvm", "fv"))
    return {a: float(parameters[a]) + float(parameters[b]) for a, b in sums}


def with_added(values: Mapping[str, Any]) -> dict[str, float]:
    """Return the bare parameters with what effects of the bare plant add to them.

    Args:
        values: bare parameters and those of effects by full name; missing effects are off.
    """
    own = {name: float(values[name]) for name in PLANT.names}
    for parameter in fx.PARAMETERS:
        if parameter.adds_to:
            own[parameter.adds_to] += values.get(parameter.name, 0.0)
    alone = rigid_sums(own)
    if alone is None or moves_as_one(values):
        return own
    inertia, coulomb, viscous = (
        values[f"transmission_stiffness.link_{of}_share"]
        for of in ("inertia", "coulomb", "viscous")
    )
    return {
        "jm": (1.0 - inertia) * alone["jm"],
        "j": inertia * alone["jm"],
        "fs": coulomb * alone["fsm"],
        "fsm": (1.0 - coulomb) * alone["fsm"],
        "fv": viscous * alone["fvm"],
        "fvm": (1.0 - viscous) * alone["fvm"],
        "k0": 1.0 / values["transmission_stiffness.compliance_rad_nm"],
        "k1": 0.0,
    }


def coefficients(values: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the 8 parameters in the order that `advance` expects, as `with_added` gives them.

    A rigid axis is a motor with all the inertia and friction, and a link of infinite inertia,
    which nothing moves.
    """
    parameters = with_added(values)
    alone = rigid_sums(parameters)
    if alone is not None:
        apart = dict.fromkeys(PLANT.names, 0.0) | {"j": math.inf}
        parameters = apart | alone
    return tuple(float(parameters[parameter.name]) for parameter in PLANT)


@jit
def _advance(s, torque, w, duration, p, e):
    """Return state and build-up after a duration of constant torque."""
    twist, link, motor, bends = 0.0, 0.0, 0.0, bends_more(p, e)
    if bends:
        link, motor = pushes(s, torque, w, p, e)
        twist = reach(s, link, motor, duration, p, e)
    rated = p
    if e is not None and (p[LINK_BRISTLES] != 0.0 or p[MOTOR_BRISTLES] != 0.0):
        rated = slackened(s, torque, w, duration, p, e)
    steps = fastest_rate(twist, s, torque, duration, rated, e) * duration / _PHASE_PER_STEP
    if bends and steps > _CHEAP_SUBSTEPS:
        twist = min(twist, reach_within_energy(s, link, motor, duration, p, e))
        steps = fastest_rate(twist, s, torque, duration, rated, e) * duration / _PHASE_PER_STEP
    if not (steps < _MAX_SUBSTEPS and math.isfinite(torque)):
        nan = math.nan
        return (nan, nan, nan, nan, nan, nan, nan, nan), w
    substeps = int(steps) + 1
    h = duration / substeps
    m = (0.0, 0.0, 1.0, 0.0)
    for _ in range(substeps):
        link, motor = link_direction(s, m, w, p, e), motor_direction(s, torque, m, w, p, e)
        m = (link, motor, m[2], m[3])
        if e is not None and e[fx.TRANSMISSION_ON] != 0.0:
            speed = deflection_speed(s[1], s[2], s[3], e)
            region = spring_region(deflection(s[0], s[2], e), speed, e)
            m = (link, motor, flex_direction(s, torque, m, w, p, e), region)
        w = facing(s, torque, m, w, p, e)
        s, m, w = advance_smoothly(s, torque, m, w, h, p, e)
        w = remembered(s, torque, m, w, p, e)
    return s, w


@jit
def _rate(speed, torque, p):
    s = (0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0, 0.0)
    return fastest_rate(0.0, s, torque, 0.0, p, None)


@jit
def _rate_with_effects(speed, torque, p, e):
    s = (0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0, 0.0)
    return fastest_rate(0.0, s, torque, 0.0, with_bristles(p, 1.0, e), e)


def steps_per_second(
    speed: float, torque: float, p: tuple[float, ...], e: np.ndarray | None
) -> float:
    """Return how many steps a second of motion takes, at a motor speed (rad/s) and a torque (N m).

    Args:
        speed: of the motor (rad/s).
        torque: motor torque (N m).
        p: parameters from `coefficients`.
        e: from `effects.coefficients`, or None.
    """
    rate = _rate(speed, torque, p) if e is None else _rate_with_effects(speed, torque, p, e)
    return rate / _PHASE_PER_STEP


@jit
def advance(q, vq, th, vth, torque, duration, p):
    """Advance the bare plant under constant torque (zero-order hold).

    Args:
        q: link position (rad).
        vq: link velocity (rad/s).
        th: motor position (rad).
        vth: motor velocity (rad/s).
        torque: motor torque (N m).
        duration: time to advance (s).
        p: parameters from `coefficients`.

    Returns:
        (q, vq, th, vth) after the duration; all NaN if the torque is not finite or the motion is
        too fast to follow (more than _MAX_SUBSTEPS steps).
    """
    s = (q, vq, th, vth, 0.0, 0.0, 0.0, 0.0)
    w = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    s = _advance(s, torque, w, duration, p, None)[0]
    return s[0], s[1], s[2], s[3]


@jit
def advance_with_effects(x, torque, duration, p, e, friction=1.0):
    """Advance the plant with effects in place.

    Args:
        x: float64 of shape (>= 11,): q, vq, th, vth, q3, v3, lagged torque, presliding torque of
            link and motor (N m), the state of the hysteresis in [-1, 1], and the angle at which a
            cable pulls nowhere.
        torque: motor torque after the drive (N m).
        duration: time to advance (s).
        p: parameters from `coefficients`.
        e: parameters from `effects.coefficients`.
        friction: by what Coulomb and viscous friction have drifted, a factor.
    """
    if e[fx.FRICTION_ON] == 0.0 and e[fx.TRANSMISSION_ON] == 0.0 and e[fx.DRIVE_ON] == 0.0:
        coulomb, viscous = (
            (friction * p[FS], friction * p[FSM]),
            (friction * p[FV], friction * p[FVM]),
        )
        bare = (p[JM], p[J], *coulomb, *viscous, p[K0], p[K1])
        x[0], x[1], x[2], x[3] = advance(x[0], x[1], x[2], x[3], torque, duration, bare)
        return
    s = (x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[10])
    w = (x[7], x[8], x[9], x[0], x[2], deflection(x[0], x[2], e), 0.0, 0.0)
    s, w = _advance(s, torque, w, duration, with_bristles(p, friction, e), e)
    for i in range(7):
        x[i] = s[i]
    x[10] = s[7]
    for i in range(3):
        x[7 + i] = w[i]
