"""Fits within a box by covariance matrix adaptation, CMA-ES (Hansen 2016, arXiv 1604.00772)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

_FIRST_STEP = 0.1  # of the box
_TOLERANCE = 1e-4  # of the box, and of the cost
_SEED = 1  # of the random numbers


@dataclass(frozen=True)
class Free:
    """A parameter that a fit may change.

    Attributes:
        start: where it begins.
        low, high: its range.
    """

    start: float
    low: float
    high: float


def factor_of(value: float, factor: float) -> Free:
    """Return a parameter that may be smaller or greater than a value by a factor."""
    return Free(value, value / factor, value * factor)


def cma_fit(
    cost: Callable[[Mapping[str, float]], float],
    free: Mapping[str, Free],
    seconds: float,
) -> tuple[dict[str, float], float]:
    """Return the values of least cost and that cost.

    Args:
        cost: of values by name; not finite where nothing can be said.
        free: what may change, by name.
        seconds: after which no further generation is begun.
    """
    import cma

    names: Sequence[str] = list(free)
    low = np.array([free[name].low for name in names])
    width = np.array([free[name].high for name in names]) - low
    start = np.clip((np.array([free[name].start for name in names]) - low) / width, 0.0, 1.0)

    def values(point: np.ndarray) -> dict[str, float]:
        return dict(zip(names, (low + width * point).tolist(), strict=True))

    best, least = values(start), cost(values(start))
    scale = least if math.isfinite(least) and least > 0.0 else 1.0
    strategy = cma.CMAEvolutionStrategy(
        start.tolist(),
        _FIRST_STEP,
        {
            "bounds": [0.0, 1.0],
            "seed": _SEED,
            "verbose": -9,
            "tolx": _TOLERANCE,
            "tolfun": _TOLERANCE,
        },
    )
    until = time.process_time() + seconds
    while not strategy.stop() and time.process_time() < until:
        points = strategy.ask()
        costs = []
        for point in points:
            own = cost(values(np.asarray(point)))
            costs.append(own / scale if math.isfinite(own) else 1e6)
            if own < least:
                best, least = values(np.asarray(point)), own
        strategy.tell(points, costs)
    return best, least
