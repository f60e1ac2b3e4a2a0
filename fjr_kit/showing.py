"""What a refit of the bare parameters leaves of a change, and how large an effect must be to show.

The change that an effect makes is projected off the slopes of the bare parameters. A large effect
may bend the parameters so far that slopes at the nominal ones mislead: then the refit is carried
out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

_REFIT_STEPS = 5
_FARTHEST = 1.5  # factor on a parameter in one step


class BareRefit:
    """Takes over of a change what the bare parameters can.

    Attributes:
        plant: their values.
        names: which of them are free.
        slopes: change by each, per relative change of the parameter, float64 (equations, names).
    """

    def __init__(
        self, plant: Mapping[str, float], names: Sequence[str], slopes: np.ndarray
    ) -> None:
        """Take the slopes of the bare plant."""
        self.plant, self.names, self.slopes = dict(plant), tuple(names), slopes
        self._basis = np.linalg.qr(slopes)[0]

    def left(self, change: np.ndarray) -> np.ndarray:
        """Return what a refit leaves of a small change, (equations,)."""
        return change - self._basis @ (self._basis.T @ change)

    def left_by_refit(
        self,
        change_from: Callable[[Mapping[str, float]], np.ndarray],
        size: Callable[[np.ndarray], float],
    ) -> np.ndarray:
        """Return what a refit leaves of a change, carried out by Gauss-Newton steps, (equations,).

        Args:
            change_from: returns the change from a bare plant to the target, (equations,).
            size: of a change; the refit ends where it falls no more.
        """
        plant, best = dict(self.plant), None
        for _ in range(_REFIT_STEPS):
            change = change_from(plant)
            if best is not None and size(change) >= size(best):
                break
            best = change
            steps = np.linalg.lstsq(self.slopes, change, rcond=None)[0]
            for name, step in zip(self.names, steps.tolist(), strict=True):
                plant[name] *= min(max(1.0 + step, 1.0 / _FARTHEST), _FARTHEST)
        assert best is not None
        return self.left(best)


def size_showing(
    shown: Callable[[float], float], wanted: float, start: float, most: float
) -> float | None:
    """Return the size at which `shown` is as wanted, within a tenth; None if none up to `most` is.

    Secant search on the logarithm; a size at which the motion diverges shows too much.
    """
    low, high = most * 1e-5, most
    if shown(high) < wanted:
        return None
    size = min(start, 0.9 * high)
    for _ in range(12):
        ratio = shown(size) / wanted
        if abs(ratio - 1.0) < 0.1:
            break
        low, high = (size, high) if ratio < 1.0 else (low, size)
        guess = size / ratio if 0.0 < ratio < math.inf else 0.0
        size = guess if low * 1.05 < guess < high / 1.05 else math.sqrt(low * high)
    return size
