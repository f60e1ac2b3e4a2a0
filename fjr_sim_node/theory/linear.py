"""Linear motor-side dynamics G0 (torque -> motor position) and its zero-order-hold equivalent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

Damping = Literal["viscous", "paper"]

DESCRIPTIONS: dict[Damping, str] = {
    "viscous": "underlying linear plant, viscous friction only",
    "paper": "paper eqs. 6-7, dry friction added to viscous friction",
}


def state_space(
    parameters: Mapping[str, Any], damping: Damping = "viscous"
) -> tuple[np.ndarray, np.ndarray]:
    """Return A (4, 4) and B (4,) of the linear plant with state (q, q', th, th').

    Args:
        parameters: values of PLANT.
        damping: `viscous` takes fv and fvm; `paper` adds fs and fsm to them (eqs. 6-7).
    """
    extra_link, extra_motor = (
        (parameters["fs"], parameters["fsm"]) if damping == "paper" else (0.0, 0.0)
    )
    j, jm, k0 = parameters["j"], parameters["jm"], parameters["k0"]
    link, motor = parameters["fv"] + extra_link, parameters["fvm"] + extra_motor
    if math.isinf(k0):
        return _rigid(jm + j, motor + link)
    a = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-k0 / j, -link / j, k0 / j, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [k0 / jm, 0.0, -k0 / jm, -motor / jm],
        ]
    )
    return a, np.array([0.0, 0.0, 0.0, 1.0 / jm])


def motor_side(parameters: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return A (n, n) and B (n,) of what the motor feels, viscous friction only.

    The last two states are those of the motor. The link's are left out where it has no motion of
    its own, on a rigid axis, and where it is held: no loop about the motor moves their poles.

    Args:
        parameters: values of PLANT.
    """
    a, b = state_space(parameters)
    if math.isinf(parameters["k0"]) or math.isinf(parameters["j"]):
        return a[2:, 2:], b[2:]
    return a, b


def _rigid(inertia: float, viscous: float) -> tuple[np.ndarray, np.ndarray]:
    """Return A and B of a rigid axis, whose link moves as its motor does."""
    body = [[0.0, 1.0], [0.0, -viscous / inertia]]
    return np.kron(np.eye(2), body), np.array([0.0, 1.0 / inertia] * 2)


def g0(
    parameters: Mapping[str, Any],
    frequency_hz: np.ndarray,
    sample_rate_hz: float,
    damping: Damping = "viscous",
) -> np.ndarray:
    """Return the zero-order-hold equivalent of G0: what a sampled loop with held torque measures.

    Args:
        parameters: values of PLANT.
        frequency_hz: frequencies, any shape.
        sample_rate_hz: rate of the samples.
        damping: which G0, see `state_space`.

    Returns:
        complex FRF in rad/(N m) of the shape of `frequency_hz`.
    """
    return zoh_states(parameters, frequency_hz, sample_rate_hz, damping)[..., 2]


def zoh_states(
    parameters: Mapping[str, Any],
    frequency_hz: np.ndarray,
    sample_rate_hz: float,
    damping: Damping = "viscous",
) -> np.ndarray:
    """Return the FRF of held torque to all sampled states, like `g0`.

    Returns:
        complex (..., 4): q, q', th, th' per N m.
    """
    transition, held = held_torque(*state_space(parameters, damping), 1.0 / sample_rate_hz)
    z = np.exp(2j * np.pi * np.asarray(frequency_hz, float) / sample_rate_hz)
    resolvent = z[..., None, None] * np.eye(4) - transition
    return np.linalg.solve(resolvent, np.broadcast_to(held[:, None], (*z.shape, 4, 1)))[..., 0]


def held_torque(a: np.ndarray, b: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return what a time under a torque of 1 N m does to the state: transition (n, n), added (n,).

    Args:
        a: (n, n) from `state_space` or `motor_side`.
        b: (n,) from the same.
        seconds: how long the torque is held.
    """
    augmented = np.pad(a, (0, 1))
    augmented[:-1, -1] = b
    discrete = _exponential(augmented * seconds)
    return discrete[:-1, :-1], discrete[:-1, -1]


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """Return the matrix exponential by scaling, Taylor series and squaring, to round-off.

    For these 5 by 5 matrices scipy's `expm` takes 100 times as long while other threads keep the
    cores busy, because it wakes the threads of its linear algebra.
    """
    halvings = max(0, int(np.ceil(np.log2(max(np.abs(matrix).sum(axis=0).max(), 1e-300)))) + 3)
    scaled = matrix / 2.0**halvings
    total = term = np.eye(len(matrix))
    for order in range(1, 13):
        term = term @ scaled / order
        total = total + term
    for _ in range(halvings):
        total = total @ total
    return total
