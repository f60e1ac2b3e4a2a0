"""The default control law: PD with filtered derivative, C(s) = P + D N/(1 + N/s) (paper eq. 12).

Discretised step-invariantly, so that between samples nothing is assumed of the error but its value:

    x[k+1] = a x[k] + (1 - a) e[k],  a = exp(-N Ts),  e = r - y,  x[0] = 0
    u[k] = P e[k] + D N (e[k] - x[k]), then clamped to the torque limit
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.compiled import inlined
from fjr_kit.errors import InputError

CONTROLLER = ParameterGroup(
    Parameter("sample_rate_hz", 1000.0, "Hz", "Rate of the samples", 1.0, 20_000.0),
    Parameter(
        "p", 200.0, "N m/rad", "Proportional gain", 0.0, 1e6, symbol="P", source="paper eq. 12"
    ),
    Parameter(
        "d", 60.0, "N m s/rad", "Derivative gain", 0.0, 1e5, symbol="D", source="paper eq. 12"
    ),
    Parameter(
        "n", 24.0, "rad/s", "Bandwidth of the derivative", 0.0, 1e5, symbol="N", source="eq. 12"
    ),
    Parameter(
        "torque_limit_nm", math.inf, "N m", "Torque is clamped to +- this; .inf: no limit", 0.0
    ),
)
"""Parameters of the control law; the same names are parameters of the controller node."""


def coefficients(parameters: Mapping[str, Any]) -> np.ndarray:
    """Return [P, D N, a, limit], what `step` needs, from checked CONTROLLER values."""
    bandwidth = parameters["n"]
    decay = math.exp(-bandwidth / parameters["sample_rate_hz"])
    limit = parameters["torque_limit_nm"]
    return np.array([parameters["p"], parameters["d"] * bandwidth, decay, limit])


@inlined
def step(x, error, coefficients):
    """Advance the controller by one sample.

    Args:
        x: filter state before the sample (rad).
        error: e = r - y (rad).
        coefficients: from `coefficients`.

    Returns:
        (x for the next sample, torque u in N m).
    """
    torque = coefficients[0] * error + coefficients[1] * (error - x)
    limit = coefficients[3]
    if torque > limit:
        torque = limit
    elif torque < -limit:
        torque = -limit
    decay = coefficients[2]
    return decay * x + (1.0 - decay) * error, torque


def describe(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `controller` entry of an experiment description."""
    limit = parameters["torque_limit_nm"]
    return {
        "kind": "pd_filtered",
        "p": parameters["p"],
        "d": parameters["d"],
        "n": parameters["n"],
        "torque_limit_nm": None if math.isinf(limit) else limit,
    }


def from_description(controller: Mapping[str, Any], sample_rate_hz: float) -> dict[str, Any]:
    """Return CONTROLLER values from the `controller` entry of an experiment description.

    Raises:
        InputError: another kind of controller, or a value that is missing or out of range.
    """
    source = "experiment description: controller"
    if controller.get("kind") != "pd_filtered":
        raise InputError(
            f"{source}.kind is {controller.get('kind')!r}; here it must be pd_filtered."
        )
    missing = [name for name in ("p", "d", "n") if name not in controller]
    if missing:
        raise InputError(f"{source}.{missing[0]} is missing; write it into the description.")
    limit = controller.get("torque_limit_nm")
    values = {name: controller[name] for name in ("p", "d", "n")}
    values["torque_limit_nm"] = math.inf if limit is None else limit
    return CONTROLLER.check({**values, "sample_rate_hz": sample_rate_hz}, source)
