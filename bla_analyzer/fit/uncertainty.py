"""Covariance and 95 % intervals of a fit, from each line's own covariance.

theta_hat - theta = H^-1 sum_k J_k^H W_k e_k with H the curvature of the cost, so its covariance is
H^-1 (sum_k J_k^H W_k C_k W_k J_k) H^-1 (White 1982, Econometrica 50(1)). It holds for any weights
W_k, and C_k may be the noisy estimate of M realizations, because it is summed over lines; degrees
of freedom of the sum are Satterthwaite's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution
from scipy.stats import t as t_distribution

from .fit_types import Interval, Root
from .samples import Samples

LEVEL = 0.95


@dataclass(frozen=True)
class Uncertainty:
    """What is needed for the interval of any quantity of a fit.

    Attributes:
        bread: (p, p), inverse curvature.
        lines: complex (F, O, p), whitened Jacobian.
        white: complex (F, O, O), covariance of whitened errors.
        degrees: (F,), complex degrees of freedom of each.
        widening: at least 1: by how much errors of the model widen standard deviations.
    """

    bread: np.ndarray
    lines: np.ndarray
    white: np.ndarray
    degrees: np.ndarray
    widening: float

    @classmethod
    def of(cls, samples: Samples, jacobian: np.ndarray, widening: float = 1.0) -> Uncertainty:
        """Return the uncertainty of a fit.

        Args:
            samples: the lines.
            jacobian: complex (F, O, p), of the model.
            widening: of standard deviations.
        """
        lines = samples.whitened(jacobian)
        curvature = 2.0 * np.einsum("fap,faq->pq", np.conj(lines), lines).real
        size = np.sqrt(np.maximum(np.diag(curvature), 1e-300))
        scaled = np.linalg.pinv(curvature / np.outer(size, size), rcond=1e-14, hermitian=True)
        bread = scaled / np.outer(size, size)
        return cls(bread, lines, samples.white_covariance, samples.degrees, widening)

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the free parameters, (p, p)."""
        meat = np.einsum("fap,fab,fbq->pq", np.conj(self.lines), self.white, self.lines).real
        return self.widening**2 * 2.0 * self.bread @ meat @ self.bread

    @property
    def lost(self) -> float:
        """What the fit takes from the expected cost."""
        meat = np.einsum("fap,fab,fbq->pq", np.conj(self.lines), self.white, self.lines).real
        return float(np.trace(self.bread @ meat))

    def spread(self, gradient: np.ndarray) -> tuple[float, float]:
        """Return standard deviation and degrees of freedom of a real quantity.

        Args:
            gradient: (p,), by the free parameters.
        """
        reach = self.lines @ (self.bread @ gradient)
        shares = 2.0 * np.einsum("fa,fab,fb->f", np.conj(reach), self.white, reach).real
        total = float(shares.sum())
        if not total > 0:
            return 0.0, 1e6
        noisy = float(((shares / total) ** 2 / (2.0 * (self.degrees + 1.0))).sum())
        return self.widening * np.sqrt(total), max(1.0 / noisy, 1.0)

    def interval(self, value: float, gradient: np.ndarray, unit: str) -> Interval:
        """Return a quantity with its 95 % interval."""
        std, degrees = self.spread(gradient)
        half = std * float(t_distribution.ppf(0.5 + 0.5 * LEVEL, degrees))
        return Interval(value=value, std=std, low=value - half, high=value + half, unit=unit)

    def log_interval(self, value: float, gradient: np.ndarray, unit: str) -> Interval:
        """Return a positive quantity with its 95 % interval; `gradient` is that of its log."""
        std, degrees = self.spread(gradient)
        factor = float(np.exp(min(std * t_distribution.ppf(0.5 + 0.5 * LEVEL, degrees), 600.0)))
        low, high = value / factor, value * factor
        return Interval(value=value, std=value * std, low=low, high=high, unit=unit)

    def root(
        self, root: complex, slope: np.ndarray, in_s: complex, in_s_slope: np.ndarray, unit: str
    ) -> Root:
        """Return a pole or zero with its 95 % ellipse, natural frequency and damping.

        Args:
            root: in s (rad/s) or z.
            slope: complex (p,), its gradient by the free parameters.
            in_s: the same root in s, rad/s.
            in_s_slope: complex (p,), its gradient.
            unit: of the root.
        """
        covariance = self.covariance
        parts = np.stack([slope.real, slope.imag])
        two = parts @ covariance @ parts.T
        size = abs(in_s)
        turn = np.conj(in_s) / size if size > 0 else 1.0
        by_size = (turn * in_s_slope).real
        damping = -in_s.real / size if size > 0 else 0.0
        by_damping = -(in_s_slope.real + damping * by_size) / size if size > 0 else 0.0 * by_size
        _, degrees = self.spread(by_size)
        stretch = np.sqrt(2.0 * f_distribution.ppf(LEVEL, 2, degrees))
        sizes, axes = np.linalg.eigh(two)
        half = stretch * np.sqrt(np.maximum(sizes, 0.0))
        return Root(
            re=float(root.real),
            im=float(root.imag),
            std_re=float(np.sqrt(max(two[0, 0], 0.0))),
            std_im=float(np.sqrt(max(two[1, 1], 0.0))),
            ellipse_major=float(half[1]),
            ellipse_minor=float(half[0]),
            ellipse_angle_deg=float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1]))),
            unit=unit,
            frequency_hz=self.interval(size / (2.0 * np.pi), by_size / (2.0 * np.pi), "Hz"),
            damping_ratio=self.interval(damping, by_damping, "1"),
        )
