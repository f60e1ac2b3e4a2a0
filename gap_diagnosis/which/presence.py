"""Tests of presence: is a cause there, the same at all levels, and by how much?

A substitute for another effect can lower the misfit of one level; its value moves when the
amplitude changes, and a true cause keeps its value (invariant causal prediction: Peters, Buehlmann,
Meinshausen 2016, JRSS-B 78(5)).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..fits.estimates import (
    FORM,
    FORM_BESIDE,
    NORMAL_95,
    deviations,
    form,
    kept_from_zero,
    linear_estimates,
    moved_by_scatter,
    standard_errors,
    together_sure,
)
from ..fits.gains import fall
from ..model.rig_model import Model
from ..outcome.gap_size import Estimate

LEAST_INVARIANCE_P = 0.01
SAME_WORTH = 0.01
"""Of what a cause closes: sizes of its own at each level that would close no more than this beyond
are one size. Sizes a tenth above and below one common size would."""
_SAME = 0.05  # relative: sizes that differ by no more are the same, since friction scatters
_AT_BOUND = 1e-3  # relative


def cell_estimates(
    fit: CellFit, fitter: CellFitter, scatter: Mapping[str, float], without: Mapping[str, CellFit]
) -> dict[str, Estimate]:
    """Return all free parameters with their 95 % intervals, cut at their bounds.

    A gain of the torque is known only as far as the datasheet is: the data cannot tell it from base
    parameters that are all scaled, so beside it their tolerance counts as a 95 % interval.

    A size that the shape of an only effect blurs is kept from zero by its profile; of several
    effects one may blur the other, and then it is not known which of them is there.

    Args:
        fit: an explanation.
        fitter: that made it.
        scatter: standard deviations of parameters from run to run, see `moved_by_scatter`.
        without: the fits that lack one of its effects, by that.
    """
    fit = fitter.differentiated(fit)
    space, solution = fit.space, fit.solution
    prior = np.zeros(solution.x.size)
    if any(fx.EFFECTS[effect].scales == "everywhere" for effect in fit.effects):
        prior[: len(space.nominal)] = (NORMAL_95 / np.log1p(space.tolerance)) ** 2
    std = standard_errors(solution.jacobian, solution.residuals, fitter.groups, prior)
    moved = moved_by_scatter(fit, fitter.runs, scatter)
    share = FORM if fitter.misfit(fit) < NOTHING_LEFT else FORM_BESIDE
    by_form = form(fit, share, fitter.scales)
    linear = linear_estimates(fit, np.sqrt(std**2 + moved**2 + by_form**2))
    if len(fit.effects) > 1:
        return linear
    return kept_from_zero(linear, {e: fall(fitter, fit, other) for e, other in without.items()})


def beyond_zero(effect: str, found: Mapping[str, Estimate], fall: float) -> bool:
    """Tell whether an effect's sizes are known not to mean that it is off.

    The interval of one of them lacks that value; of several that only together are known, the
    likelihood ratio tells it.

    Args:
        effect: its identifier.
        found: parameters with their intervals.
        fall: see `CellFitter.fall`, of the fit without the effect.
    """
    sizes = [name for name in fx.EFFECTS[effect].size_names if name in found]
    for name in sizes:
        estimate, off = found[name], float(fx.parameter(name).default)
        if math.isinf(off):  # a limit, whose inverse is a size
            off = 0.0
        if not estimate.low <= off <= estimate.high:
            return True
    return len(sizes) > 1 and together_sure(fall, len(sizes))


def at_its_bound(fit: CellFit, effect: str) -> str | None:
    """Return the parameter of an effect that lies where the fit may go no further; None if none is.

    Zero and one are no such bounds: they are what a ratio or a share can be.
    """
    low, high = fit.space.bounds()
    for k, name in enumerate(fit.space.effects, len(fit.space.nominal)):
        if not name.startswith(f"{effect}.") or fx.parameter(name).role == "angle":
            continue
        unit = fit.space.units[k - len(fit.space.nominal)]
        for end in (low[k], high[k]):
            near = abs(fit.solution.x[k] - end) <= _AT_BOUND * max(abs(end), _AT_BOUND)
            if near and end * unit not in (0.0, 1.0):
                return name
    return None


def over_usual(model: Model, effect: str) -> float:
    """Return the size of an effect over the greatest that machines have, 0 where any is usual."""
    usual = {name: fx.parameter(name).usual for name in fx.EFFECTS[effect].size_names}
    known = [abs(model.effects[n]) / most for n, most in usual.items() if math.isfinite(most)]
    return max(known, default=0.0)


@dataclass(frozen=True)
class Invariance:
    """Whether an effect has one size at all levels.

    Attributes:
        p: how often chance makes its sizes differ so much between levels.
        own: models by level in which the size that differs most is free at each.
    """

    p: float
    own: Mapping[int, Model]


def invariance(
    fitter: CellFitter, fit: CellFit, effect: str, scatter: Mapping[str, float]
) -> Invariance | None:
    """Return whether an effect has one size at all levels.

    The sizes are free at each level while all else is common, to first order; their covariance is
    robust to what is alike within a part (sandwich estimate by clusters). It rests on few parts, so
    that the Wald statistic follows an F distribution, with the freedom of the level of fewest. What
    scatters from run to run moves the size of a level that has few runs, and widens it.

    Args:
        fitter: that made the fit.
        fit: an explanation with the effect.
        effect: its identifier.
        scatter: standard deviations of parameters from run to run, see `moved_by_scatter`.

    Returns:
        with the p-value of the Wald test that they are equal; None with one level.
    """
    evidence = fitter.evidence
    level = np.array([evidence.parts[p].level for p in fitter.groups])
    columns = [
        len(fit.space.nominal) + k
        for k, name in enumerate(fit.space.effects)
        if name.startswith(f"{effect}.") and fx.parameter(name).role in ("size", "limit")
    ]
    if np.unique(level).size < 2 or not columns:
        return None
    change = deviations(fit, scatter)
    found = [_equal(fit, column, level, fitter, change) for column in columns]
    acting = [one for one in found if one is not None]
    if not acting:
        return Invariance(1.0, {})
    least = min(acting, key=lambda one: one.p)
    return Invariance(min(least.p * len(columns), 1.0), least.own)


def _equal(
    fit: CellFit, column: int, level: np.ndarray, fitter: CellFitter, change: np.ndarray
) -> Invariance | None:
    jacobian, residuals, groups = fit.solution.jacobian, fit.solution.residuals, fitter.groups
    own, levels = jacobian[:, column], np.unique(level)
    if not own.any():
        return None
    split = own[:, None] * (level[:, None] == levels)
    common = np.delete(jacobian, column, axis=1)
    wide = np.concatenate([split, common], axis=1)
    inverse = np.linalg.pinv(wide.T @ wide, rcond=1e-12)
    step = -inverse @ (wide.T @ residuals)
    left = residuals + wide @ step
    scores = np.array([wide[groups == g].T @ left[groups == g] for g in np.unique(groups)])
    count = len(scores)
    covariance = count / max(count - 1, 1) * inverse @ (scores.T @ scores) @ inverse
    for run in np.unique(fitter.runs):
        own_rows = fitter.runs == run
        moved = inverse @ (wide[own_rows].T @ (jacobian[own_rows] * change))
        covariance += moved @ moved.T
    k = levels.size
    values = fit.solution.x[column] + step[:k]
    spread = covariance[:k, :k] + np.diag(np.full(k, (_SAME * fit.solution.x[column]) ** 2))
    contrast = np.eye(k)[1:] - np.eye(k)[:1]
    difference = contrast @ values
    statistic = float(difference @ np.linalg.pinv(contrast @ spread @ contrast.T) @ difference)
    blocks = min(np.unique(groups[level == one]).size for one in levels)
    p = float(stats.f.sf(statistic / (k - 1), k - 1, max(blocks - 1, 1)))
    at = [np.insert(np.delete(fit.solution.x, column) + step[k:], column, v) for v in values]
    models = [fit.space.model(np.clip(x, *fit.space.bounds())) for x in at]
    return Invariance(p, dict(zip(levels.tolist(), models, strict=True)))


def where_it_acts(
    fitter: CellFitter, fit: CellFit, without: CellFit, parts: Sequence[int]
) -> np.ndarray:
    """Return how many standard deviations of noise a cause moves each cell, (cells,)."""
    evidence = fitter.evidence
    errors = evidence.errors([fit.model, without.model], parts)
    moved = evidence.mean_squares(errors[1] - errors[0], parts)
    return np.sqrt(moved / evidence.floor(parts))
