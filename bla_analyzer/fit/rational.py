"""Rational transfer functions by maximum likelihood (ELiS), in orthonormal polynomials.

G = B/A exp(-s delay), one numerator for each output. Start: Sanathanan and Koerner's iteration,
each step in polynomials that are orthonormal under its own weights (Hokanson, Multivariate rational
approximation using a stabilized Sanathanan-Koerner iteration, 2020). Then Levenberg-Marquardt on
sum_k e_k^H C_k^-1 e_k (Pintelon and Schoukens, System Identification, 2nd ed. 2012, ch. 9).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .basis import Basis
from .likelihood import Task, refined, slopes
from .sampled import Sampled

ITERATIONS = 30
EVALUATIONS = 100
ROUNDS = 2
"""Fits in a basis each; the second is orthonormal about the first one's denominator."""


@dataclass(frozen=True)
class RationalModel:
    """A transfer function B/A exp(-s delay) in a basis.

    Attributes:
        sampled: how it is seen.
        upper: basis of each numerator.
        lower: basis of the denominator.
        b: coefficients of each numerator, (O, nb + 1).
        a: coefficients of the denominator, (na + 1,), of norm 1.
        along: (na + 1, na), directions in which `a` is free.
        delay_s: its delay.
        free_delay: whether the delay was fitted.
    """

    sampled: Sampled
    upper: tuple[Basis, ...]
    lower: Basis
    b: np.ndarray
    a: np.ndarray
    along: np.ndarray
    delay_s: float
    free_delay: bool

    @property
    def values(self) -> np.ndarray:
        """The free parameters: numerators, denominator, perhaps the delay in s, (p,)."""
        delay = [self.delay_s] if self.free_delay else []
        return np.concatenate([self.b.ravel(), np.zeros(self.along.shape[1]), delay])

    def with_values(self, values: np.ndarray) -> RationalModel:
        """Return the model with other free parameters."""
        size, count = self.b.size, self.along.shape[1]
        a = self.a + self.along @ values[size : size + count]
        delay = float(values[-1]) if self.free_delay else self.delay_s
        other = replace(self, b=values[:size].reshape(self.b.shape), a=a, delay_s=delay)
        other.__dict__["_terms"] = self._terms
        return other

    @cached_property
    def _terms(self) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        """The polynomials of each numerator and of the denominator, complex (F, A, n + 1)."""
        x = self.sampled.x
        return tuple(basis.at(x) for basis in self.upper), self.lower.at(x)

    def seen(self) -> np.ndarray:
        """Return G, complex (F, O)."""
        return self.response()[0]

    def response(self) -> tuple[np.ndarray, np.ndarray]:
        """Return G, complex (F, O), and its Jacobian by the free parameters, (F, O, p)."""
        uppers, lower = self._terms
        a = lower @ self.a
        weight = self.sampled.delayed(self.delay_s) / a
        lines, outputs, terms = a.shape[0], len(uppers), self.b.shape[1]
        jacobian = np.zeros((lines, outputs, self.values.size), complex)
        g = np.empty((lines, outputs), complex)
        size = self.b.size
        for o, upper in enumerate(uppers):
            every = weight * (upper @ self.b[o])
            g[:, o] = every.sum(axis=1)
            jacobian[:, o, o * terms : (o + 1) * terms] = (weight[:, None, :] @ upper)[:, 0]
            by_a = -((every / a)[:, None, :] @ lower)[:, 0]
            jacobian[:, o, size : size + self.along.shape[1]] = by_a @ self.along
            if self.free_delay:
                jacobian[:, o, -1] = -(self.sampled.s * every).sum(axis=1)
        return g, jacobian


def fit_rational(task: Task, nb: int, na: int) -> RationalModel:
    """Fit numerators of degree nb and a common denominator of degree na."""
    model = _start(task, nb, na)
    for _ in range(ROUNDS):
        size = np.linalg.norm(slopes(task.samples, model), axis=0)
        model = refined(task.samples, model, EVALUATIONS, 1.0 / np.maximum(size, 1e-300))
        model = _rebased(replace(task, delay_s=model.delay_s), model)
    return model


def _start(task: Task, nb: int, na: int) -> RationalModel:
    """Return the best of the models that the iteration passes through, from two sets of weights."""
    best, least = None, np.inf
    size = np.linalg.norm(task.samples.whitened(task.data), axis=1)
    for first in (np.ones(size.size), size):
        denominator = first.astype(complex)
        for _ in range(ITERATIONS):
            found = _linear(task, *_bases(task, nb, na, denominator), denominator)
            before, denominator = denominator, found.lower.at(task.sampled.main_x) @ found.a
            denominator = denominator / np.linalg.norm(denominator)
            cost = task.samples.cost(found.seen())
            if cost < least:
                best, least = found, cost
            if np.abs(np.abs(before) - np.abs(denominator)).max() < 1e-6:
                break
    assert best is not None
    return best


def _linear(
    task: Task, upper: tuple[Basis, ...], lower: Basis, denominator: np.ndarray
) -> RationalModel:
    """Return the linear least squares solution with a given denominator in the weight."""
    x, outputs = task.sampled.main_x, task.samples.outputs
    columns = []
    for o, basis in enumerate(upper):
        unit = np.zeros((outputs, 1))
        unit[o] = 1.0
        columns.append(basis.at(x)[:, None, :] * unit)
    columns.append(-task.data[:, :, None] * lower.at(x)[:, None, :])
    matrix = np.concatenate(columns, axis=2) * (task.held / denominator)[:, None, None]
    white = task.samples.whitened(matrix).reshape(-1, matrix.shape[2])
    stacked = np.concatenate([white.real, white.imag])
    solution = np.linalg.svd(stacked, full_matrices=False)[2][-1]
    count = outputs * (upper[0].degree + 1)
    norm = np.linalg.norm(solution[count:])
    b, a = solution[:count].reshape(outputs, -1) / norm, solution[count:] / norm
    return RationalModel(
        task.sampled, upper, lower, b, a, _complement(a), task.delay_s, task.free_delay
    )


def _bases(
    task: Task, nb: int, na: int, denominator: np.ndarray
) -> tuple[tuple[Basis, ...], Basis]:
    """Return polynomials that are orthonormal under the weights of a given denominator."""
    x, samples = task.sampled.main_x, task.samples
    share = np.abs(task.held / denominator)
    upper = tuple(
        Basis.on(x, share * np.linalg.norm(samples.whitening[:, :, o], axis=1), nb)
        for o in range(samples.outputs)
    )
    return upper, Basis.on(x, share * np.linalg.norm(samples.whitened(task.data), axis=1), na)


def _complement(a: np.ndarray) -> np.ndarray:
    """Return orthonormal directions across `a`, (n + 1, n): along it only the scale changes."""
    return np.linalg.svd(a[None, :])[2][1:].T


def _rebased(task: Task, model: RationalModel) -> RationalModel:
    """Return the same model in polynomials that are orthonormal about its own denominator."""
    x = task.sampled.main_x
    denominator = model.lower.at(x) @ model.a
    upper, lower = _bases(task, model.b.shape[1] - 1, model.a.size - 1, denominator)
    a = _expressed(lower, x, denominator)
    norm = np.linalg.norm(a)
    b = [
        _expressed(new, x, old.at(x) @ each)
        for new, old, each in zip(upper, model.upper, model.b, strict=True)
    ]
    a = a / norm
    return replace(model, upper=upper, lower=lower, b=np.array(b) / norm, a=a, along=_complement(a))


def _expressed(basis: Basis, x: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the coefficients of a polynomial that has given values at the points."""
    matrix = basis.at(x)
    scale = 1.0 / np.maximum(np.abs(values), 1e-300)
    stacked = np.concatenate([matrix.real * scale[:, None], matrix.imag * scale[:, None]])
    return np.linalg.lstsq(
        stacked, np.concatenate([values.real * scale, values.imag * scale]), rcond=None
    )[0]
