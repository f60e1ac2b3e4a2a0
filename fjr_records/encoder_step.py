"""The step of a coarse encoder, which the recorded positions show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_LEAST = 1e-9  # rad; finer steps are the storage's
_OFF_GRID = 1e-3  # of a step
_FEWEST = 20  # steps between different values


def position_step(positions: Sequence[np.ndarray]) -> float | None:
    """Return the step of which all differences of positions are multiples; None without one.

    Args:
        positions: y of each run, float64 of any shape, rad; zero may lie anywhere.

    Returns:
        the step (rad).
    """
    values = np.unique(np.concatenate([np.unique(position) for position in positions]))
    gaps = np.diff(values)
    gaps = gaps[gaps > _LEAST]
    if gaps.size < _FEWEST:
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    counts = (values - values[0]) / step
    return step if np.abs(counts - np.rint(counts)).max() < _OFF_GRID else None
