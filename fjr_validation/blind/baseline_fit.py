"""Parts that the plain baselines share: line residuals, their noise, a damped Gauss-Newton fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fjr_records.periodic import read_experiment
from fjr_records.spectra import line_spectrum
from gap_diagnosis.model.simulated_rig import Model, Simulator
from gap_diagnosis.outcome.diagnosis import Gap
from gap_diagnosis.which.search_space import Scales

_REPEATABILITY = 1e-3
_NEIGHBOURS = 10
_STEP = 2e-3


class Problem:
    """A recorded experiment to be met by a model, line by line, on all realizations.

    Attributes:
        nominal: nominal bare parameters.
        equations: how many real residuals there are.
        scales: what is usual in the record.
    """

    def __init__(self, folder: Path, nominal: Mapping[str, float]) -> None:
        """Read the bags; each line's noise is that of its neighbours, plus 0.1 % of the signal."""
        self.nominal = {name: float(value) for name, value in nominal.items()}
        recorded = read_experiment(folder)
        self._simulator = Simulator(recorded)
        self._lines = recorded.lines
        spectra = [r.spectrum(r.position, self._lines) for r in recorded.realizations]
        self._measured = np.array([s.mean(0) for s in spectra])
        self.scales = Scales.of_experiment(recorded, self.nominal)
        self._rms = np.array([np.std(r.kept(r.position)) for r in recorded.realizations])
        self._sigma = np.array([_line_sigma(s) for s in spectra])
        self.equations = 2 * self._measured.size

    def residual(self, values: Mapping[str, float]) -> np.ndarray:
        """Return (measured - simulated)/sigma of all lines as reals; inf if the motion diverges."""
        model = Model(
            {name: values[name] for name in self.nominal},
            {name: value for name, value in values.items() if name not in self.nominal},
        )
        difference = self._measured - line_spectrum(self._simulator.signals(model)[0], self._lines)
        parts = np.concatenate([difference.real / self._sigma, difference.imag / self._sigma])
        return np.where(np.isfinite(parts), parts, np.inf).ravel() * np.sqrt(2.0)

    def within(self, name: str, value: float) -> float:
        """Return the value of a parameter within its range; bare parameters stay positive."""
        low, high = 1e-9, np.inf
        if name not in self.nominal:
            low, high = self.scales.bounds(name)
            low = self.scales.negligible(name) or low
        return float(np.clip(value, low, high))

    def gap(self, residual: np.ndarray) -> Gap:
        """Return the gap that a residual leaves, on the data of the fit."""
        real, imag = np.split(residual.reshape(2 * len(self._rms), -1) / np.sqrt(2.0), 2)
        power = np.sum((real**2 + imag**2) * self._sigma**2, axis=1) / 2.0
        return Gap(
            nrmse_position=float(np.sqrt(np.mean(power / self._rms**2))),
            nrmse_torque=None,
            chi2_per_dof=float(np.mean(residual**2)),
        )


def _line_sigma(spectra: np.ndarray) -> np.ndarray:
    """Return the standard deviation of each line of the mean over periods, float64 (lines,)."""
    periods = spectra.shape[0]
    noise = np.var(spectra, axis=0, ddof=1) if periods > 1 else np.zeros(spectra.shape[1])
    window = np.ones(2 * _NEIGHBOURS + 1)
    smooth = np.convolve(noise, window, "same") / np.convolve(np.ones(noise.size), window, "same")
    signal = np.mean(np.abs(spectra.mean(0)) ** 2)
    return np.sqrt(smooth / periods + _REPEATABILITY**2 * signal)


def jacobian(
    problem: Problem, values: Mapping[str, float], free: Sequence[str], residual: np.ndarray
) -> np.ndarray:
    """Return d residual / d (value over scale), float64 (equations, free)."""
    columns = []
    for name in free:
        step = _STEP * scale(name, values)
        columns.append((problem.residual({**values, name: values[name] + step}) - residual) / _STEP)
    return np.array(columns).T


def scale(name: str, values: Mapping[str, float]) -> float:
    """Return what a free value is measured in: itself, or 1 rad of a phase."""
    return 1.0 if name.endswith(("phase_rad", "angle_rad")) else abs(values[name]) or 1e-3


def fit(
    problem: Problem,
    start: Mapping[str, float],
    free: Sequence[str],
    iterations: int = 8,
    jacobian_at_start: np.ndarray | None = None,
) -> tuple[dict[str, float], np.ndarray]:
    """Return fitted values and their residual: Levenberg-Marquardt within the parameters' ranges.

    Args:
        problem: what to meet.
        start: all values.
        free: the names that may change.
        iterations: most steps accepted.
        jacobian_at_start: columns that are known already, those of the first names in `free`.
    """
    values, residual = dict(start), problem.residual(start)
    damping, known = 1e-3, jacobian_at_start
    for _ in range(iterations):
        missing = free if known is None else free[known.shape[1] :]
        fresh = jacobian(problem, values, missing, residual)
        matrix = fresh if known is None else np.hstack([known, fresh])
        known = None
        if not np.isfinite(matrix).all():
            break
        better = _step(problem, values, residual, free, matrix, damping)
        if better is None:
            break
        gain = residual @ residual - better[1] @ better[1]
        values, residual, damping = better
        if gain < 1e-3 * (residual @ residual):
            break
    return values, residual


def _step(
    problem: Problem,
    values: dict[str, float],
    residual: np.ndarray,
    free: Sequence[str],
    matrix: np.ndarray,
    damping: float,
) -> tuple[dict[str, float], np.ndarray, float] | None:
    """Return values, residual and damping after a step that helps; None if there is none."""
    normal, slope = matrix.T @ matrix, matrix.T @ residual
    for _ in range(8):
        step = -np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), slope, rcond=None)[0]
        trial = dict(values)
        for name, change in zip(free, step, strict=True):
            trial[name] = problem.within(name, values[name] + change * scale(name, values))
        after = problem.residual(trial)
        if after @ after < residual @ residual:
            return trial, after, max(0.1 * damping, 1e-8)
        damping *= 10.0
    return None
