"""The best amplitude of an experiment, sought where a criterion over amplitudes is least.

Without the true plant the criterion is measured distortion. At low amplitude Coulomb friction makes
it fall with amplitude, at high amplitude the transmission makes it rise; the systematic shift of
the BLA does the same, and for both nonlinearities its power has nearly the same ratio to the power
of the distortion (1.75 for sgn, 1.5 for a cubic, of a Gaussian signal), so both are least at nearly
the same amplitude.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from fjr_records.lines import local_mean

from ..results.result import BlaEstimate
from .metrics import LOW_LINES_HZ

Criterion = Literal["distortion", "variance", "extrapolation"]
NEIGHBOURS = 2
"""Amplitudes on each side of the least one that the parabola is fitted to."""

DESCRIPTIONS: dict[Criterion, str] = {
    "distortion": "mean over lines of the nonlinear standard deviation over |G|",
    "variance": "mean over lines of the nonlinear variance over |G|^2, the paper's suggestion",
    "extrapolation": "V against the plant that the change of the BLA with amplitude points to",
}


def relative_distortion(bla: BlaEstimate, criterion: Criterion = "distortion") -> float:
    """Return the mean relative distortion over the lines from 1 Hz on (dimensionless).

    The signed nonlinear variances are averaged first (over neighbouring lines where a square root
    follows), so that noise alone does not count as distortion.

    Args:
        bla: estimate at one amplitude.
        criterion: distortion or variance.
    """
    use = bla.frequency_hz >= LOW_LINES_HZ * (1.0 - 1e-9)
    if not use.any():
        use = np.ones(bla.g.shape, bool)
    relative = (bla.var_nonlinear / np.abs(bla.g) ** 2)[use]
    if criterion == "variance":
        return float(max(relative.mean(), 0.0))
    return float(np.sqrt(np.maximum(local_mean(relative, 3), 0.0)).mean())


def least(amplitudes: np.ndarray, values: np.ndarray) -> float:
    """Return where a criterion is least: the vertex of a parabola in log-log around it.

    Args:
        amplitudes: (L,), ascending.
        values: (L,), positive; NaN where there is none.

    Returns:
        The amplitude, within the neighbours of the least value; NaN if none is known.
    """
    known = np.isfinite(values) & (values > 0)
    x, y = np.log(amplitudes[known]), np.log(values[known])
    if not x.size:
        return float("nan")
    i = int(np.argmin(y))
    low, high = max(0, i - NEIGHBOURS), min(x.size, i + NEIGHBOURS + 1)
    if high - low < 3:
        return float(np.exp(x[i]))
    curvature, slope, _ = np.polyfit(x[low:high] - x[i], y[low:high], 2)
    if curvature <= 0:
        return float(np.exp(x[i]))
    vertex = x[i] - slope / (2.0 * curvature)
    return float(np.exp(np.clip(vertex, x[max(0, i - 1)], x[min(x.size - 1, i + 1)])))


def is_bracketed(amplitudes: np.ndarray, values: np.ndarray) -> bool:
    """Tell whether the criterion is known on both sides of its least value."""
    known = np.isfinite(values)
    i = int(np.argmin(values[known])) if known.any() else 0
    return 0 < i < int(known.sum()) - 1


def extrapolated_log_gain(amplitudes: np.ndarray, blas: list[BlaEstimate]) -> np.ndarray:
    """Return ln|G0| as the change of the BLA with amplitude points to, (F,).

    Friction shifts the BLA as 1/A and a cubic stiffness as A^2 (statistical linearisation, first
    order): per line, ln|G| = ln|G0| + a/A + b A^2 by least squares weighted with the variances.

    Args:
        amplitudes: (L,), at least four.
        blas: L estimates on the same lines.
    """
    gains = np.log(np.abs([bla.g for bla in blas]))
    variances = np.array([bla.var_total / np.abs(bla.g) ** 2 for bla in blas])
    scaled = amplitudes / np.exp(np.log(amplitudes).mean())
    terms = np.stack([np.ones(scaled.size), 1.0 / scaled, scaled**2], axis=1)
    weights = 1.0 / np.sqrt(variances + 1e-6)
    return np.array(
        [
            np.linalg.lstsq(terms * w[:, None], gain * w, rcond=None)[0][0]
            for gain, w in zip(gains.T, weights.T, strict=True)
        ]
    )


def extrapolation_values(
    amplitudes: np.ndarray, blas: list[BlaEstimate], around: float
) -> np.ndarray:
    """Return V (dB^2, mean from 1 Hz on) against the extrapolated plant, (L,).

    Args:
        amplitudes: (L,), ascending.
        blas: L estimates.
        around: amplitude near the optimum; only levels from 1/2.6 to 2 times it are fitted, beyond
            which the two shifts are no longer small.
    """
    near = (amplitudes > around / 2.6) & (amplitudes < around * 2.0)
    if near.sum() < 4:
        return np.full(amplitudes.shape, np.nan)
    chosen = [bla for bla, use in zip(blas, near, strict=True) if use]
    log_gain = extrapolated_log_gain(amplitudes[near], chosen)
    use = chosen[0].frequency_hz >= LOW_LINES_HZ * (1.0 - 1e-9)
    values = np.full(amplitudes.shape, np.nan)
    values[near] = [
        np.mean((20.0 / np.log(10.0) * (np.log(np.abs(bla.g)) - log_gain)[use]) ** 2)
        for bla in chosen
    ]
    return values
