"""The step of a coarse encoder, which the recorded positions show."""

from __future__ import annotations

import numpy as np

from .periodic import RecordedExperiment

_LEAST = 1e-9  # rad; finer steps are the storage's
_OFF_GRID = 1e-3  # of a step
_FEWEST = 20  # steps between different values


def position_step(recorded: RecordedExperiment) -> float | None:
    """Return the step of which all recorded positions are multiples (rad); None without one."""
    values = np.unique(np.concatenate([np.unique(r.position) for r in recorded.realizations]))
    gaps = np.diff(values)
    gaps = gaps[gaps > _LEAST]
    if gaps.size < _FEWEST:
        return None
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    counts = values / step
    return step if np.abs(counts - np.rint(counts)).max() < _OFF_GRID else None
