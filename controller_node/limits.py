"""Parameters of the controller's safety functions, and the values that real hardware requires."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.errors import InputError

SAFETY = ParameterGroup(
    Parameter(
        "torque_rate_limit_nm_s",
        math.inf,
        "N m/s",
        "The torque changes no faster than this; .inf: no limit",
        1e-3,
    ),
    Parameter(
        "position_limit_rad",
        math.inf,
        "rad",
        "Trips when the measured position is beyond +- this; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "velocity_limit_rad_s",
        math.inf,
        "rad/s",
        "Trips when the velocity is beyond +- this; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "velocity_window_s",
        0.005,
        "s",
        "Time constant of the velocity estimate; a jump of velocity_limit_rad_s times this trips",
        1e-5,
        10.0,
    ),
    Parameter(
        "position_jump_rad",
        0.1,
        "rad",
        "Real time only: trips when the position changes by more from sample to sample; .inf: no "
        "limit",
        1e-6,
    ),
    Parameter(
        "reference_limit_rad",
        100.0,
        "rad",
        "Real time only: trips when the reference is beyond +- this; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "reference_step_rad",
        10.0,
        "rad",
        "Real time only: trips when the reference changes by more from sample to sample, or begins "
        "farther from the position; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "position_timeout_s",
        0.1,
        "s",
        "Real time only: trips when no position came for this long, or when stamps are ahead "
        "of the clock by this; .inf: never",
        1e-3,
    ),
    Parameter(
        "reference_timeout_s",
        0.1,
        "s",
        "Real time only: trips when positions had no reference for this long; .inf: never",
        0.0,
    ),
    Parameter(
        "torque_soft_start_s",
        0.5,
        "s",
        "Rise of the torque from zero after a release and, in real time, when a run begins",
        0.0,
        60.0,
    ),
    Parameter(
        "ramp_down_s",
        0.05,
        "s",
        "Ramp of the torque to zero after a trip by a watchdog or the emergency stop",
        0.0,
        10.0,
    ),
    Parameter("hardware", False, "", "The drive is real: all limits and confirm must be given"),
    Parameter("confirm", "", "", "With hardware: the name of the joint that is going to move"),
)
"""Parameters of the safety functions; the same names are parameters of the controller node."""

_HARDWARE_LIMITS = (
    "torque_limit_nm",
    "torque_rate_limit_nm_s",
    "position_limit_rad",
    "velocity_limit_rad_s",
    "position_jump_rad",
    "position_timeout_s",
    "reference_limit_rad",
    "reference_step_rad",
    "reference_timeout_s",
)


def check_hardware(values: Mapping[str, Any]) -> None:
    """Refuse hardware without limits and confirmation.

    Args:
        values: checked values of SAFETY, of the control law, and `joint`.

    Raises:
        InputError: `hardware` is true and a limit is infinite, or `confirm` is not the joint.
    """
    if not values["hardware"]:
        return
    endless = [name for name in _HARDWARE_LIMITS if math.isinf(values[name])]
    if endless:
        raise InputError(f"hardware needs finite limits; give {', '.join(endless)}.")
    if values["confirm"] != values["joint"]:
        raise InputError(
            f"hardware moves joint {values['joint']!r}; confirm that with "
            f"confirm:={values['joint']}."
        )
