"""How well a fit knows its parameters: 95 % intervals that allow for a law that is not quite right.

The Gauss-Newton covariance holds if what the fit leaves is noise. A law of another form than the
rig's leaves something that is alike on neighbouring lines, and shifts the parameters by more. The
group jackknife sees that (Efron, Tibshirani 1993, An Introduction to the Bootstrap, ch. 11): the
fit is repeated, to first order, without one band of one realization at a time. The wider counts.
What errs alike in all bands it cannot see: an effect of another form than the catalogue's goes
into the bare parameters beside it, whose intervals are widened by what blind cases have shown.
"""

from __future__ import annotations

import numpy as np

from .diagnosis import Estimate
from .fits import Fit

WIDENING: tuple[float, ...] = (1.0, 1.27, 1.92)
"""Factor on the standard errors of the bare parameters in a fit with no effect, one, and more.

From `gap_diagnosis.blind.calibrate` on the seeds 102, 103 and 105: 456, 776 and 216 parameters.
"""
_NORMAL_95 = 1.96


def estimates(fit: Fit, groups: np.ndarray) -> dict[str, Estimate]:
    """Return all free parameters of a fit with their 95 % intervals, cut at their bounds.

    Args:
        fit: an explanation.
        groups: to which group each of its training errors belongs, `Misfit.groups`.
    """
    solution, space = fit.solution, fit.space
    std = standard_errors(solution.jacobian, solution.residuals, groups)
    std[: len(space.nominal)] *= WIDENING[min(len(fit.effects), len(WIDENING) - 1)]
    ends = [np.clip(solution.x + sign * _NORMAL_95 * std, *space.bounds()) for sign in (-1, 1)]
    low, high = (space.model(end) for end in ends)
    found = {
        name: Estimate(value=fit.model.plant[name], low=low.plant[name], high=high.plant[name])
        for name in space.nominal
    }
    for name in space.effects:
        found[name] = Estimate(
            value=fit.model.effects[name], low=low.effects[name], high=high.effects[name]
        )
    return found


def standard_errors(jacobian: np.ndarray, residuals: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the standard error of each parameter: of Gauss-Newton or jackknife, the greater.

    Args:
        jacobian: float64 (errors, parameters) at the minimum.
        residuals: float64 (errors,), of unit variance where only noise is left.
        groups: integers (errors,).
    """
    normal = jacobian.T @ jacobian
    inflation = max(1.0, float(residuals @ residuals) / residuals.size)
    plain = inflation * np.abs(np.diag(np.linalg.pinv(normal, rcond=1e-14)))
    shifts = []
    for group in np.unique(groups):
        j, r = jacobian[groups == group], residuals[groups == group]
        shifts.append(np.linalg.pinv(normal - j.T @ j, rcond=1e-14) @ (j.T @ r))
    moved = np.array(shifts) - np.mean(shifts, axis=0)
    spread = (len(shifts) - 1) / len(shifts) * np.sum(moved**2, axis=0)
    return np.sqrt(np.maximum(plain, spread))
