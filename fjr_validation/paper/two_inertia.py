"""Antiresonance and resonance of a BLA, from the two-inertia model that fits it best.

The BLA of a flexible joint keeps the shape of the linear joint with other damping and stiffness
(statistical linearisation), so five numbers fit all its lines: both inertias, both dampings and the
stiffness. Natural frequencies come from them even where damping masks the peaks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

NAMES = ("jm", "j", "fvm", "fv", "k0")
Frf = Callable[[dict[str, float], np.ndarray], np.ndarray]
"""({jm, j, fvm, fv, k0}, frequencies in Hz) -> complex FRF."""


@dataclass(frozen=True)
class Resonances:
    """Frequencies of a fitted two-inertia model with 95 % intervals.

    Attributes:
        antiresonance_hz: sqrt(k0/j)/2 pi.
        resonance_hz: sqrt(k0/j + k0/jm)/2 pi.
        antiresonance_half_hz, resonance_half_hz: half widths of the 95 % intervals.
        peak_hz: where |G| of the model has the maximum after its minimum; NaN where damping masks
            it.
        misfit: mean of |G - model|^2 over its variance; 1 if the model explains the BLA.
        parameters: the fitted model.
    """

    antiresonance_hz: float
    resonance_hz: float
    antiresonance_half_hz: float
    resonance_half_hz: float
    peak_hz: float
    misfit: float
    parameters: dict[str, float]


def fit_resonances(
    frequency_hz: np.ndarray,
    g: np.ndarray,
    variance: np.ndarray,
    frf: Frf,
    start: dict[str, float],
) -> Resonances:
    """Fit the model to a BLA by weighted least squares.

    The interval is that of the linearised fit, widened by the square root of the misfit where the
    model does not explain the BLA.

    Args:
        frequency_hz: (F,).
        g: complex (F,), BLA.
        variance: (F,), its total variance.
        frf: the model.
        start: parameters to start from.
    """
    scale = np.sqrt(np.maximum(variance, (1e-4 * np.abs(g)) ** 2) / 2.0)

    def residual(logs: np.ndarray) -> np.ndarray:
        error = (frf(_named(logs), frequency_hz) - g) / scale
        return np.concatenate([error.real, error.imag])

    first = np.log([max(start[name], 1e-6) for name in NAMES])
    fit = least_squares(residual, first, loss="soft_l1", f_scale=3.0, x_scale=0.1, max_nfev=200)
    error = residual(fit.x)
    misfit = float(np.mean(error**2))
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * max(misfit, 1.0)
    found = _named(fit.x)
    jm, j, k0 = found["jm"], found["j"], found["k0"]
    low, high = np.sqrt(k0 / j) / (2 * np.pi), np.sqrt(k0 / j + k0 / jm) / (2 * np.pi)
    toward_low = low * np.array([0.0, -0.5, 0.0, 0.0, 0.5])
    share = jm / (j + jm)
    toward_high = high * 0.5 * np.array([share - 1.0, -share, 0.0, 0.0, 1.0])
    return Resonances(
        float(low),
        float(high),
        1.96 * float(np.sqrt(toward_low @ covariance @ toward_low)),
        1.96 * float(np.sqrt(toward_high @ covariance @ toward_high)),
        _peak(found, frf, frequency_hz),
        misfit,
        found,
    )


def _named(logs: np.ndarray) -> dict[str, float]:
    return dict(zip(NAMES, np.exp(np.clip(logs, -14.0, 23.0)).tolist(), strict=True))


def _peak(parameters: dict[str, float], frf: Frf, frequency_hz: np.ndarray) -> float:
    """Return where |G| has the maximum after its first minimum; NaN if there is none."""
    fine = np.linspace(frequency_hz[0], frequency_hz[-1], 2000)
    gain = np.abs(frf(parameters, fine))
    rising = np.flatnonzero(np.diff(gain) > 0)
    if not rising.size:
        return float("nan")
    start = int(rising[0])
    falling = np.flatnonzero(np.diff(gain[start:]) < 0)
    return float(fine[start + int(falling[0])]) if falling.size else float("nan")
