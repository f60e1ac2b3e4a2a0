"""Does the rig change from bag to bag, and if so along a trend or by chance?

How far each parameter deviates in each bag is in `bag_deviations`. Deviations that only scatter are
a property of the rig: their size is told. A trend along the record is a drift, which no
time-invariant model explains.

Scatter: the standard deviation of a random-effects model, level means free, by Paule and Mandel
(1982, J. Res. NBS 87) with the interval of Viechtbauer (2007, Statistics in Medicine 26). Trend,
against that scatter and not against the noise: the slope in time within levels by Student's t; and,
where the deviations account for what the model leaves, Kendall's tau over all bags (Mann 1945).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from ..model.rig_model import Model
from .bag_deviations import BagBlocks, BagErrors, deviations

TREND_FALSE_ALARM = 0.005
"""Share of rigs without a trend that one test of one group takes for drifting: of two groups under
two tests at most 2 %."""
ACCOUNTED = 0.9
"""Share of what the model leaves that the deviations must account for before levels are compared;
below, a wrong law may deviate from level to level."""
SEEN = 2.0
"""Standard deviations from which a level counts as one that shows a slope."""
_CERTAINTY = 0.95
_GREATEST = 1e6  # relative scatter beyond which no interval is sought


@dataclass(frozen=True)
class Trend:
    """How one group of parameters changes along the record.

    Attributes:
        group: friction or stiffness.
        deviation: (realizations,), relative deviation of the group in each bag from the model, the
            mean over its parameters.
        std: (realizations,), its standard deviation, widened by what the bag's fit leaves.
        slope_per_s: relative change per second of the record, as bags differ within levels.
        p_value: the smaller one of the tests: how often scatter alone shows such a trend.
    """

    group: str
    deviation: np.ndarray
    std: np.ndarray
    slope_per_s: float
    p_value: float


@dataclass(frozen=True)
class Scatter:
    """How far a parameter scatters from bag to bag.

    Attributes:
        parameter: one of `SCATTERING`.
        value: standard deviation relative to the parameter.
        low, high: its 95 % interval.
    """

    parameter: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class BagChanges:
    """What changes from bag to bag.

    Attributes:
        trends: of friction and stiffness.
        scatters: of each parameter.
        accounted: share of the misfit that the deviations of all parameters account for.
    """

    trends: tuple[Trend, ...]
    scatters: tuple[Scatter, ...]
    accounted: float


def bag_changes(
    errors: BagErrors,
    levels: np.ndarray,
    elapsed_s: np.ndarray | None,
    model: Model,
    blocks: BagBlocks | None = None,
) -> BagChanges | None:
    """Compare the bags of each level, given a refit model.

    None where a slope within levels leaves no degree of freedom (two levels of two bags leave one),
    the model diverges, or a bag does not determine all of its parameters.

    Args:
        errors: of models in a bag.
        levels: (bags,), the level of each.
        elapsed_s: (bags,), when each began; None if that is not known, and then no trend is sought.
        model: the refit model.
        blocks: see `deviations`.
    """
    if levels.size - np.unique(levels).size < 2:
        return None
    found = deviations(errors, levels.size, model, blocks)
    if found is None:
        return None
    across = found.accounted >= ACCOUNTED
    trends = (
        ()
        if elapsed_s is None
        else (_trend(*column, levels, elapsed_s, across) for column in found.groups())
    )
    return BagChanges(
        tuple(trends), tuple(_scatter(*column, levels) for column in found.each()), found.accounted
    )


def _regression(
    values: np.ndarray, std: np.ndarray, design: np.ndarray, scatter: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return coefficients, their covariance and the weighted sum of squares that they leave."""
    weight = 1.0 / np.hypot(std, scatter)
    weighted = design * weight[:, None]
    found = np.linalg.lstsq(weighted, values * weight, rcond=None)[0]
    left = values * weight - weighted @ found
    return found, np.linalg.inv(weighted.T @ weighted), float(left @ left)


def _scatter_leaving(
    target: float, values: np.ndarray, std: np.ndarray, design: np.ndarray
) -> float:
    """Return the scatter with which the weighted sum of squares is `target`; 0 if it is below."""

    def excess(scatter: float) -> float:
        return _regression(values, std, design, scatter)[2] - target

    if excess(0.0) <= 0.0:
        return 0.0
    high = float(std.max())
    while excess(high) > 0.0 and high < _GREATEST:
        high *= 4.0
    return float(optimize.brentq(excess, 0.0, high)) if high < _GREATEST else high


def _level_means(levels: np.ndarray) -> np.ndarray:
    """Return one column for each level, 1 in its bags."""
    return (levels[:, None] == np.unique(levels)).astype(float)


def _scatter(name: str, deviation: np.ndarray, std: np.ndarray, levels: np.ndarray) -> Scatter:
    design = _level_means(levels)
    degrees = levels.size - design.shape[1]
    tail = 0.5 * (1.0 - _CERTAINTY)
    targets = degrees, stats.chi2.isf(tail, degrees), stats.chi2.ppf(tail, degrees)
    return Scatter(name, *(_scatter_leaving(t, deviation, std, design) for t in targets))


def _trend(
    group: str,
    deviation: np.ndarray,
    std: np.ndarray,
    levels: np.ndarray,
    elapsed_s: np.ndarray,
    across: bool,
) -> Trend:
    """Test a group for a trend; `across`: also from level to level."""
    design = np.column_stack([_level_means(levels), elapsed_s])
    degrees = levels.size - design.shape[1]
    scatter = _scatter_leaving(degrees, deviation, std, design)
    found, covariance, _ = _regression(deviation, std, design, scatter)
    p = 2.0 * stats.t.sf(abs(found[-1]) / np.sqrt(covariance[-1, -1]), degrees)
    if not levels_agree(deviation, np.hypot(std, scatter), levels, elapsed_s):
        p = 1.0
    if across:
        p = min(p, stats.kendalltau(elapsed_s, deviation).pvalue)
    return Trend(group, deviation, std, float(found[-1]), float(p))


def levels_agree(
    deviation: np.ndarray, std: np.ndarray, levels: np.ndarray, elapsed_s: np.ndarray
) -> bool:
    """Tell whether two levels, or the only one, show a slope of the same sign.

    What a wrong law leaves is of another size at each level: one level may not decide alone.
    """
    members = [np.flatnonzero(levels == level) for level in np.unique(levels)]
    members = [at for at in members if at.size > 1]
    signs = []
    for at in members:
        line = np.column_stack([np.ones(at.size), elapsed_s[at]])
        found, covariance, _ = _regression(deviation[at], std[at], line, 0.0)
        if abs(found[1]) > SEEN * np.sqrt(covariance[1, 1]):
            signs.append(found[1] > 0.0)
    return max(signs.count(True), signs.count(False)) >= min(len(members), 2)
