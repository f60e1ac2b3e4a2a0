"""The BLA predicted without simulation: statistical linearisation as a fixed point.

For a Gaussian velocity of standard deviation s_v, sgn is best replaced by the gain sqrt(2/pi)/s_v,
and for a Gaussian deflection of standard deviation s_d, k1 d^3 by 3 k1 s_d^2 d (Bussgang). So each
side gets the damping f + f_s sqrt(2/pi)/s_v and the transmission the stiffness k0 + 3 k1 s_d^2; the
standard deviations are those of the linear closed loop with these values: a fixed point. It holds
while the signals are nearly Gaussian: not where a side sticks for long, nor where the response
jumps or is not periodic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller_node import pd_filtered
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError

from .linear import g0, zoh_states

MAX_ITERATIONS = 500
TOLERANCE = 1e-10
"""Relative change of the standard deviations at which the fixed point counts as reached."""

_STUCK = 1e-12  # rad/s and rad: far below any motion, far above what overflows
_Q, _VQ, _TH, _VTH = range(4)


@dataclass(frozen=True)
class Linearisation:
    """A fixed point.

    Attributes:
        parameters: PLANT values of the equivalent linear plant (fs = fsm = k1 = 0).
        link_velocity_rad_s: standard deviation of q'.
        motor_velocity_rad_s: standard deviation of th'.
        deflection_rad: standard deviation of q - th.
        sample_rate_hz: rate of the samples.
    """

    parameters: dict[str, float]
    link_velocity_rad_s: float
    motor_velocity_rad_s: float
    deflection_rad: float
    sample_rate_hz: float

    def frf(self, frequency_hz: np.ndarray) -> np.ndarray:
        """Return the predicted BLA with zero-order hold, complex of that shape, rad/(N m)."""
        return g0(self.parameters, frequency_hz, self.sample_rate_hz)


def controller_frf(controller: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return C(z) = P + D N (z - 1)/(z - a) of `pd_filtered.coefficients`, complex of z's shape."""
    proportional, derivative, decay, _ = controller
    return proportional + derivative * (z - 1.0) / (z - decay)


def linearise(
    parameters: Mapping[str, Any],
    controller: np.ndarray,
    sample_rate_hz: float,
    frequency_hz: np.ndarray,
    amplitudes_rad: np.ndarray,
) -> Linearisation:
    """Find the fixed point for a random-phase multisine reference.

    Args:
        parameters: values of PLANT.
        controller: `pd_filtered.coefficients`; its torque limit is ignored.
        sample_rate_hz: rate of the samples.
        frequency_hz: (F,), excited frequencies.
        amplitudes_rad: (F,), amplitude of each line.

    Raises:
        InputError: the iteration does not settle, or the rig sticks for good.
    """
    sigma = np.array([1.0, 1.0, 1e-3])
    for _ in range(MAX_ITERATIONS):
        equivalent = _equivalent(parameters, sigma)
        new = _deviations(equivalent, controller, sample_rate_hz, frequency_hz, amplitudes_rad)
        if new.min() < _STUCK:
            raise InputError("The rig sticks for good at this amplitude; raise it.")
        if np.max(np.abs(np.log(new / sigma))) < TOLERANCE:
            link, motor, deflection = map(float, new)
            return Linearisation(equivalent, link, motor, deflection, sample_rate_hz)
        sigma = np.sqrt(sigma * new)  # a damped step: at high amplitude the full one oscillates
    raise InputError(
        "The statistical linearisation does not settle for these parameters; lower the amplitude."
    )


def linearise_experiment(values: Mapping[str, Any], experiment: Experiment) -> Linearisation:
    """Find the fixed point for a described experiment.

    Args:
        values: checked SIMULATOR values.
        experiment: description with a controller.

    Raises:
        InputError: no known controller, or the iteration does not settle.
    """
    rate = experiment.sample_rate_hz
    described = pd_filtered.from_description(experiment.controller or {}, rate)
    frequency_hz = np.array(experiment.excited_harmonics) * experiment.base_frequency_hz
    coefficients = pd_filtered.coefficients(described)
    return linearise(values, coefficients, rate, frequency_hz, experiment.amplitudes_rad)


def _equivalent(parameters: Mapping[str, Any], sigma: np.ndarray) -> dict[str, float]:
    gain = math.sqrt(2.0 / math.pi)
    return {
        "jm": parameters["jm"],
        "j": parameters["j"],
        "fs": 0.0,
        "fsm": 0.0,
        "fv": parameters["fv"] + parameters["fs"] * gain / sigma[0],
        "fvm": parameters["fvm"] + parameters["fsm"] * gain / sigma[1],
        "k0": parameters["k0"] + 3.0 * parameters["k1"] * sigma[2] ** 2,
        "k1": 0.0,
    }


def _deviations(
    equivalent: Mapping[str, float],
    controller: np.ndarray,
    sample_rate_hz: float,
    frequency_hz: np.ndarray,
    amplitudes_rad: np.ndarray,
) -> np.ndarray:
    """Return the standard deviations of q', th' and q - th in the linear closed loop, (3,)."""
    z = np.exp(2j * np.pi * np.asarray(frequency_hz) / sample_rate_hz)
    states = zoh_states(equivalent, frequency_hz, sample_rate_hz)
    c = controller_frf(controller, z)
    torque = amplitudes_rad * c / (1.0 + c * states[:, _TH])
    lines = np.stack([states[:, _VQ], states[:, _VTH], states[:, _Q] - states[:, _TH]])
    return np.sqrt(0.5 * np.sum(np.abs(lines * torque) ** 2, axis=1))
