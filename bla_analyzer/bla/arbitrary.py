"""The BLA from records of any excitation: local fits at each frequency that is excited.

At each frequency a local polynomial fit (`local_fit`) over a window that is found by rule
(`windows`). Variances are those of lines that differ in variance, and degrees of freedom by the
weights of the lines (Bell and McCaffrey, Survey Methodology 28, 2002): distortion under a random
reference is not independent of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from fjr_kit.errors import InputError
from fjr_records.spectra import RealizationSpectra

from ..results.result import BlaEstimate, LineLevels
from .local_fit import Fit, Run, fit_window
from .robust import INPUT_VARIANCE_LIMIT, confidence_radius, f_test
from .sensitivity import sensitivity
from .windows import ORDER, frequencies, window

INPUT_VARIANCE_LOST = 0.1
"""Var(U)/|U|^2 from which a line is left out: discs no longer cover beyond (`robust`)."""
LIKE_TRANSIENT = 1e3
"""Variance of G, over that under an input of the same power spread evenly over the window, from
which the torque is taken for the transient: what a sweep plays as a record begins or ends has as
smooth a spectrum as a transient, and only the loop's answer to noise is left to tell G by."""
ANSWER_TO_NOISE = 0.1
"""Power of the noise of the position over what the torque moves it by, from which too much of the
torque may be the loop's answer to that noise: the root of it is the greatest bias over |G|."""
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
    grid, half_at = frequencies(runs, at_hz)
    fits = [
        fit_window(runs, f, window(runs, f, half), ORDER)
        for f, half in zip(grid, half_at, strict=True)
    ]
    asked = at_hz is not None
    kept = np.array([fit is not None and (asked or _is_excited(fit)) for fit in fits])
    if moves is not None and not asked:
        kept &= moves(grid)
    if not kept.any():
        raise InputError(
            "at no frequency does the axis follow the torque beyond noise; excite more, or record "
            "and map a reference."
            if slope
            else "at no frequency does the torque follow the reference beyond noise; excite more, "
            "or map the reference of this record."
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
    return not direct or _moves_of_itself(fit)


def _moves_of_itself(fit: Fit) -> bool:
    """Return whether the torque, which stands for the reference, is more than answers to noise."""
    even = fit.spread * fit.lines
    moved, noise = abs(fit.position) ** 2, even / (ORDER + 1) * fit.residual[1, 1].real
    if even * fit.power[1] > LIKE_TRANSIENT or noise > ANSWER_TO_NOISE * moved:
        return False
    radius = confidence_radius(np.array(fit.variance), fit.variance_degrees)
    return bool(radius < abs(fit.position))


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
