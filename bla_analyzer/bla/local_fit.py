"""Local polynomial fits of the indirect response: one window of lines, any number of runs.

Over a few lines around a frequency, the responses of torque and position to the reference and the
transient of each run are polynomials, and what is left is noise and distortion (Pintelon and
Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. 2012, ch. 7):

    [U_m; Y_m](f) = (sum_i g_i x^i) R_m(f) + sum_i t_mi x^i + V_m(f),   x = (f - middle)/half width

The response is common to all runs m, the transients are not. G = G_ry/G_ru at the frequency itself:
the reference is the instrument, so noise that the loop feeds back into u causes no bias.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_MOST_LEVERAGE = 0.98


@dataclass(frozen=True)
class Run:
    """Spectra of one reference: those of one record, or the mean over records that repeat it.

    Attributes:
        frequency_hz: (K,), ascending, without DC.
        spectra: complex (3, K), R, U and Y, |X| the peak amplitude of a line.
        repeats: how many periods or records stand behind the mean.
        noise: complex (2, 2, K), covariance of the mean U and Y; None if there is but one.
    """

    frequency_hz: np.ndarray
    spectra: np.ndarray
    repeats: int = 1
    noise: np.ndarray | None = None

    def window(self, low_hz: float, high_hz: float) -> slice:
        """Return the lines from `low_hz` to `high_hz`."""
        ends = np.array([low_hz * (1.0 - 1e-9), high_hz * (1.0 + 1e-9)])
        return slice(*np.searchsorted(self.frequency_hz, ends).tolist())


@dataclass(frozen=True)
class Fit:
    """What one window tells of the response at one frequency.

    Attributes:
        torque, position: G_ru and G_ry there.
        lines: in the window, of all runs.
        spread: variance of G_ru or G_ry over that of a line of U or Y.
        residual: complex (2, 2), covariance of what is left of U and Y at a line.
        noise: the same of noise alone in the mean over repeats; None without repeats.
        degrees, noise_degrees: complex degrees of freedom of `residual` and `noise`.
        variance: of `position` - G `torque`; lines may differ in variance (`_robust`).
        variance_degrees: its complex degrees of freedom.
        power: (3,), mean of |R|^2, |U|^2 and |Y|^2 over the lines of the window.
        bend: squared distance of G from that of the polynomial of two orders less, over what chance
            would give.
    """

    torque: complex
    position: complex
    lines: int
    spread: float
    residual: np.ndarray
    noise: np.ndarray | None
    degrees: int
    noise_degrees: int
    variance: float
    variance_degrees: float
    power: np.ndarray
    bend: float

    @property
    def g(self) -> complex:
        """G, motor torque to motor position, rad/(N m)."""
        return self.position / self.torque

    def of_residual(self, covariance: np.ndarray) -> float:
        """Return the variance that a covariance of (U, Y) gives to Y - G U."""
        return _of_residual(self.g, covariance)


def _of_residual(g: complex, covariance: np.ndarray) -> float:
    weight = np.array([-g, 1.0])
    return max(float((weight @ covariance @ weight.conj()).real), 0.0)


def degrees_of_freedom(lines: Sequence[int], order: int) -> int:
    """Return what is left of the lines of each run when all polynomials are fitted."""
    return sum(lines) - (order + 1) * (len(lines) + 1)


def fit_window(
    runs: Sequence[Run], at_hz: float, window_hz: tuple[float, float], order: int
) -> Fit | None:
    """Fit one window.

    Args:
        runs: one or more.
        at_hz: where the response is asked for.
        window_hz: ends of the window.
        order: of the polynomials, 2 or more.

    Returns:
        The fit; None if the window has too few lines or no reference.
    """
    middle, half = 0.5 * sum(window_hz), 0.5 * (window_hz[1] - window_hz[0])
    terms = order + 1
    kept: list[np.ndarray] = []
    transients: list[np.ndarray] = []
    noise, noisy, noise_degrees, power = np.zeros((2, 2), complex), 0, 0, np.zeros(3)
    for run in runs:
        lines = run.window(*window_hz)
        x = (run.frequency_hz[lines] - middle) / half
        if x.size < terms + 1:
            continue
        powers = x[:, None] ** np.arange(terms)
        transient = np.linalg.qr(powers)[0]
        r, u, y = run.spectra[:, lines]
        columns = np.column_stack([powers * r[:, None], u, y])
        kept.append(columns - transient @ (transient.T @ columns))
        transients.append(transient)
        power += np.sum(np.abs(run.spectra[:, lines]) ** 2, axis=1)
        if run.noise is not None:
            noise += run.noise[:, :, lines].sum(axis=2)
            noisy += x.size
            noise_degrees += (run.repeats - 1) * x.size
    degrees = degrees_of_freedom([len(columns) for columns in kept], order)
    if not kept or degrees < 2 or not power[0] > 0:
        return None
    columns = np.concatenate(kept)
    at = ((at_hz - middle) / half) ** np.arange(terms)
    solved = _solve(columns, terms, at)
    lower = _solve(columns, terms - 2, at)
    if solved is None or lower is None:
        return None
    response, weights, left, base = solved
    g = complex(response[1] / response[0])
    spread = float(np.sum(np.abs(weights) ** 2))
    residual = left.T @ left.conj() / degrees
    chance = _of_residual(g, residual) * (spread - float(np.sum(np.abs(lower[1]) ** 2)))
    apart_lower = abs(lower[0][1] - g * lower[0][0]) ** 2
    variance, effective = _robust(weights, left[:, 1] - g * left[:, 0], base, transients)
    return Fit(
        torque=complex(response[0]),
        position=complex(response[1]),
        lines=len(columns),
        spread=spread,
        residual=residual,
        noise=noise / noisy if noisy else None,
        degrees=degrees,
        noise_degrees=noise_degrees,
        variance=variance,
        variance_degrees=max(min(effective, float(degrees)), 1.0),
        power=power / len(columns),
        bend=apart_lower / chance if chance > 0 else float("inf" if apart_lower else 0.0),
    )


def _solve(
    columns: np.ndarray, terms: int, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray] | None:
    """Return (G_ru, G_ry), the weight of each line, what is left (lines, 2), and a base."""
    inputs, outputs = columns[:, :terms], columns[:, -2:]
    scale = np.sqrt(np.sum(np.abs(inputs) ** 2, axis=0))
    if not (scale > 0).all():
        return None
    try:
        base, triangle = np.linalg.qr(inputs / scale)
        weights = base @ np.linalg.solve(triangle.conj().T, at[:terms] / scale)
    except np.linalg.LinAlgError:
        return None
    projected = base.conj().T @ outputs
    left = outputs - base @ projected
    return weights.conj() @ outputs, weights, left, base


def _robust(
    weights: np.ndarray, error: np.ndarray, base: np.ndarray, transients: Sequence[np.ndarray]
) -> tuple[float, float]:
    """Return the variance of a weighted sum of errors of unequal variance, and its degrees.

    Squared residuals over what their leverage leaves of them, and Satterthwaite's degrees of
    freedom were all variances equal (Bell and McCaffrey, Survey Methodology 28(2), 2002).

    Args:
        weights: complex (lines,), of the sum.
        error: complex (lines,), residual.
        base: complex (lines, terms), orthonormal base of the inputs.
        transients: (lines of a run, terms) each, orthonormal base of the transient of each run.
    """
    leverage = np.sum(np.abs(base) ** 2, axis=1)
    leverage += np.concatenate([np.sum(part**2, axis=1) for part in transients])
    leverage = np.minimum(leverage, _MOST_LEVERAGE)
    shares = np.abs(weights) ** 2 / (1.0 - leverage)
    cross = float(np.sum(np.abs((base.conj().T * shares) @ base) ** 2))
    start = 0
    for part in transients:
        of_run = slice(start, start + len(part))
        weighted = part.T * shares[of_run]
        cross += float(np.sum((weighted @ part) ** 2))
        cross += 2.0 * float(np.sum(np.abs(weighted @ base[of_run]) ** 2))
        start += len(part)
    squares = float(np.sum(shares**2 * (1.0 - 2.0 * leverage))) + cross
    whole = float(np.sum(shares * (1.0 - leverage)))
    variance = float(np.sum(shares * np.abs(error) ** 2))
    return variance, whole**2 / squares if squares > 0 else 1.0
