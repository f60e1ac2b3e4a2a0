"""The inertia of one run, seen in the torque that a model lacks along it.

Friction, load and inertia are solved for at once, for friction differs from run to run as a rule.
What is left of torque and acceleration beyond friction and load tells the inertia.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

_STRETCHES = 8  # of a run, each of which is left out once
_PLACES = 10  # for each size that is solved for
_SHOWN = 0.1  # of a constant torque: what no friction or load stands for
_NOTHING = 1e-300


@dataclass(frozen=True)
class SeenInertia:
    """What a run shows of the inertia of a rigid axis, at the places where friction slides.

    Attributes:
        inertia: of the model, kg m2.
        torque: recorded, (places,), N m.
        missing: torque that the model lacks, (places,), N m.
        moves: acceleration as the torque is seen, (places,), rad/s2.
        beside: loads and frictions of a size of one, as seen, (sizes, places), N m; the first one a
            constant torque.
        swung: the same of a mass of one behind a spring, of a frequency (rad/s) and a damping
            ratio, (places,).
    """

    inertia: float
    torque: np.ndarray
    missing: np.ndarray
    moves: np.ndarray
    beside: np.ndarray
    swung: Callable[[float, float], np.ndarray]

    @property
    def enough(self) -> bool:
        """Whether there are enough places to solve for all sizes."""
        return self.missing.size > _PLACES * (len(self.beside) + 1)

    @property
    def value(self) -> float:
        """The inertia, kg m2."""
        return self.inertia + _slope(*self._left)

    @property
    def error(self) -> float:
        """Its standard error by leaving out single stretches (jackknife), kg m2."""
        stretch = np.arange(self.missing.size) * _STRETCHES // self.missing.size
        kept = [self._beyond(stretch != k) for k in range(_STRETCHES)]
        values = [_slope(moves, missing) for moves, missing in kept]
        return float(np.sqrt(_STRETCHES - 1.0) * np.std(values))

    @property
    def share(self) -> float:
        """Share of the torque that accelerates the inertia, rms."""
        return float(self.value * np.std(self.moves) / (np.std(self.torque) + _NOTHING))

    @property
    def load(self) -> tuple[float, float, float]:
        """The constant torque that the run needs more than the model has, and what tells it, N m.

        Returns:
            That torque; its standard error by leaving out single stretches (jackknife); and how far
            it must be off to double the squares that are left with it. All NaN where it looks like
            all else together, as in a run in one direction.
        """
        stretch = np.arange(self.missing.size) * _STRETCHES // self.missing.size
        every = np.ones(self.missing.size, bool)
        values = [self._load(stretch != k)[0] for k in range(_STRETCHES)]
        value, weight, left = self._load(every)
        error = float(np.sqrt(_STRETCHES - 1.0) * np.std(values))
        return value, error, float(np.sqrt(left / (weight + _NOTHING)))

    def _load(self, rows: np.ndarray) -> tuple[float, float, float]:
        """Return the load of some places, the square of what shows it, and the squares left."""
        constant, others = self.beside[0, rows], self.beside[1:, rows]
        basis = _basis(np.concatenate([others, self.moves[None, rows]]))
        missing = -self.missing[rows]
        alone, left = (x - basis @ (basis.T @ x) for x in (constant, missing))
        weight = float(alone @ alone)
        if weight < _SHOWN**2 * float(constant @ constant):
            return math.nan, math.nan, math.nan
        value = _slope(alone, left)
        return value, weight, float(np.sum((left - value * alone) ** 2))

    @cached_property
    def _left(self) -> tuple[np.ndarray, np.ndarray]:
        return self._beyond(np.ones(self.missing.size, bool))

    def _beyond(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return acceleration and missing torque without what friction and load explain."""
        basis = _basis(self.beside[:, rows])
        moves, missing = self.moves[rows], -self.missing[rows]
        return moves - basis @ (basis.T @ moves), missing - basis @ (basis.T @ missing)

    def against(self, frequency: float, damping: float) -> np.ndarray:
        """Return products of acceleration, mass behind a spring and missing torque, (3, 3).

        Each without what friction and load explain, in units of what an inertia of the run's own
        leaves: they add up over runs.
        """
        basis = _basis(self.beside)
        swung = -self.swung(frequency, damping)
        moves, missing = self._left
        left = missing - _slope(moves, missing) * moves
        three = np.array([moves, swung - basis @ (basis.T @ swung), missing])
        return np.asarray(three @ three.T) / (float(np.mean(left**2)) + _NOTHING)


def _basis(columns: np.ndarray) -> np.ndarray:
    """Return an orthonormal basis of columns, (places, sizes), of which some may be alike."""
    scaled = columns / (np.linalg.norm(columns, axis=1)[:, None] + _NOTHING)
    left, sizes, _ = np.linalg.svd(scaled.T, full_matrices=False)
    return np.asarray(left[:, sizes > 1e-7 * sizes[0]])


def _slope(moves: np.ndarray, missing: np.ndarray) -> float:
    return float(moves @ missing / (moves @ moves + _NOTHING))
