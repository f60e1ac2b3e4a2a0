"""Physical models by maximum likelihood, from several starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fjr_kit.errors import InputError

from .likelihood import Task, refined
from .physical import Physical, Scaled, polynomials, starts
from .sampled import Sampled

STARTS = 3
TRIED, MOST = 15, 150
"""Evaluations of each start, and of the best of them."""
STEP = 1e-6
"""Of the moved parameters, for central differences."""


@dataclass(frozen=True)
class PhysicalModel:
    """A physical model as it is seen.

    Attributes:
        kind: rigid, two-inertia or extra-mode.
        sampled: how it is seen.
        scaled: which parameters are free, as the fit moves them.
        values: (p,), the moved parameters.
        fixed: parameters that are not fitted: the delay, in s.
        outputs: how many outputs are seen, 1 or 2.
    """

    kind: Physical
    sampled: Sampled
    scaled: Scaled
    values: np.ndarray
    fixed: Mapping[str, float]
    outputs: int

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters by the simulator's names, SI units, and `delay_s`."""
        return self.scaled.parameters(self.values, self.fixed)

    def with_values(self, values: np.ndarray) -> PhysicalModel:
        """Return the model with other parameters."""
        return PhysicalModel(self.kind, self.sampled, self.scaled, values, self.fixed, self.outputs)

    @property
    def delay_s(self) -> float:
        """The delay."""
        return self.parameters["delay_s"]

    def seen(self) -> np.ndarray:
        """Return G, complex (F, O)."""
        upper, lower = polynomials(self.kind, self.parameters)
        s = self.sampled.s
        weight = self.sampled.delayed(self.delay_s) / np.polyval(lower, s)
        return np.stack(
            [(weight * np.polyval(each, s)).sum(axis=1) for each in upper[: self.outputs]], axis=1
        )

    def response(self) -> tuple[np.ndarray, np.ndarray]:
        """Return G, complex (F, O), and its Jacobian by the moved parameters, (F, O, p).

        The coefficients of the polynomials are differentiated by central differences, all else
        exactly.
        """
        s = self.sampled.s
        upper, lower = self._coefficients(self.values)
        powers = s[:, :, None] ** np.arange(lower.size - 1, -1, -1)
        below = 1.0 / (powers @ lower)
        weight = self.sampled.delayed(self.delay_s) * below
        by_upper = np.einsum("fm,fmc->fc", weight, powers)
        steps = STEP * np.eye(self.values.size)
        ahead, behind = (
            [self._coefficients(self.values + sign * step) for step in steps] for sign in (1, -1)
        )
        g = np.empty((s.shape[0], self.outputs), complex)
        jacobian = np.empty((*g.shape, self.values.size), complex)
        slope_lower = np.stack([a[1] - b[1] for a, b in zip(ahead, behind, strict=True)], axis=1)
        for o in range(self.outputs):
            every = weight * (powers @ upper[o])
            g[:, o] = every.sum(axis=1)
            by_lower = np.einsum("fm,fmc->fc", every * below, powers)
            slope = np.stack([a[0][o] - b[0][o] for a, b in zip(ahead, behind, strict=True)], 1)
            jacobian[:, o] = (by_upper @ slope - by_lower @ slope_lower) / (2.0 * STEP)
            if "delay_s" in self.scaled.names:
                jacobian[:, o, -1] = -(s * every).sum(axis=1) * self.scaled.scales[-1]
        return g, jacobian

    def _coefficients(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return numerators (O, n) and denominator (n,), highest power first."""
        upper, lower = polynomials(self.kind, self.scaled.parameters(values, self.fixed))
        padded = [np.pad(each, (lower.size - each.size, 0)) for each in upper[: self.outputs]]
        return np.array(padded), lower


def fit_physical(task: Task, kind: Physical) -> PhysicalModel:
    """Fit a physical model.

    Raises:
        InputError: the BLA is that of no such joint.
    """
    found = None
    if kind == "extra-mode":
        found = fit_physical(task, "two-inertia").parameters
        task = replace(task, delay_s=found["delay_s"])
    samples, sampled, delay = task.samples, task.sampled, {"delay_s": task.delay_s}
    w = 2.0 * np.pi * float(np.sqrt(samples.frequency_hz[0] * samples.frequency_hz[-1]))
    best, least = None, np.inf
    for start in starts(kind, samples.frequency_hz, task.data, found)[:STARTS]:
        begin = {**start, **delay}
        scaled = Scaled.of(kind, begin, w, sampled.rate_hz, task.free_delay)
        fixed = {} if task.free_delay else delay
        model = PhysicalModel(kind, sampled, scaled, scaled.values(begin), fixed, samples.outputs)
        model = refined(samples, model, TRIED)
        cost = samples.cost(model.seen())
        if cost < least:
            best, least = model, cost
    if best is None:
        raise InputError(f"The {kind} model comes near no line of this BLA; fit another model.")
    return refined(samples, best, MOST)
