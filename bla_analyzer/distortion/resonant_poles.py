"""Resonant poles of an FRF, by a rational fit: where a spectrum behind the plant has its peaks.

Distortion torques enter the plant at places unknown, so the zeros of their way to the output are
unknown, and whether rigid-body motion passes too; the resonances every way shares.
"""

from __future__ import annotations

import numpy as np

ORDER = 4
"""A rigid body and one flexible mode. An FRF with scatter makes poles of its own where the order is
higher; further modes are then simply not found."""
_ITERATIONS = 15
_LEAST_HALF_WIDTH_LINES = 3.0
"""A narrower peak of a scattered FRF is taken for one of this half bandwidth."""


def resonant_poles(frequency_hz: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Return the complex pole pairs of a rational function fitted to an FRF.

    Least squares of (B - G A)/|G A|, with A of the iteration before (Sanathanan and Koerner 1963,
    IEEE Transactions on Automatic Control 8(1)); the iterate of the least relative misfit counts.

    Args:
        frequency_hz: (F,), ascending.
        g: complex (F,).

    Returns:
        complex (R,), R <= 2, in Hz: -half bandwidth + j frequency, within the band; none if
        there are too few lines to fit.
    """
    none = np.empty(0, complex)
    gain = np.abs(g)
    if frequency_hz.size <= 2 * ORDER or not np.all(gain > 0):
        return none
    powers = (1j * frequency_hz / frequency_hz[-1])[:, None] ** np.arange(ORDER + 1)
    found, least = none, np.inf
    denominator = np.ones(g.shape, complex)
    for _ in range(_ITERATIONS):
        weight = 1.0 / (gain * np.abs(denominator))
        terms = np.hstack([powers[:, :ORDER], -g[:, None] * powers[:, :ORDER]]) * weight[:, None]
        solution = _least_squares(terms, weight * g * powers[:, ORDER])
        coefficients = np.append(solution[ORDER:], 1.0)
        denominator = powers @ coefficients
        model = powers[:, :ORDER] @ solution[:ORDER] / denominator
        misfit = float(np.sum(np.abs(model / g - 1.0) ** 2))
        if misfit < least:
            least, found = misfit, np.roots(coefficients[::-1]) * frequency_hz[-1]
    inside = (found.imag > 0) & (np.abs(found) > frequency_hz[0])
    pairs = found[inside & (np.abs(found) < frequency_hz[-1])]
    narrowest = _LEAST_HALF_WIDTH_LINES * float(np.median(np.diff(frequency_hz)))
    return -np.maximum(np.abs(pairs.real), narrowest) + 1j * pairs.imag


def _least_squares(terms: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return real coefficients of complex equations, columns scaled to like size."""
    rows = np.vstack([terms.real, terms.imag])
    scale = np.linalg.norm(rows, axis=0)
    right = np.concatenate([values.real, values.imag])
    return np.linalg.lstsq(rows / scale, right, rcond=None)[0] / scale


def resonant_power(frequency_hz: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Return the power gain of all pole pairs together, one at DC, (F,); ones without poles."""
    s = 1j * frequency_hz[:, None]
    gain = np.abs(poles) ** 2 / np.abs((s - poles) * (s - np.conj(poles)))
    return np.asarray(np.prod(gain**2, axis=1))
