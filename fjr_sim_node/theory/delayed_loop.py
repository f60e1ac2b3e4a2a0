"""The linear loop whose torque acts late: its delay margin, and the bias of the BLA by the delay.

A torque that acts `delay` after the sample instant of the position that it answers is, for a delay
of m whole samples and a rest d, the exact discretisation

    x[k+1] = Phi x[k] + Gamma_before u[k-m-1] + Gamma_now u[k-m]

where the older torque still holds for d (Astrom, Wittenmark, Computer-Controlled Systems, ch. 3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import root

from controller_node.transfer_function import TransferFunction

from .linear import g0, held_torque, motor_side

_FREQUENCIES = 4000


def _delayed(
    parameters: Mapping[str, Any], sample_rate_hz: float, delay_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Return Phi (n, n), Gamma_now (n,), Gamma_before (n,) and the whole samples of the delay.

    The motor's position is the last state but one, see `motor_side`.
    """
    period = 1.0 / sample_rate_hz
    whole = int(delay_s / period + 1e-9)
    rest = max(delay_s - whole * period, 0.0)
    a, b = motor_side(parameters)
    transition, _ = held_torque(a, b, period)
    after, now = held_torque(a, b, period - rest)
    return transition, now, after @ held_torque(a, b, rest)[1], whole


def delayed_g0(
    parameters: Mapping[str, Any],
    frequency_hz: np.ndarray,
    sample_rate_hz: float,
    delays_s: np.ndarray,
) -> np.ndarray:
    """Return what a sampled loop measures of G0 when the torque acts late.

    Args:
        parameters: values of PLANT; viscous friction only.
        frequency_hz: (F,).
        sample_rate_hz: rate of the samples.
        delays_s: delays that occur equally often and independently; the mean response counts,
            since the plant is linear in the torque.

    Returns:
        complex (F,) in rad/(N m); with a delay of zero `linear.g0`.
    """
    z = np.exp(2j * np.pi * np.asarray(frequency_hz, float) / sample_rate_hz)
    columns = []
    for delay_s in delays_s:
        transition, now, before, whole = _delayed(parameters, sample_rate_hz, float(delay_s))
        columns.append((now + before / z[:, None]) / z[:, None] ** whole)
    resolvent = z[:, None, None] * np.eye(len(transition)) - transition
    solved = np.linalg.solve(resolvent, sum(columns)[..., None] / len(delays_s))
    return solved[:, -2, 0]


def spectral_radius(
    parameters: Mapping[str, Any], law: TransferFunction, sample_rate_hz: float, delay_s: float
) -> float:
    """Return the greatest magnitude of a pole of the closed loop; it is stable below 1."""
    transition, now, before, whole = _delayed(parameters, sample_rate_hz, delay_s)
    plant, past, states = len(transition), whole + 1, law.states
    motor, size = plant - 2, plant + past + states
    torque = np.zeros(size)  # of this sample, by plant state, past torques and state of the law
    torque[motor] = -law.position[0]
    if states:
        torque[plant + past] = 1.0
    torques = [torque, *np.eye(size)[plant : plant + past]]
    loop = np.zeros((size, size))
    loop[:plant, :plant] = transition
    loop[:plant] += np.outer(now, torques[whole]) + np.outer(before, torques[whole + 1])
    loop[plant : plant + past] = torques[:past]
    for i in range(states):
        row = loop[plant + past + i]
        row -= law.denominator[i + 1] * torque
        row[motor] -= law.position[i + 1]
        if i + 1 < states:
            row[plant + past + i + 1] += 1.0
    return float(np.abs(np.linalg.eigvals(loop)).max())


def delay_margin(
    parameters: Mapping[str, Any], law: TransferFunction, sample_rate_hz: float
) -> float:
    """Return the least constant delay (s) at which the linear loop is no longer stable.

    There a pole lies on the unit circle. It is sought from each gain crossover, where phase margin
    over frequency is that delay, but for the part of a sample by which the older torque still acts.

    Returns:
        0 if it is not stable without delay either, infinity if its gain stays below 1.
    """
    if spectral_radius(parameters, law, sample_rate_hz, 0.0) >= 1.0:
        return 0.0
    near = _phase_margins(parameters, law, sample_rate_hz)
    return min(
        (_on_the_circle(parameters, law, sample_rate_hz, *at) for at in near), default=math.inf
    )


def _on_the_circle(
    parameters: Mapping[str, Any],
    law: TransferFunction,
    sample_rate_hz: float,
    frequency_hz: float,
    delay_s: float,
) -> float:
    """Return the delay (s) near one at which a pole lies on the unit circle, near a frequency.

    That is where 1 + C_y G0 is zero; the delay itself where no such delay is found.
    """

    def characteristic(at: np.ndarray) -> list[float]:
        frequency = np.array([frequency_hz * math.exp(at[0])])
        delay = max(delay_s + at[1] / frequency_hz, 0.0)
        plant = delayed_g0(parameters, frequency, sample_rate_hz, np.array([delay]))
        value = complex((1.0 + law.response(frequency, sample_rate_hz)[1] * plant)[0])
        return [value.real, value.imag]

    found = root(characteristic, np.zeros(2), tol=1e-12)
    return max(delay_s + float(found.x[1]) / frequency_hz, 0.0) if found.success else delay_s


def _phase_margins(
    parameters: Mapping[str, Any], law: TransferFunction, sample_rate_hz: float
) -> list[tuple[float, float]]:
    """Return frequency (Hz) and phase margin over it (s) of all gain crossovers."""
    frequency_hz = np.geomspace(1e-4, 0.5, _FREQUENCIES) * sample_rate_hz
    _, controller = law.response(frequency_hz, sample_rate_hz)
    loop = controller * g0(parameters, frequency_hz, sample_rate_hz)
    above = np.abs(loop) > 1.0
    crossovers = np.flatnonzero(above[1:] != above[:-1])
    margin = np.mod(np.angle(loop[crossovers]) + np.pi, 2.0 * np.pi)
    delay_s = margin / (2.0 * np.pi * frequency_hz[crossovers])
    return list(zip(frequency_hz[crossovers].tolist(), delay_s.tolist(), strict=True))
