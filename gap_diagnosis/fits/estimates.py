"""95 % intervals of fitted parameters that allow for a law that is not quite right.

The Gauss-Newton covariance holds if what the fit leaves is noise. A law of another form than the
rig's leaves something that is alike on neighbouring lines, and shifts the parameters by more. The
group jackknife sees that (Efron, Tibshirani 1993, An Introduction to the Bootstrap, ch. 11): the
fit is repeated, to first order, without one band of one realization at a time. The wider counts.
What errs alike in all bands it cannot see.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.stats import chi2

from fjr_sim_node import effects as fx

from ..gates.bag_deviations import SCATTERING
from ..outcome.diagnosis import Bags
from ..outcome.gap_size import Estimate
from ..starts.ripples_passed import ripples_passed
from ..starts.scales import Scales
from .comparison import CellFit

FORM = 0.01
"""Standard deviation of an effect's parameters by the form of its law, relative, where noise
explains what it leaves: no law of a catalogue is quite the rig's. By what 139 parameters of the
blind check of seed 306 showed."""
FORM_BESIDE = 0.03
"""The same beside a remainder; by 72 parameters of that check."""
_LEFT_TO_OTHERS = 0.01
"""Of what is known of a parameter: where the others hold less, one group holds nearly all."""
_ALIKE = 1e-13
"""Least eigenvalue of a normal matrix with a unit diagonal: below it is the rounding of a Jacobian
of what parameters do alike."""
NORMAL_95 = 1.96


def form(fit: CellFit, share: float, scales: Scales) -> np.ndarray:
    """Return the standard deviation of a fit's parameters by the forms of the effects' laws.

    A number of cycles has none where a whole ripple is passed: whatever its form, its period is the
    machine's. Of a part of a ripple the form decides how long the whole is.

    Base parameters follow the effects where a remainder stays: a joint's inertia was off by more
    than its own error in a third of robot joints beside friction of another form.

    Args:
        fit: an explanation.
        share: of a parameter's value; in rad of an angle.
        scales: of the record.

    Returns:
        (parameters,), in units of the point; zero for the base parameters if noise explains what
        is left, or there are no effects.
    """
    own, x = len(fit.space.nominal), fit.solution.x
    roles = np.array([fx.parameter(name).role for name in fit.space.effects], str)
    sizes = np.where(roles == "angle", 1.0 / np.array(fit.space.units), np.abs(x[own:]))
    passed = np.array([_passed(fit, name, scales) for name in fit.space.effects])
    sizes = np.where(roles == "cycles", np.where(passed < 1.0, sizes / passed, 0.0), sizes)
    base = np.full(own, float(share >= FORM_BESIDE and sizes.size > 0))
    return share * np.concatenate([base, sizes])


def _passed(fit: CellFit, name: str, scales: Scales) -> float:
    """Return how many of its ripples the effect of a parameter passes."""
    return ripples_passed(fit.model, name.split(".", 1)[0], scales)


def linear_estimates(fit: CellFit, std: np.ndarray) -> dict[str, Estimate]:
    """Return all free parameters of a fit with their 95 % intervals, cut at their bounds.

    What is not free is known as far as the datasheet is.

    Args:
        fit: an explanation.
        std: (parameters,), standard deviations of its point.
    """
    x, space = fit.solution.x, fit.space
    low, high = (
        space.model(np.clip(x + sign * NORMAL_95 * std, *space.bounds())) for sign in (-1, 1)
    )
    found = {
        name: Estimate(value=fit.model.plant[name], low=low.plant[name], high=high.plant[name])
        for name in space.nominal
    }
    off = 1.0 + space.tolerance
    for name in set(space.known) & set(found):
        value = found[name].value
        found[name] = Estimate(value=value, low=value / off, high=value * off)
    for name in space.effects:
        found[name] = Estimate(
            value=fit.model.effects[name], low=low.effects[name], high=high.effects[name]
        )
    return found


def kept_from_zero(
    found: Mapping[str, Estimate], fallen: Mapping[str, float]
) -> dict[str, Estimate]:
    """Return intervals of which those of an only size do not hold zero where the data exclude it.

    A size that is entangled with the shape of its effect (an angle, a ratio, a velocity) is known
    better than the linear interval says: at zero the effect is gone, so that the fit without it is
    a point of the profile likelihood. The interval ends where the parabola through both points has
    its 95 % limit (Venzon, Moolgavkar 1988, Applied Statistics 37(1)).

    Args:
        found: parameters with their linear intervals.
        fallen: by effect, by how much it lowers twice the negative log-likelihood of the fit.
    """
    kept = dict(found)
    for effect, fall in fallen.items():
        sizes = [name for name in fx.EFFECTS[effect].size_names if name in found]
        if len(sizes) == 1 and fall > NORMAL_95**2:
            kept[sizes[0]] = _beside_zero(found[sizes[0]], fall)
    return kept


def _beside_zero(linear: Estimate, fall: float) -> Estimate:
    if not linear.low <= 0.0 <= linear.high:
        return linear
    nearest = linear.value * (1.0 - NORMAL_95 / np.sqrt(fall))
    if linear.value > 0.0:
        return linear.model_copy(update={"low": nearest})
    return linear.model_copy(update={"high": nearest})


def together_sure(fall: float, sizes: int) -> bool:
    """Tell whether several sizes of an effect are not all zero, by a likelihood ratio.

    Args:
        fall: of twice the negative log-likelihood, by the effect.
        sizes: number of its sizes.
    """
    return fall > float(chi2.isf(0.05, sizes))


def relative_scatter(bags: Bags | None) -> dict[str, float]:
    """Return the standard deviation from run to run of parameters of the bare plant, relative.

    Args:
        bags: how far each scatters; None where that is not known.
    """
    if bags is None:
        return {}
    return {
        part: estimate.value / 100.0
        for name, estimate in bags.scatter_percent.items()
        for part in SCATTERING[name]
        if estimate.low > 0.0
    }


def moved_by_scatter(fit: CellFit, runs: np.ndarray, scatter: Mapping[str, float]) -> np.ndarray:
    """Return how far parameters that scatter from run to run move the point of a fit.

    A fit to a few runs knows what these runs have in common. Each scattering parameter deviates in
    each run by its own, and moves all parameters of the fit, to first order: the variances of all
    deviations add up (random effects). A parameter that all runs show alike is itself off by its
    scatter over the root of the number of runs.

    Args:
        fit: to errors in standard deviations.
        runs: integers (errors,), the run of each of these errors.
        scatter: standard deviations by names of the bare plant, relative. What the bare plant
            lacks scatters as the parameter that it adds to.

    Returns:
        (parameters,), standard deviations in units of the point.
    """
    jacobian, change = fit.solution.jacobian, deviations(fit, scatter)
    on = np.flatnonzero(change)
    variance = np.zeros(change.size)
    if on.size:
        inverse = inverted(jacobian.T @ jacobian)
        for run in np.unique(runs):
            rows = jacobian[runs == run]
            variance += np.sum((inverse @ (rows.T @ rows[:, on]) * change[on]) ** 2, axis=1)
    return np.sqrt(variance)


def deviations(fit: CellFit, scatter: Mapping[str, float]) -> np.ndarray:
    """Return the standard deviation from run to run of each parameter of a fit.

    Args:
        fit: an explanation.
        scatter: see `moved_by_scatter`.

    Returns:
        (parameters,), in units of the point; zero for what does not scatter.
    """
    space, x = fit.space, fit.solution.x
    own = [scatter.get(name, 0.0) if value else 0.0 for name, value in space.nominal.items()]
    origins = [fx.parameter(name).adds_to for name in space.effects]
    added = np.array([scatter.get(origin, 0.0) for origin in origins])
    return np.concatenate([own, np.abs(x[len(own) :]) * added])


def run_scatter(found: Mapping[str, Estimate], bags: Bags | None) -> dict[str, float]:
    """Return the standard deviation of parameters from run to run, each in its own unit.

    What the bare plant lacked scatters as the parameter that it adds to. Empty where the scatter
    may be that of a law which is not the rig's.

    Args:
        found: parameters with their intervals.
        bags: how far each scatters; None where that is not known.
    """
    scattering = relative_scatter(bags if bags is not None and bags.scatter_known else None)
    origin = {name: fx.parameter(name).adds_to if "." in name else name for name in found}
    return {
        name: abs(found[name].value) * scattering[part]
        for name, part in origin.items()
        if part in scattering
    }


def standard_errors(
    jacobian: np.ndarray,
    residuals: np.ndarray,
    groups: np.ndarray,
    prior: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Return the standard error of each parameter: of Gauss-Newton or jackknife, the greater.

    Where one group holds nearly all that is known of a parameter, the others cannot stand in for
    it, and its own score counts instead (infinitesimal jackknife).

    Args:
        jacobian: float64 (errors, parameters) at the minimum.
        residuals: float64 (errors,), of unit variance where only noise is left.
        groups: integers (errors,).
        prior: what is known of each parameter beforehand, as 1/variance, (parameters,).
    """
    normal = jacobian.T @ jacobian + np.diag(np.broadcast_to(prior, jacobian.shape[1]))
    inflation = max(1.0, float(residuals @ residuals) / residuals.size)
    inverse = inverted(normal)
    plain = inflation * np.abs(np.diag(inverse))
    shifts = []
    for group in np.unique(groups):
        j, r = jacobian[groups == group], residuals[groups == group]
        others, score = inverted(normal - j.T @ j), j.T @ r
        alone = np.abs(np.diag(others)) * _LEFT_TO_OTHERS > np.abs(np.diag(inverse))
        shifts.append(np.where(alone, inverse @ score, others @ score))
    moved = np.array(shifts) - np.mean(shifts, axis=0)
    spread = (len(shifts) - 1) / len(shifts) * np.sum(moved**2, axis=0)
    return np.sqrt(np.maximum(plain, spread))


def inverted(normal: np.ndarray) -> np.ndarray:
    """Return the covariance of parameters from their normal matrix J^T J.

    What parameters do alike, so that only their sum is seen, is hardly known of each: the
    pseudoinverse would take it for known. A parameter that does nothing has no variance here.

    Args:
        normal: (parameters, parameters), positive semidefinite.
    """
    scale = np.sqrt(np.maximum(np.diag(normal), 0.0))
    does = scale > 0.0
    scale = np.where(does, scale, 1.0)
    values, vectors = np.linalg.eigh(normal / np.outer(scale, scale))
    found = (vectors / np.maximum(values, _ALIKE)) @ vectors.T
    return np.asarray(found * np.outer(does / scale, does / scale))
