"""A fitted model as python-control's transfer function."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fjr_kit.errors import InputError

from .fit_types import Fit

if TYPE_CHECKING:
    import control


def to_control(fit: Fit, level: int, *, pade_order: int = 3) -> control.TransferFunction:
    """Return the model of a level as python-control's transfer function.

        >>> from bla_analyzer import analyze, fit_bla, to_control
        >>> plant = to_control(fit_bla(analyze("rig"), model="two-inertia"), level=1)
        >>> plant.ninputs, plant.noutputs, plant.isctime()  # torque in N m; motor position in rad
        (1, 1, True)

    A continuous model is that of the plant, without the hold. Its delay is a Pade approximation; of
    a discrete one it must be a whole number of samples.

    Args:
        fit: the models.
        level: index of the level.
        pade_order: order of the approximation of a delay that is not zero.

    Returns:
        `control.TransferFunction` from motor torque to motor position, and to link position as a
        second output where it was fitted, in rad/(N m).

    Raises:
        InputError: python-control is absent, the level is absent, or the delay is no whole number
            of samples.
    """
    found = next((one for one in fit.levels if one.level == level), None)
    if found is None:
        there = ", ".join(str(one.level) for one in fit.levels)
        raise InputError(f"{fit.source}: level {level} was not fitted; choose one of: {there}.")
    try:
        import control
    except ImportError:
        raise InputError(
            "control.TransferFunction needs python-control; install fjr-rig[control]."
        ) from None
    upper = [np.array(one.numerator) for one in found.outputs]
    lower, delay = np.array(found.denominator), found.delay_s.value
    if fit.domain == "z":
        samples = delay * fit.sample_rate_hz
        if abs(samples - round(samples)) > 1e-6 or samples < -1e-6:
            raise InputError(
                f"{fit.source}: a delay of {samples:.4g} samples is negative or not whole, which "
                "a discrete transfer function cannot hold; fit with a fixed delay."
            )
        lower = np.append(lower, np.zeros(round(samples)))
    elif delay:
        if delay < 0:
            raise InputError(
                f"{fit.source}: the delay is negative ({delay:.4g} s), which a transfer function "
                "cannot hold; fit with --delay 0."
            )
        ahead, behind = control.pade(delay, pade_order)
        upper, lower = [np.convolve(each, ahead) for each in upper], np.convolve(lower, behind)
    step = 1.0 / fit.sample_rate_hz if fit.domain == "z" else 0
    return control.TransferFunction(
        [[each] for each in upper], [[lower] for _ in upper], step, name=f"fit of level {level}"
    )
