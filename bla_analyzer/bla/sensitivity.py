"""Sensitivity of the loop, S = 1/(1 + G C), from records: the response of reference to error.

With W = U/R and G = Y/U of the means, (R - Y)/R = 1 - G W, whatever the controller is. What
distortion and noise D = Y - G U leave in the error is -S D where the controller acts on the error
e = r - y alone, and D/U is the error of G; so the disc of S is that of G times |S W|.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from controller_node.law import acts_on_error

from ..results.result import BlaEstimate, Sensitivity

ROUND_OFF = 1e-9
"""A torque that differs from the reference by no more than this (relative) stands for it."""


def sensitivity(
    g: np.ndarray, radius_95: np.ndarray, torque: np.ndarray, reference: np.ndarray
) -> Sensitivity | None:
    """Return the sensitivity at the lines of a BLA; None where the torque stands for the reference.

    Args:
        g: complex (F,), Y/U, rad/(N m).
        radius_95: (F,), radius of its disc, rad/(N m).
        torque: complex (F,), U turned by the phase of the reference, or the response of r to u.
        reference: (F,), |R|, or one with that response.
    """
    if np.allclose(torque, reference, rtol=ROUND_OFF, atol=0.0):
        return None
    w = torque / reference
    s = 1.0 - g * w
    return Sensitivity(s=s, s_radius_95=np.abs(s * w) * radius_95)


def of_this_loop(
    bla: BlaEstimate, controller: Mapping[str, Any] | None, sample_rate_hz: float
) -> BlaEstimate:
    """Return a BLA without sensitivity if the controller is known not to act on r - y alone."""
    if acts_on_error(controller, sample_rate_hz) is False:
        return bla.model_copy(update={"sensitivity": None})
    return bla
