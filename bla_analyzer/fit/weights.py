"""The covariance that weighs each line: what its neighbours tell, smooth over frequency."""

from __future__ import annotations

import numpy as np
from scipy.special import digamma

ENOUGH_DEGREES = 24
"""Complex degrees of freedom that the covariance behind a weight should have. Weights of few would
cost precision: the variance of the estimate grows by (n - 1)/(n - 2) (Pintelon and Schoukens,
System Identification, 2nd ed. 2012, ch. 10)."""
FEWEST, MOST = 6, 14
"""Neighbours that tell a weight."""
MOST_CORRELATED = 0.999


def neighbours_covariance(
    frequency_hz: np.ndarray, g: np.ndarray, covariance: np.ndarray, degrees: np.ndarray
) -> np.ndarray:
    """Return the covariance at each line as its neighbours tell it, complex (F, O, O).

    Logarithms of variances follow a straight line over the logarithm of frequency; what is smooth
    is the variance itself, as of encoder noise, or that relative to |G|^2, as of disturbances that
    pass through the plant: the smoother of both is taken. Where neither is, the weight is not the
    best, but estimate and intervals stay right: intervals use each line's own covariance, of which
    its weight must be independent, so the line itself is left out.

    Args:
        frequency_hz: (F,).
        g: complex (F, O).
        covariance: complex (F, O, O), as estimated at each line.
        degrees: (F,), its complex degrees of freedom.
    """
    lines, outputs = g.shape
    count = int(np.clip(np.ceil(ENOUGH_DEGREES / degrees[0]), FEWEST, MOST))
    reach = _reach(frequency_hz, min(count + count % 2, lines - 1))
    bias = np.log(degrees) - digamma(degrees)
    variances = np.stack(
        [_smooth(covariance[:, o, o].real, g[:, o], reach, bias) for o in range(outputs)], axis=1
    )
    smooth = np.zeros_like(covariance)
    smooth[:, range(outputs), range(outputs)] = variances
    if outputs == 2:
        turn = g[:, 1] * np.conj(g[:, 0])
        turn = turn / np.abs(turn)
        size = np.sqrt(variances[:, 0] * variances[:, 1])
        weight = (reach != 0.0).astype(float)
        cross = weight @ (covariance[:, 1, 0] / turn / size)
        powers = [weight @ (covariance[:, o, o].real / variances[:, o]) for o in (0, 1)]
        mean = cross / np.sqrt(powers[0] * powers[1])
        mean /= np.maximum(np.abs(mean) / MOST_CORRELATED, 1.0)
        smooth[:, 1, 0] = mean * turn * size
        smooth[:, 0, 1] = np.conj(smooth[:, 1, 0])
    return smooth


def _reach(frequency_hz: np.ndarray, count: int) -> np.ndarray:
    """Return the weights by which neighbours tell the value of a straight line, (F, F)."""
    lines, x = frequency_hz.size, np.log(frequency_hz)
    weights = np.zeros((lines, lines))
    for i in range(lines):
        start = int(np.clip(i - count // 2, 0, lines - count - 1))
        near = np.delete(np.arange(start, start + count + 1), i - start)
        terms = np.stack([np.ones(count), x[near] - x[i]], axis=1)
        weights[i, near] = np.linalg.pinv(terms)[0]
    return weights


def _smooth(variance: np.ndarray, g: np.ndarray, reach: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Return a variance as its neighbours tell it, (F,)."""
    found = []
    for shape in (np.abs(g) ** 2, np.ones(g.size)):
        logs = np.log(variance / shape) + bias
        told = reach @ logs
        found.append((float(np.mean((logs - told) ** 2)), np.exp(told) * shape))
    return min(found, key=lambda one: one[0])[1]
