"""Ratios of polynomials in z^-1: sums, products, common denominators, Tustin's rule.

`import scipy` loads its parts where they are first used. `scipy.signal` takes as long as all else
that a node or a simulation imports, and most of them never use it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

Ratio = tuple[np.ndarray, np.ndarray]
"""Numerator and denominator in powers z^0, z^-1, ..."""

ONE: Ratio = (np.array([1.0]), np.array([1.0]))
_EXACT = 1e-12
"""What rounding leaves of a remainder, relative to the polynomial that was divided."""
_SAME_ROOT = 1e-6
_SAME_POLYNOMIAL = 1e-9


def scaled(gain: float, ratio: Ratio) -> Ratio:
    """Return a gain times a ratio."""
    return gain * ratio[0], ratio[1]


def product(one: Ratio, other: Ratio) -> Ratio:
    """Return the product of two ratios."""
    return np.convolve(one[0], other[0]), np.convolve(one[1], other[1])


def total(*parts: Ratio) -> Ratio:
    """Return the sum of ratios; factors that their denominators share are taken once."""
    first, *rest = parts
    for part in rest:
        b1, b2, a = together(first, part)
        first = added(b1, b2), a
    return first


def together(one: Ratio, other: Ratio) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return both numerators over one denominator, and that denominator.

    What the denominators share is taken once: an integrator that is in both must not become a
    double one. Shared are factors that divide exactly, else roots that coincide.
    """
    (b1, a1), (b2, a2) = one, other
    a1, a2 = np.trim_zeros(a1, "b"), np.trim_zeros(a2, "b")
    m1, m2 = _missing(a1, a2)
    return np.convolve(b1, m1), np.convolve(b2, m2), np.convolve(a1, m1)


def _missing(a1: np.ndarray, a2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the factors that make two denominators equal."""
    one = np.ones(1)
    if np.array_equal(a1, a2):
        return one, one
    if (quotient := _divided(a2, a1)) is not None:
        return quotient, one
    if (quotient := _divided(a1, a2)) is not None:
        return one, quotient
    left, alone = list(np.roots(a2)), []
    for root in np.roots(a1):
        nearest = min(left, key=lambda other: abs(other - root), default=math.inf)
        if abs(nearest - root) < _SAME_ROOT:
            left.remove(nearest)
        else:
            alone.append(root)
    m1, m2 = (np.atleast_1d(np.real(np.poly(roots))) for roots in (left, alone))
    m1, m2 = a2[0] * m1, a1[0] * m2
    both, again = np.convolve(a1, m1), np.convolve(a2, m2)
    if (
        both.size == again.size
        and np.abs(both - again).max() <= _SAME_POLYNOMIAL * np.abs(both).max()
    ):
        return m1, m2
    return a2, a1


def _divided(dividend: np.ndarray, divisor: np.ndarray) -> np.ndarray | None:
    """Return the quotient of two polynomials; None if one does not divide the other."""
    if divisor.size > dividend.size:
        return None
    quotient, left = scipy.signal.deconvolve(dividend, divisor)
    return quotient if np.abs(left).max() <= _EXACT * np.abs(dividend).max() else None


def derivative(filter_rad_s: float | None, period_s: float) -> Ratio:
    """Return d/dt: the difference of two samples over their time, which a low-pass then smooths.

    A steady speed comes out as it is, however slow the filter is over a sample.
    """
    if filter_rad_s is None:
        return np.array([1.0, -1.0]) / period_s, np.array([1.0])
    decay = math.exp(-filter_rad_s * period_s)
    return (1.0 - decay) / period_s * np.array([1.0, -1.0]), np.array([1.0, -decay])


def step_invariant_derivative(filter_rad_s: float, period_s: float) -> Ratio:
    """Return d/dt behind a low-pass as `pd_filtered` has it, right after a step of its input.

    A steady speed comes out as n Ts/(1 - exp(-n Ts)) of itself.
    """
    decay = math.exp(-filter_rad_s * period_s)
    return filter_rad_s * np.array([1.0, -1.0]), np.array([1.0, -decay])


def integral(period_s: float) -> Ratio:
    """Return the sum over all samples times their period."""
    return np.array([period_s]), np.array([1.0, -1.0])


def discrete(
    numerator: Sequence[float], denominator: Sequence[float], domain: str, period_s: float
) -> Ratio:
    """Return a transfer function that is discrete, or continuous in descending powers of s.

    One that is not causal gets a denominator of zero.
    """
    b, a = np.array(numerator, float), np.array(denominator, float)
    if domain == "discrete":
        return b, a
    b, a = np.trim_zeros(b, "f"), np.trim_zeros(a, "f")
    if not a.size or b.size > a.size:
        return b, np.zeros(1)
    b = b if b.size else np.zeros(1)
    b, a, _ = scipy.signal.cont2discrete((b, a), period_s, method="bilinear")
    return np.atleast_1d(np.squeeze(b)), np.atleast_1d(np.squeeze(a))


def added(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the sum of two polynomials in powers z^0, z^-1, ..."""
    out = np.zeros(max(one.size, other.size))
    out[: one.size] += one
    out[: other.size] += other
    return out
