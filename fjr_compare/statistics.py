"""Tests of differences: complex estimates with estimated variance, and many tests at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import digamma
from scipy.stats import chi2

_MISSED = 0.05  # probability that a disc does not cover the truth
_MOST_DEGREES = 1e6
_HALVINGS = 60


def degrees_of(radius: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Return the complex degrees of freedom of variances, from the discs that rest on them.

    Inverts radius^2 = variance n (0.05^(-1/n) - 1), which falls with n.

    Args:
        radius: (F,), radii of the discs, which cover the truth with a probability of 95 %.
        variance: (F,), variances.
    """
    ratio = np.square(radius) / variance
    low, high = np.full(ratio.shape, np.log(0.3)), np.full(ratio.shape, np.log(_MOST_DEGREES))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        n = np.exp(middle)
        above = n * np.expm1(-np.log(_MISSED) / n) > ratio
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.exp(0.5 * (low + high))


def welch(
    variances: tuple[np.ndarray, np.ndarray], degrees: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return the degrees of freedom of sums of two estimated variances (Welch, Satterthwaite).

    Of few degrees the ratio of two variances is too rough for that, line by line: too many false
    alarms. So the ratio is the geometric mean over the lines, less what chance does to logarithms.

    Args:
        variances: (F,) each.
        degrees: complex degrees of freedom of each, (F,).
    """
    bias = [digamma(n) - np.log(n) for n in degrees]
    logs = [np.log(v) - b for v, b in zip(variances, bias, strict=True)]
    ratio = float(np.exp(np.mean(logs[0] - logs[1])))
    return np.asarray((ratio + 1.0) ** 2 / (ratio**2 / degrees[0] + 1.0 / degrees[1]))


def complex_p(difference: np.ndarray, variance: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Return how often chance alone gives complex differences so great.

    |difference|^2 over the estimated variance follows F(2, 2n): p = (1 + t/n)^-n.

    Args:
        difference: complex (F,).
        variance: (F,), estimate of E|difference|^2.
        degrees: n, its complex degrees of freedom.
    """
    t = np.abs(difference) ** 2 / variance
    return np.exp(-degrees * np.log1p(t / degrees))


def fisher(p: np.ndarray) -> float:
    """Return the p-value of independent tests together (Fisher 1925)."""
    least = np.finfo(float).tiny
    return float(chi2.sf(-2.0 * np.log(np.maximum(p, least)).sum(), 2 * p.size))


def holm(p: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return p-values corrected so that one false alarm among all is as rare as one p-value says.

    By Holm 1979, whatever the tests have to do with one another.
    """
    values = np.asarray(p, float)
    order = np.argsort(values)
    steps = (values.size - np.arange(values.size)) * values[order]
    adjusted = np.empty(values.size)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted
