"""Intervals by resampling whole realizations: no assumption on how lines correlate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

RESAMPLES = 400


def resampled(
    count: int, estimate: Callable[[np.ndarray], float], resamples: int = RESAMPLES, seed: int = 0
) -> np.ndarray:
    """Return the estimates of resampled realizations, float64 of shape (resamples,).

    Args:
        count: M, number of realizations.
        estimate: indices of realizations, int (M,), to an estimate.
        resamples: number of resamples.
        seed: seed of the draws.
    """
    rng = np.random.default_rng(seed)
    return np.array([estimate(rng.integers(0, count, count)) for _ in range(resamples)])


def interval(values: np.ndarray, level: float = 0.95) -> tuple[float, float]:
    """Return the percentile interval of finite values; NaN twice if there are none."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return float("nan"), float("nan")
    low, high = np.quantile(finite, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    return float(low), float(high)
