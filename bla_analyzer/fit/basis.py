"""Polynomials that are orthonormal on the lines of a BLA: Vandermonde with Arnoldi.

Monomials up to degree 12 have a condition number of 2e4 over two decades, if frequency is scaled to
its highest value, and beyond 1e16 in rad/s or in z; polynomials that Arnoldi's method builds on the
lines, under the weights of the fit, have that of 1, and their roots are eigenvalues of a small
matrix (Brubeck, Nakatsukasa, Trefethen, Vandermonde with Arnoldi, SIAM
Review 63(2), 2021; orthogonal on a line they are those of Forsythe).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Basis:
    """Real polynomials q_0..q_n of degree 0..n, x q_k = sum_j h[j, k] q_j.

    Attributes:
        first: q_0.
        h: (n + 1, n), Hessenberg.
    """

    first: float
    h: np.ndarray

    @classmethod
    def on(cls, points: np.ndarray, weights: np.ndarray, degree: int) -> Basis:
        """Return polynomials orthonormal under Re sum weights^2 conj(p) q.

        Args:
            points: complex (F,), where; their conjugates count as well, so coefficients are real.
            weights: (F,), positive.
            degree: n.
        """
        first = 1.0 / np.linalg.norm(weights)
        columns = [first * weights.astype(complex)]
        h = np.zeros((degree + 1, degree))
        for k in range(degree):
            next_one = points * columns[k]
            for _ in range(2):  # twice, so that round-off does not spoil orthogonality
                for j, column in enumerate(columns):
                    share = float(np.vdot(column, next_one).real)
                    h[j, k] += share
                    next_one = next_one - share * column
            h[k + 1, k] = np.linalg.norm(next_one)
            columns.append(next_one / h[k + 1, k])
        return cls(float(first), h)

    @property
    def degree(self) -> int:
        """The highest degree, n."""
        return self.h.shape[1]

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return q_0..q_n at any points, complex (..., n + 1)."""
        return self.with_slope(points)[0]

    def with_slope(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the polynomials and their derivatives at any points, complex (..., n + 1) each."""
        points = np.asarray(points, complex)
        values = np.empty((*points.shape, self.degree + 1), complex)
        slopes = np.zeros_like(values)
        values[..., 0] = self.first
        for k in range(self.degree):
            known, scale = self.h[: k + 1, k], self.h[k + 1, k]
            values[..., k + 1] = points * values[..., k] - values[..., : k + 1] @ known
            slopes[..., k + 1] = (
                values[..., k] + points * slopes[..., k] - slopes[..., : k + 1] @ known
            )
            values[..., k + 1] /= scale
            slopes[..., k + 1] /= scale
        return values, slopes

    def leading(self) -> np.ndarray:
        """Return the coefficient of x^k in q_k, (n + 1,)."""
        return self.first / np.concatenate([[1.0], np.cumprod(np.diag(self.h, -1))])

    def roots(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the roots of sum_k coefficients[k] q_k, complex (n,)."""
        if not self.degree:
            return np.empty(0, complex)
        matrix = self.h[:-1].copy()
        matrix[:, -1] -= self.h[-1, -1] / coefficients[-1] * coefficients[:-1]
        return np.linalg.eigvals(matrix)
