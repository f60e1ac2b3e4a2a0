"""Bounded nonlinear least squares by Levenberg-Marquardt, with residuals evaluated in batches.

All finite differences of a Jacobian are one batch, so that a simulator can run them in parallel, by
one call; scipy's `least_squares` calls the simulator once for each point (from version 1.16 on it
makes these calls in parallel for the points of a Jacobian). Between fresh Jacobians Broyden's
rank-one update follows what the steps show (Nocedal, Wright 2006, ch. 11); a fit is called
converged only if it ended with a fresh Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Residuals = Callable[[np.ndarray], np.ndarray]
"""Takes points (n, parameters), returns error vectors (n, errors)."""

_STEP = 1e-6  # a loop near its stability margin bends within 1e-4 already
_CENTRAL_STEP = 1e-4  # of central differences, in which such a bend cancels
_DAMPINGS = np.array([1.0, 1e2])  # tried one after the other, times the present damping
_LEAST_DAMPING, _MOST_DAMPING = 1e-7, 1e6
_FRESH_DAMPING, _MUCH_DAMPING = 1.0, 1e2  # first tried with a fresh Jacobian; small steps beyond
_SMALL_GAIN = 1e-3
_PROMISED = 0.05  # of the cost: what a linear model may still promise where a fit has converged
_GOOD, _POOR = 0.7, 0.3  # gain over the gain that the linear model promises
_PATIENCE, _STILL_FALLING = 3, 0.8
_MOST_UPDATES = 4  # of one Jacobian


@dataclass(frozen=True)
class Solution:
    """Where a fit ended.

    Attributes:
        x: parameters in units of their scale, float64 (parameters,).
        cost: sum of squares there.
        jacobian: float64 (errors, parameters).
        residuals: float64 (errors,).
        converged: two steps after each other, the last with a fresh Jacobian, gained next to
            nothing, or no step gains anything.
    """

    x: np.ndarray
    cost: float
    jacobian: np.ndarray
    residuals: np.ndarray
    converged: bool


def solve(
    residuals: Residuals,
    start: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    *,
    most_steps: int = 25,
    give_up_above: float | None = None,
    known: np.ndarray | None = None,
) -> Solution:
    """Minimise the sum of squares within bounds.

    Args:
        residuals: evaluates a batch of points.
        start: starting point; parameters are scaled so that 1 is a large change.
        low: lower bounds.
        high: upper bounds.
        most_steps: how many accepted steps at the most.
        give_up_above: stop, not converged, if after 3 steps the cost is still above this and a step
            with a fresh Jacobian gains less than a fifth.
        known: columns of a Jacobian near the start, of the first parameters, (errors, <= all).

    Returns:
        the best point found, never worse than the start.
    """
    search = _Search(residuals, np.clip(start, low, high), low, high, known)
    for _ in range(most_steps):
        before = search.cost
        if not search.step():
            break
        hopeless = give_up_above is not None and search.cost > give_up_above
        if hopeless and search.steps > _PATIENCE and search.cost > _STILL_FALLING * before:
            if search.fresh:
                break
            search.renew()
    return Solution(search.x, search.cost, search.jacobian, search.r, search.converged)


def central_differences(
    residuals: Residuals, x: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Return the Jacobian at a point, float64 (errors, parameters), from both sides within bounds.

    That of a search was updated from step to step: it tells the way down, but hides what two
    parameters do alike.

    Args:
        residuals: evaluates a batch of points.
        x: the point.
        low: lower bounds.
        high: upper bounds.
    """
    size = np.diag(_CENTRAL_STEP * np.maximum(np.abs(x), 1.0))
    free = np.flatnonzero(low < high)
    sides = [np.clip(x + sign * size, low, high)[free] for sign in (1.0, -1.0)]
    errors = residuals(np.concatenate(sides))
    apart = np.sum(sides[0] - sides[1], axis=1)
    jacobian = np.zeros((errors.shape[1], x.size))
    jacobian[:, free] = ((errors[: free.size] - errors[free.size :]) / apart[:, None]).T
    return jacobian


def _cost(errors: np.ndarray) -> float:
    """Return a sum of squares.

    All costs are summed in the same order, so that a trial which stays where it is (all its
    parameters held by their bounds) never costs less than the point itself by rounding.
    """
    return float(errors @ errors)


class _Search:
    """The state of one minimisation."""

    def __init__(
        self,
        residuals: Residuals,
        x: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        known: np.ndarray | None,
    ) -> None:
        self._residuals, self.x, self._low, self._high = residuals, x, low, high
        self.r = residuals(x[None])[0]
        self.cost, self.steps = _cost(self.r), 0
        self.converged = False
        self.jacobian = np.zeros((self.r.size, x.size))
        self._known = known
        self._updates: int | None = None  # of the present Jacobian; None: a fresh one is due
        self._damping, self._small = 1e-2, 0
        self.fresh = False

    def renew(self) -> None:
        """Take a fresh Jacobian before the next step."""
        self._updates = None

    def step(self) -> bool:
        """Take one accepted step; return whether to go on."""
        while True:
            if self._updates is None or self._updates > _MOST_UPDATES:
                self._differentiate()
            for damping in self._damping * _DAMPINGS:
                trial = self._trial(damping)
                errors = self._residuals(trial[None])[0]
                if _cost(errors) < self.cost:
                    self._accept(trial, errors, float(damping))
                    return not self.converged
            if self._updates:
                self._updates = None
            elif self._damping >= (_MUCH_DAMPING if self._small else _MOST_DAMPING):
                self.converged = True
                return False
            else:
                self._damping *= 1e4

    def _accept(self, x: np.ndarray, r: np.ndarray, damping: float) -> None:
        change = x - self.x
        linear = self.r + self.jacobian @ change
        promised = self.cost - float(linear @ linear)
        cost = _cost(r)
        gained = self.cost - cost
        self.fresh = fresh = self._updates == 0
        self._small = self._small + 1 if gained < _SMALL_GAIN * self.cost else 0
        self.converged = self._small >= 2 and fresh and not self._promises()
        ratio = gained / promised if promised > 0.0 else 0.0
        factor = 0.1 if ratio > _GOOD else 1.0 if ratio > _POOR else 10.0
        self._damping = float(np.clip(factor * damping, _LEAST_DAMPING, _MOST_DAMPING))
        if not self.converged:
            self.jacobian = self.jacobian + np.outer(r - linear, change / (change @ change))
            stale = self._small or (ratio < _POOR and not fresh)
            self._updates = None if stale else (self._updates or 0) + 1
        self.x, self.r, self.cost = x, r, cost
        self.steps += 1

    def _promises(self) -> bool:
        """Tell whether a step without damping would gain much, were the errors linear.

        Along a valley that bends, steps are short and each gains next to nothing.
        """
        linear = self.r + self.jacobian @ (self._trial(_LEAST_DAMPING) - self.x)
        return self.cost - float(linear @ linear) > _PROMISED * self.cost

    def _differentiate(self) -> None:
        """Take one-sided finite differences, stepping away from a bound; known columns are free.

        What may not move has none.
        """
        known, self._known = self._known, None
        first = 0 if known is None else known.shape[1]
        size = _STEP * np.maximum(np.abs(self.x), 1.0)
        steps = np.where(self.x + size <= self._high, size, -size)
        self._damping = min(self._damping, _FRESH_DAMPING)
        self._updates = 0 if known is None else 1
        if known is not None:
            self.jacobian[:, :first] = known
        asked = first + np.flatnonzero((self._low < self._high)[first:])
        if asked.size:
            points = (self.x + np.diag(steps))[asked]
            columns = (self._residuals(points) - self.r) / steps[asked, None]
            self.jacobian[:, asked] = columns.T

    def _trial(self, damping: float) -> np.ndarray:
        """Return the damped Gauss-Newton point; what would leave its bounds is held."""
        free = np.ones(self.x.size, bool)
        gradient = self.jacobian.T @ self.r
        step = np.zeros(self.x.size)
        for _ in range(self.x.size):
            step = np.zeros(self.x.size)
            j = self.jacobian[:, free]
            normal = j.T @ j
            scale = np.diag(normal).copy()
            scale[scale == 0.0] = 1.0
            step[free] = np.linalg.solve(normal + damping * np.diag(scale), -gradient[free])
            blocked = free & (
                ((self.x <= self._low) & (step < 0.0)) | ((self.x >= self._high) & (step > 0.0))
            )
            if not blocked.any():
                break
            free &= ~blocked
            if not free.any():
                return self.x
        return np.clip(self.x + step, self._low, self._high)
