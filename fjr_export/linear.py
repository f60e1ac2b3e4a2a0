"""The joint as a linear model with held input, and as a script of python-control.

What is not linear is replaced by the gain that fits its torque best over a motion, in the least
squares sense (the optimal quasi-linear gain of Booton 1954): friction by viscous friction, the
spring by its stiffness. It holds for motions of that size only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from fjr_kit.errors import InputError
from fjr_sim_node import effects, plant
from fjr_sim_node.plant.spring import spring_torque
from fjr_sim_node.simulation.closed_loop import Trajectory

from .joint import Joint

_NEED_MOTION = (
    *("stribeck_friction_motor", "stribeck_friction_link", "quadratic_friction", "backlash"),
    *("piecewise_stiffness", "asymmetric_stiffness"),
)
_WHOLE = 1e-9


@dataclass(frozen=True)
class LinearJoint:
    """A linear joint: torque (N m) to motor and link position (rad).

    Attributes:
        a, b, c: continuous model without delay, (n, n), (n, 1), (2, n).
        discrete: matrices (A, B, C) under held input, delay included.
        equivalents: gains that stand for what is not linear, by name, with their unit.
    """

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    discrete: tuple[np.ndarray, np.ndarray, np.ndarray]
    equivalents: dict[str, float]


def needs_motion(joint: Joint) -> list[str]:
    """Return what of a joint can only be made linear about a motion."""
    body = joint.body
    found = ["Coulomb friction"] if body["fs"] or body["fsm"] else []
    found += ["k1"] if not joint.one_body and body["k1"] else []
    return found + [name for name in _NEED_MOTION if joint.has(name)]


def linear_joint(joint: Joint, motions: Sequence[Trajectory]) -> LinearJoint:
    """Return the linear model of a joint.

    Args:
        joint: the joint.
        motions: simulated ones about which to make it linear; none where nothing needs it.

    Raises:
        InputError: something needs a motion, and there is none, or the joint does not move in it.
    """
    needing = needs_motion(joint)
    if needing and not motions:
        raise InputError(
            f"{joint.source}: {', '.join(needing)} can only be made linear about a motion; give "
            "--replay with the bags whose motion counts."
        )
    gains = _gains(joint, motions) if needing else {}
    a, b, c = _continuous(joint, gains)
    delay = joint.of("delay")["time_s"]
    return LinearJoint(a, b, c, _held(a, b, c, 1.0 / joint.sample_rate_hz, delay), gains)


def _gains(joint: Joint, motions: Sequence[Trajectory]) -> dict[str, float]:
    rate = joint.sample_rate_hz
    motor = np.concatenate([np.gradient(m.motor) * rate for m in motions])
    link = np.concatenate([np.gradient(m.link) * rate for m in motions])
    twist = np.concatenate([m.link - m.motor for m in motions])
    body = joint.body
    drag = joint.of("quadratic_friction")
    gains = {
        "motor_nm_s_rad": _gain(
            motor, _level(joint, "motor", motor, body["fsm"]) * np.sign(motor)
            + drag["motor_nm_s2_rad2"] * np.abs(motor) * motor,
        )
    }  # fmt: skip
    if not joint.one_body:
        gains["link_nm_s_rad"] = _gain(
            link, _level(joint, "link", link, body["fs"]) * np.sign(link)
            + drag["link_nm_s2_rad2"] * np.abs(link) * link,
        )  # fmt: skip
        gains["stiffness_nm_rad"] = _gain(twist, _spring(joint, twist))
    if not all(map(math.isfinite, gains.values())):
        raise InputError(
            f"{joint.source}: the joint does not move in the replayed bags, so that it cannot be "
            "made linear about them; give --replay with bags in which it moves."
        )
    return gains


def _spring(joint: Joint, twist: np.ndarray) -> np.ndarray:
    p, e = plant.coefficients(joint.exported), effects.coefficients(joint.exported)
    return np.array([spring_torque(deflection, p, e) for deflection in twist.tolist()])


def _level(joint: Joint, side: str, speed: np.ndarray, coulomb: float) -> np.ndarray:
    slow = joint.of(f"stribeck_friction_{side}")
    return coulomb + slow["torque_nm"] * np.exp(-((speed / slow["velocity_rad_s"]) ** 2))


def _gain(motion: np.ndarray, torque: np.ndarray) -> float:
    power = float(np.mean(motion**2))
    return float(np.mean(motion * torque)) / power if power > 0.0 else math.nan


def _continuous(joint: Joint, gains: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B, C with the states th, th' of the motor, then link, third body, cable, drive."""
    body = joint.body
    inertias, dampings = [body["jm"]], [body["fvm"] + gains.get("motor_nm_s_rad", 0.0)]
    springs: list[tuple[int, int, float, float]] = []  # from body, to body, stiffness, damping
    if not joint.one_body:
        inertias.append(body["j"])
        dampings.append(body["fv"] + gains.get("link_nm_s_rad", 0.0))
        stiffness = gains.get("stiffness_nm_rad", body["k0"])
        springs.append((0, 1, stiffness, joint.of("transmission_damping")["nm_s_rad"]))
    if joint.has("extra_mode"):
        mode = joint.of("extra_mode")
        inertia, w = mode["inertia_kg_m2"], 2.0 * math.pi * mode["frequency_hz"]
        inertias.append(inertia)
        dampings.append(0.0)
        springs.append((1, 2, inertia * w**2, 2.0 * mode["damping_ratio"] * inertia * w))
    lag = joint.of("actuator_lag")["time_constant_s"]
    bodies = len(inertias)
    cable = joint.of("cable")
    given_way = 2 * bodies
    size = given_way + joint.has("cable") + bool(lag)
    stiff, damp = np.zeros((bodies, bodies)), np.diag(np.array(dampings))
    for first, second, k, damping in springs:
        signs = np.zeros((bodies, 1))
        signs[first], signs[second] = 1.0, -1.0
        stiff, damp = stiff + k * signs @ signs.T, damp + damping * signs @ signs.T
    weight = joint.of("gravity")
    at = 0 if joint.one_body else 1
    stiff[at, at] += weight["torque_nm"] * math.cos(weight["angle_rad"])
    stiff[at, at] += joint.of("external_spring")["stiffness_nm_rad"] + cable["stiffness_nm_rad"]
    hard = joint.of("hardening_spring")
    stiff[at, at] += hard["stiffness_nm_rad"] + 3.0 * hard["cubic_nm_rad3"] * hard["rest_rad"] ** 2
    a, b, c = np.zeros((size, size)), np.zeros((size, 1)), np.zeros((2, size))
    inverse = np.diag(1.0 / np.array(inertias))
    a[0 : 2 * bodies : 2, 1 : 2 * bodies : 2] = np.eye(bodies)
    a[1 : 2 * bodies : 2, 0 : 2 * bodies : 2] = -inverse @ stiff
    a[1 : 2 * bodies : 2, 1 : 2 * bodies : 2] = -inverse @ damp
    if joint.has("cable"):
        a[2 * at + 1, given_way] = cable["stiffness_nm_rad"] / inertias[at]
        a[given_way, 2 * at] = 1.0 / cable["relaxation_s"]
        a[given_way, given_way] = -1.0 / cable["relaxation_s"]
    gain = 1.0 + joint.of("torque_gain")["relative_error"]
    if lag:
        a[1, -1], a[-1, -1], b[-1, 0] = 1.0 / inertias[0], -1.0 / lag, gain / lag
    else:
        b[1, 0] = gain / inertias[0]
    c[0, 0] = 1.0
    c[1, 0 if joint.one_body else 2] = 1.0
    return a, b, c


def _held(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, period: float, delay: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the model under held input, torques on their way as further states."""
    whole = int(delay / period + _WHOLE)
    late = max(delay - whole * period, 0.0)
    late = 0.0 if late < _WHOLE * period else late
    first, before = _over(a, b, late)
    rest, now = _over(a, b, period - late)
    n, waiting = len(a), whole + (late > 0.0)
    ad = np.zeros((n + waiting, n + waiting))
    bd = np.zeros((n + waiting, 1))
    ad[:n, :n] = rest @ first
    # states n, n+1, ...: torques of one, two, ... samples ago
    for torque, ago in ((now, whole), (rest @ before, whole + 1)):
        if ago == 0:
            bd[:n] += torque
        elif ago <= waiting:
            ad[:n, n + ago - 1 : n + ago] += torque
    if waiting:
        bd[n, 0] = 1.0
        ad[n + 1 :, n:-1] = np.eye(waiting - 1)
    return ad, bd, np.hstack([c, np.zeros((2, waiting))])


def _over(a: np.ndarray, b: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """Return transition and added state of a time under an input of one."""
    n = len(a)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n:] = a * time, b * time
    whole = expm(block)
    return whole[:n, :n], whole[:n, n:]


def control_script(joint: Joint, linear: LinearJoint) -> str:
    """Return a Python script that makes the joint an object of python-control."""
    ad, bd, cd = linear.discrete
    told = [f"# {name} = {value:.6g}, best fit over the replayed motion" for name, value in
            linear.equivalents.items()]  # fmt: skip
    delay = joint.of("delay")["time_s"]
    lines = [
        f'"""One joint from {_safe(joint.title)}: torque (N m) to position of motor and link',
        "(rad), as objects of python-control.",
        "",
        f"`continuous` lacks the delay of {delay:g} s; `discrete` has it, its torque is held at",
        f'{joint.sample_rate_hz:g} Hz."""',
        "",
        "import control",
        "",
        *told,
        f"DELAY_S = {delay!r}",
        f"SAMPLE_PERIOD_S = {1.0 / joint.sample_rate_hz!r}",
        *_matrices("A", linear.a, "B", linear.b, "C", linear.c),
        *_matrices("AD", ad, "BD", bd, "CD", cd),
        'NAMES = {"inputs": ["torque"], "outputs": ["motor", "link"]}',
        'continuous = control.ss(A, B, C, 0, name="joint", **NAMES)',
        'discrete = control.ss(AD, BD, CD, 0, SAMPLE_PERIOD_S, name="held_joint", **NAMES)',
    ]
    return "\n".join(lines) + "\n"


def _safe(text: str) -> str:
    return text.replace("\\", "/").replace('"', "'")


def _matrices(*named: str | np.ndarray) -> list[str]:
    pairs = zip(named[::2], named[1::2], strict=True)
    return [f"{name} = {np.asarray(value).tolist()!r}" for name, value in pairs]
