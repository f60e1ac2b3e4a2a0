"""The lines of a BLA as a fit takes them: values, their covariance, and weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fjr_kit.errors import InputError

from ..results.result import BlaEstimate
from .weights import neighbours_covariance

FLOOR = 1e-8
"""Least standard deviation of a line relative to |G|: round-off of noiseless simulations."""


@dataclass(frozen=True)
class Samples:
    """F lines of a BLA of O outputs.

    Attributes:
        frequency_hz: (F,).
        g: complex (F, O), rad/(N m): motor position, then link position.
        covariance: complex (F, O, O), of g as it was estimated at each line.
        line_degrees: (F,), complex degrees of freedom of each covariance.
        degrees: (F,), the same less what neighbouring lines share.
        whitening: complex (F, O, O), the weight of the fit; whitening @ error has about unit
            covariance.
        left_out_hz: frequencies of unreliable lines, which are not used.
        of_noise_only: whether the covariance is that of noise, as no distortion is known.
    """

    frequency_hz: np.ndarray
    g: np.ndarray
    covariance: np.ndarray
    line_degrees: np.ndarray
    degrees: np.ndarray
    whitening: np.ndarray
    left_out_hz: np.ndarray
    of_noise_only: bool

    @property
    def outputs(self) -> int:
        """How many outputs there are, O."""
        return self.g.shape[1]

    def whitened(self, errors: np.ndarray) -> np.ndarray:
        """Return errors (F, O, ...) with the weight applied."""
        return np.einsum("fab,fb...->fa...", self.whitening, errors)

    def cost(self, model: np.ndarray) -> float:
        """Return sum_k e_k^H W_k e_k, e the distance of g from a model's, complex (F, O)."""
        return float((np.abs(self.whitened(self.g - model)) ** 2).sum())

    @property
    def white_covariance(self) -> np.ndarray:
        """The covariance of whitened errors as estimated at each line, complex (F, O, O)."""
        return self.whitening @ self.covariance @ np.conj(np.swapaxes(self.whitening, 1, 2))


def samples_of(
    bla: BlaEstimate, detection_lines: int, source: str, *, link: bool = True
) -> Samples:
    """Return the lines of a BLA, weighted.

    Args:
        bla: the estimate.
        detection_lines: how many odd detection lines told the variance, in the fast method.
        source: what it is, for messages.
        link: whether to take the link position as a second output, where it is known.

    Raises:
        InputError: no variance is known, or too few lines are reliable.
    """
    noise_only = not np.isfinite(bla.var_total).any()
    variance = bla.var_noise if noise_only else bla.var_total
    if not np.isfinite(variance).any():
        raise InputError(
            f"{source}: no variance of the BLA is known, so there is nothing to weight a fit with; "
            "record two periods or two realizations or more."
        )
    usable = np.isfinite(variance) & np.isfinite(bla.g) & (bla.reliable | noise_only)
    g, covariance = _joint(bla, variance, noise_only, link)
    usable &= np.isfinite(covariance).all(axis=(1, 2)) & (np.abs(g) > 0).all(axis=1)
    if usable.sum() < 4:
        raise InputError(
            f"{source}: {usable.sum()} of {bla.g.size} lines can be used, too few for a fit; "
            "excite more."
        )
    f, g, covariance = bla.frequency_hz[usable], g[usable], covariance[usable]
    floor = (FLOOR * np.abs(g)) ** 2
    covariance = covariance + floor[:, :, None] * np.eye(g.shape[1])
    degrees = _degrees(bla, noise_only)[usable]
    shared = 1.0
    if bla.method == "fast" and not noise_only:  # neighbours share detection lines
        shared = min(detection_lines / float(degrees.sum()), 1.0)
    weight = covariance
    if noise_only or bla.method == "robust":
        weight = neighbours_covariance(f, g, covariance, degrees)
    else:  # on average the inverse of an estimate is by this too great
        excess = degrees / np.maximum(degrees - 1.0, 1.0)
        covariance = covariance * excess[:, None, None]
    return Samples(
        frequency_hz=f,
        g=g,
        covariance=covariance,
        line_degrees=degrees,
        degrees=degrees * shared,
        whitening=_whitening(weight),
        left_out_hz=bla.frequency_hz[~usable],
        of_noise_only=noise_only,
    )


def _joint(
    bla: BlaEstimate, variance: np.ndarray, noise_only: bool, link: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return g, complex (F, O), and its covariance, complex (F, O, O), of all lines."""
    if bla.link is None or not link:
        return bla.g[:, None], variance[:, None, None].astype(complex)
    two = bla.link
    cross, own = (two.cov_noise, two.var_noise) if noise_only else (two.cov_total, two.var_total)
    rows = [[variance + 0j, np.conj(cross)], [cross, own + 0j]]
    return np.stack([bla.g, two.g], axis=1), np.moveaxis(np.array(rows), 2, 0)


def _degrees(bla: BlaEstimate, noise_only: bool) -> np.ndarray:
    """Return the complex degrees of freedom of the variance at each line, (F,)."""
    count = bla.g.size
    if noise_only:
        return np.full(count, float(max(bla.realizations * (bla.periods - 1), 1)))
    if bla.method == "robust":
        return np.full(count, float(bla.realizations - 1))
    return np.array(
        [_of_radius(r * r / v) for r, v in zip(bla.radius_95, bla.var_total, strict=True)]
    )


def _of_radius(ratio: float) -> float:
    """Return n of n (20^(1/n) - 1) = ratio, the 95 % radius squared over the variance."""
    if not np.isfinite(ratio):
        return float("nan")
    low, high = 0.3, 1e4
    least = high * (20.0 ** (1.0 / high) - 1.0)
    if ratio <= least:
        return high
    return float(brentq(lambda n: n * (20.0 ** (1.0 / n) - 1.0) - ratio, low, high))


def _whitening(covariance: np.ndarray) -> np.ndarray:
    return np.linalg.inv(np.linalg.cholesky(covariance))
