"""Windows of local fits by rule, and the frequencies of an estimate.

Wide windows average noise away, narrow ones follow resonances. The rule, for windows that grow by
steps: fit polynomials of `ORDER` and of two orders less; while the two agree at this and
neighbouring frequencies as chance lets them, the lower order would do and the window may grow. The
estimate is that of the higher order, so that what bias the rule lets through is not in it
(bias-corrected inference: Calonico, Cattaneo, Farrell, J. American Statistical Association 113,
2018).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_kit.errors import InputError

from .local_fit import Run, degrees_of_freedom, fit_window

ORDER = 4
DEGREES = 8
"""Least degrees of freedom of a window."""
GROWTH = 1.4
NARROWEST, WIDEST = 0.004, 0.12
"""Half width of a window over its frequency: no resonance is sought that is narrower, and the
response is not held for a polynomial over more."""
BEND, EXCESS = 1.5, 1.0
"""Mean disagreement of the orders, over what chance gives lines of equal variance, up to which a
window may grow, and what is added for one window; it falls with the root of their number."""
SCAN_PER_DECADE = 40
MOST_LINES = 1200
SILENT = 1e-16
"""Power of the reference relative to its strongest line, below which nothing was played."""


def frequencies(
    runs: Sequence[Run], at_hz: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the frequencies of an estimate and half the width of the window at each, (F,) each.

    Args:
        runs: one for each reference.
        at_hz: (F,), where the estimate is asked for; None chooses.

    Raises:
        InputError: the records are too short for any window.
    """
    centres = _scan(runs)
    if not centres.size:
        raise InputError("the records are too short for an estimate; record longer.")
    halves = _half_widths(runs, centres)
    if at_hz is None:
        return _grid(centres, halves)
    known = np.isfinite(halves)
    return at_hz, np.interp(at_hz, centres[known], _narrowed(halves[known]))


def window(runs: Sequence[Run], at_hz: float, half: float) -> tuple[float, float]:
    """Return a window around a frequency, shifted where it would reach beyond the lines."""
    first = max(run.frequency_hz[0] for run in runs)
    last = min(run.frequency_hz[-1] for run in runs)
    low = min(max(at_hz - half, first), max(last - 2.0 * half, first))
    return low, min(low + 2.0 * half, last)


def _scan(runs: Sequence[Run]) -> np.ndarray:
    """Return frequencies over the band of the reference, (C,)."""
    low = max(run.frequency_hz[0] for run in runs)
    high = min(_highest(run) for run in runs)
    least = _least_half(runs, low)
    if least is None:
        return np.empty(0)
    found, at = [], low + 0.5 * least
    while at <= high:
        found.append(at)
        at += max(0.5 * least, at * np.log(10.0) / SCAN_PER_DECADE)
    return np.array(found)


def _highest(run: Run) -> float:
    power = np.abs(run.spectra[0]) ** 2
    return float(run.frequency_hz[np.flatnonzero(power >= SILENT * power.max())[-1]])


def _least_half(runs: Sequence[Run], at_hz: float) -> float | None:
    """Return half the width of the narrowest window that leaves DEGREES at a frequency."""
    half = max(0.5 * DEGREES * min(run.frequency_hz[0] for run in runs), NARROWEST * at_hz)
    last = max(run.frequency_hz[-1] for run in runs)
    while half < last:
        spans = [run.window(*window(runs, at_hz, half)) for run in runs]
        counts = [span.stop - span.start for span in spans]
        if degrees_of_freedom(counts, ORDER) >= DEGREES:
            return half
        half *= 1.08
    return None


def _half_widths(runs: Sequence[Run], centres: np.ndarray) -> np.ndarray:
    """Return half the width of the window at each frequency, (C,); NaN where none will do."""
    least = np.array([_least_half(runs, f) or np.nan for f in centres])
    halves, growing = least.copy(), np.isfinite(least)
    for step in range(1, 40):
        wider = least * GROWTH**step
        growing &= wider <= WIDEST * centres
        if not growing.any():
            break
        bends = np.full(centres.shape, np.nan)
        for i in np.flatnonzero(growing):
            fit = fit_window(runs, centres[i], window(runs, centres[i], wider[i]), ORDER)
            bends[i] = np.nan if fit is None else min(fit.bend, 1e6)
        for i in np.flatnonzero(growing):
            near = bends[(np.abs(centres - centres[i]) <= wider[i]) & np.isfinite(bends)]
            if near.size and near.mean() <= BEND + EXCESS / np.sqrt(near.size):
                halves[i] = wider[i]
            else:
                growing[i] = False
    return halves


def _grid(centres: np.ndarray, halves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the frequencies of the estimate, half a half width apart, and the half widths."""
    known = np.isfinite(halves)
    centres, halves = centres[known], halves[known]
    narrow, share = _narrowed(halves), 0.5
    while True:
        found, at = [], float(centres[0])
        while at <= centres[-1]:
            found.append(at)
            at += share * float(np.interp(at, centres, narrow))
        if len(found) <= MOST_LINES:
            grid = np.array(found)
            return grid, np.interp(grid, centres, narrow)
        share *= len(found) / MOST_LINES


def _narrowed(halves: np.ndarray) -> np.ndarray:
    """Return the least half width of each frequency and its neighbours."""
    padded = np.concatenate([halves[:1], halves, halves[-1:]])
    return np.minimum(halves, np.minimum(padded[:-2], padded[2:]))
