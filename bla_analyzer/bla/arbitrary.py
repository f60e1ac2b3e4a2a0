"""The BLA from records of any excitation: windows by rule, lines without excitation left out.

At each frequency the local polynomial fit (`local_fit`) needs a window: wide windows average noise
away, narrow ones follow resonances. The rule, for windows that grow by steps: fit polynomials of
`ORDER` and of two orders less; while the two agree at this and neighbouring frequencies as chance
lets them, the lower order would do and the window may grow. The estimate is that of the higher
order, so that what bias the rule lets through is not in it (bias-corrected inference: Calonico,
Cattaneo, Farrell, J. American Statistical Association 113, 2018). Variances are those of lines that
differ in variance, and degrees of freedom by the weights of the lines (Bell and McCaffrey, Survey
Methodology 28, 2002): distortion under a random reference is not independent of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from fjr_kit.errors import InputError
from fjr_records.spectra import RealizationSpectra

from ..results.result import BlaEstimate, LineLevels
from .local_fit import Fit, Run, degrees_of_freedom, fit_window
from .robust import INPUT_VARIANCE_LIMIT, confidence_radius, f_test
from .sensitivity import sensitivity

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
INPUT_VARIANCE_LOST = 0.1
"""Var(U)/|U|^2 from which a line is left out: discs no longer cover beyond (`robust`)."""
SILENT = 1e-16
"""Power of the reference relative to its strongest line, below which nothing was played."""
HIGHEST = 0.45
"""Highest frequency of an estimate over the sample rate."""


@dataclass(frozen=True)
class ArbitraryBla:
    """The BLA of records of one level.

    Attributes:
        bla: at the F frequencies that are excited.
        levels: at the same, amplitudes of a line of the longest record (rms over a window).
        left_out_hz: (L,), frequencies of the grid without excitation.
    """

    bla: BlaEstimate
    levels: LineLevels
    left_out_hz: np.ndarray


def run_of(records: Sequence[np.ndarray], sample_rate_hz: float) -> Run:
    """Return the spectra of one reference.

    Args:
        records: r, u, y, float64 (3, samples), one entry for each repeat; cut to the shortest.
        sample_rate_hz: rate of the samples.
    """
    samples = min(record.shape[1] for record in records)
    lines = int(HIGHEST * samples) + 1
    spectra = [_spectra(record[:, :samples], lines) for record in records]
    count = len(spectra)
    mean = sum(spectra[1:], spectra[0]) / count
    noise = None
    if count > 1:
        apart = [one[1:] - mean[1:] for one in spectra]
        noise = sum(d[:, None] * d[None].conj() for d in apart) / (count * (count - 1))
    return Run(np.arange(1, lines) * sample_rate_hz / samples, mean, count, noise)


def run_of_lines(spectra: RealizationSpectra, excited: np.ndarray) -> Run:
    """Return the excited lines of a periodic realization as a run.

    Args:
        spectra: the realization.
        excited: (F,), excited harmonics.
    """
    signals = np.stack([spectra.reference, spectra.torque, spectra.position])[:, excited]
    cross = spectra.cov_position_torque[excited]
    noise = np.array(
        [
            [spectra.var_torque[excited], cross.conj()],
            [cross, spectra.var_position[excited]],
        ]
    )
    several = spectra.periods > 1
    return Run(spectra.frequency_hz[excited], signals, spectra.periods, noise if several else None)


def _spectra(record: np.ndarray, lines: int) -> np.ndarray:
    scale = 2.0 / record.shape[1]
    return np.stack([scipy.fft.rfft(signal - signal[0])[1:lines] * scale for signal in record])


def arbitrary_bla(
    runs: Sequence[Run],
    sample_rate_hz: float,
    *,
    slope: bool = False,
    moves: Callable[[np.ndarray], np.ndarray] | None = None,
    at_hz: np.ndarray | None = None,
) -> ArbitraryBla:
    """Estimate the BLA from the runs of one level, with its uncertainty.

    Args:
        runs: one for each reference, see `run_of`.
        sample_rate_hz: rate of the samples.
        slope: whether the position in `runs` is y[k] - y[k-1] and not y[k].
        moves: tells at which frequencies (F,) the position stands above its noise, bool (F,), where
            the torque stands for the reference; elsewhere the loop would show -1/C.
        at_hz: (F,), where the estimate is asked for, whether excited or not; None chooses.

    Returns:
        G in rad/(N m) with the total variance of noise and distortion; their parts where records
        repeat a reference.

    Raises:
        InputError: too short, or no frequency at which torque and reference stand above noise.
    """
    centres = _scan(runs)
    if not centres.size:
        raise InputError("the records are too short for an estimate; record longer.")
    halves = _half_widths(runs, centres)
    grid, half_at = _grid(centres, halves) if at_hz is None else _at(at_hz, centres, halves)
    fits = [
        fit_window(runs, f, _window(runs, f, half), ORDER)
        for f, half in zip(grid, half_at, strict=True)
    ]
    asked = at_hz is not None
    kept = np.array([fit is not None and (asked or _is_excited(fit)) for fit in fits])
    if moves is not None and not asked:
        kept &= moves(grid)
    if not kept.any():
        raise InputError(
            "at no frequency does the torque follow the reference beyond noise; excite more, or "
            "map the reference of this record."
        )
    chosen = [fit for fit, keep in zip(fits, kept, strict=True) if fit is not None and keep]
    bla, levels = _estimate(runs, grid[kept], chosen, sample_rate_hz, slope)
    return ArbitraryBla(bla, levels, grid[~kept])


def _is_excited(fit: Fit) -> bool:
    """Return whether the torque stands above noise, and the position if the torque is the input."""
    power = abs(fit.torque) ** 2
    if not power > 0 or not np.isfinite(fit.variance):
        return False
    if fit.spread * fit.residual[0, 0].real > INPUT_VARIANCE_LOST * power:
        return False
    direct = fit.residual[0, 0].real <= 1e-20 * fit.power[1]
    radius = confidence_radius(np.array(fit.variance), fit.variance_degrees)
    return not direct or bool(radius < abs(fit.position))


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
        spans = [run.window(*_window(runs, at_hz, half)) for run in runs]
        counts = [span.stop - span.start for span in spans]
        if degrees_of_freedom(counts, ORDER) >= DEGREES:
            return half
        half *= 1.08
    return None


def _window(runs: Sequence[Run], at_hz: float, half: float) -> tuple[float, float]:
    """Return a window around a frequency, shifted where it would reach beyond the lines."""
    first = max(run.frequency_hz[0] for run in runs)
    last = min(run.frequency_hz[-1] for run in runs)
    low = min(max(at_hz - half, first), max(last - 2.0 * half, first))
    return low, min(low + 2.0 * half, last)


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
            fit = fit_window(runs, centres[i], _window(runs, centres[i], wider[i]), ORDER)
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


def _at(
    at_hz: np.ndarray, centres: np.ndarray, halves: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    known = np.isfinite(halves)
    return at_hz, np.interp(at_hz, centres[known], _narrowed(halves[known]))


def _narrowed(halves: np.ndarray) -> np.ndarray:
    """Return the least half width of each frequency and its neighbours."""
    padded = np.concatenate([halves[:1], halves, halves[-1:]])
    return np.minimum(halves, np.minimum(padded[:-2], padded[2:]))


def _estimate(
    runs: Sequence[Run],
    frequency_hz: np.ndarray,
    fits: Sequence[Fit],
    sample_rate_hz: float,
    slope: bool,
) -> tuple[BlaEstimate, LineLevels]:
    turn = 1.0 - np.exp(-2j * np.pi * frequency_hz / sample_rate_hz) if slope else 1.0
    g = np.array([fit.g for fit in fits]) / turn
    response = np.array([fit.torque for fit in fits])
    input_power = np.abs(response * turn) ** 2
    var_total = np.array([fit.variance for fit in fits]) / input_power
    left = np.array([fit.of_residual(fit.residual) for fit in fits]) / np.abs(turn) ** 2
    noise = (
        np.array([np.nan if fit.noise is None else fit.of_residual(fit.noise) for fit in fits])
        / np.abs(turn) ** 2
    )
    spread = np.array([fit.spread for fit in fits])
    var_noise = noise * spread / np.abs(response) ** 2
    left_of_input = np.array([fit.residual[0, 0].real for fit in fits])
    var_input = spread * left_of_input / np.abs(response) ** 2
    power = np.array([fit.power for fit in fits])
    position = np.sqrt(power[:, 2]) / np.abs(turn)
    linear = np.abs(g) ** 2 * power[:, 1]
    degrees = [fit.degrees for fit in fits], [fit.noise_degrees for fit in fits]
    radius = confidence_radius(var_total, np.array([fit.variance_degrees for fit in fits]))
    bla = BlaEstimate(
        method="local",
        realizations=len(runs),
        periods=min(run.repeats for run in runs),
        frequency_hz=frequency_hz,
        g=g,
        var_total=var_total,
        var_noise=var_noise,
        var_nonlinear=len(runs) * (var_total - var_noise),
        nonlinear_p_value=f_test(left, noise, 2 * np.array(degrees[0]), 2 * np.array(degrees[1])),
        radius_95=radius,
        coherence=linear / (linear + left),
        input_relative_variance=var_input,
        reliable=var_input <= INPUT_VARIANCE_LIMIT,
        sensitivity=sensitivity(g, radius, response, np.ones(g.size)),
    )
    levels = LineLevels(
        frequency_hz=frequency_hz,
        reference=np.sqrt(power[:, 0]),
        torque=np.sqrt(power[:, 1]),
        position=position,
        corrected=position,
        smoothed=position,
        noise=np.sqrt(noise),
    )
    return bla, levels
