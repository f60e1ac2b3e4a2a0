"""Calibration certificate: do predicted variances agree with repeated experiments?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.stats import binom
from scipy.stats import f as f_distribution

from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT, robust_bla, turned
from fjr_bringup.design.measured import periods_of, simulate_level
from fjr_kit.tasks import Arrays, Task
from fjr_records.lines import Grid
from fjr_records.realization import Realization, read_realization
from fjr_sim_node.simulation.simulator import run_realization

from .levels import campaign_of
from .settings import Settings

M, P = 7, 2
CHUNKS = 8
NOISE_STD_RAD = 1e-4
"""Noise that is neither far below nor far above distortion over the band."""
PERIODS = (2, 4, 8)
GROUPS = (2, 4, 7, 14)


def experiments(amplitude_rad: float, first: int, count: int) -> dict[str, Any]:
    """Run whole experiments of M realizations and P periods, new phases and noise in each.

    Returns:
        frequency_hz: (F,); torque, position: complex (count M, F), turned; predicted, radius:
        (count, F) variance and 95 % radius by the robust method; g: complex (count, F);
        fast_predicted, fast_radius: (count M, F).
    """
    campaign = campaign_of(
        amplitude_rad, (first + count) * M, P, simulator={"noise_std_rad": NOISE_STD_RAD}
    )
    level = simulate_level(campaign, 0, range(first * M, (first + count) * M))
    lines, spectra = level.lines, level.spectra
    blas = [robust_bla(spectra[i * M : (i + 1) * M], lines.excited) for i in range(count)]
    fast = [fast_bla(one, lines) for one in spectra]
    torque, position = turned(spectra, lines.excited)
    return {
        "frequency_hz": blas[0].frequency_hz,
        "torque": torque,
        "position": position,
        "g": np.array([bla.g for bla in blas]),
        "predicted": np.array([bla.var_total for bla in blas]),
        "radius": np.array([bla.radius_95 for bla in blas]),
        "fast_predicted": np.array([bla.var_total for bla in fast]),
        "fast_radius": np.array([bla.radius_95 for bla in fast]),
    }


def noise_runs(amplitude_rad: float, first: int, count: int) -> dict[str, Any]:
    """Play one realization again and again, with new noise each time.

    Returns:
        g_P: complex (count, F) from the first P periods; predicted_P: (count, F), the noise
        variance that the periods predict.
    """
    found: dict[str, list[np.ndarray]] = {}
    for run in range(first, first + count):
        simulator = {"noise_std_rad": NOISE_STD_RAD, "noise_seed": run + 1}
        campaign = campaign_of(amplitude_rad, 1, max(PERIODS), simulator=simulator)
        experiment = campaign.experiment(0, 0)
        trajectory = run_realization(campaign.values["simulator"], experiment)
        for periods in PERIODS:
            one = _prefix(trajectory, experiment, periods)
            bla = fast_bla(one.spectra, Grid.of(experiment).lines)
            found.setdefault(f"g_{periods}", []).append(bla.g)
            found.setdefault(f"predicted_{periods}", []).append(bla.var_noise)
    return {name: np.array(values) for name, values in found.items()}


def _prefix(trajectory: Any, experiment: Any, periods: int) -> Realization:
    grid = Grid.of(experiment.model_copy(update={"periods": periods}))
    blocks = periods_of(trajectory, grid.samples_per_period)
    return read_realization("prefix", 0, 0, blocks, grid)


def tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return both kinds of repetition in chunks."""
    found = []
    for name, function, total in (
        ("certificate", experiments, settings.experiments),
        ("noise_runs", noise_runs, settings.noise_repeats),
    ):
        size = total // CHUNKS
        for chunk in range(CHUNKS):
            parameters = {"amplitude_rad": amplitude_rad, "first": chunk * size, "count": size}
            found.append(Task(f"{name}_{chunk}", function, parameters))
    return found


def joined(results: Mapping[str, Arrays], name: str) -> Arrays:
    """Return the arrays of all chunks together."""
    chunks = [results[f"{name}_{chunk}"] for chunk in range(CHUNKS)]
    return {
        key: chunks[0][key]
        if key == "frequency_hz"
        else np.concatenate([chunk[key] for chunk in chunks])
        for key in chunks[0]
    }


def empirical(g: np.ndarray) -> np.ndarray:
    """Return the variance of a complex estimate over repetitions, (F,), of (repetitions, F)."""
    return np.sum(np.abs(g - g.mean(axis=0)) ** 2, axis=0) / (len(g) - 1)


def bounds(repetitions: int, degrees: float) -> tuple[float, float]:
    """Return the 95 % bounds of empirical over predicted variance.

    Args:
        repetitions: behind the empirical variance, each with two real degrees of freedom.
        degrees: complex degrees of freedom of the mean predicted variance.
    """
    quantiles = f_distribution.ppf([0.025, 0.975], 2 * (repetitions - 1), 2 * degrees)
    return float(quantiles[0]), float(quantiles[1])


def coverage_bounds(experiments_count: int) -> tuple[float, float]:
    """Return the 95 % bounds of the fraction of 95 % discs that hold the truth."""
    low, high = binom.ppf([0.025, 0.975], experiments_count, 0.95) / experiments_count
    return float(low), float(high)


class Certificate:
    """Ratios of empirical to predicted variance and coverage of discs, line by line.

    Attributes:
        frequency_hz: (F,).
        reliable: bool (F,), Var(U)/|U|^2 of one realization (fast) within its limit.
        fast_degrees: complex degrees of freedom that the scatter of one predicted variance of the
            fast method shows (median).
        ratio: {name: (F,)}, of all experiments of the robust method, of all realizations of the
            fast one (each is one experiment of it), and of all runs with new noise.
        limits: 95 % chi-square (F) bounds by the same names.
        covered: {name: (F,)}, fraction of the experiments whose own 95 % disc holds the mean of
            all; covered_limits: 95 % (binomial) bounds.
    """

    def __init__(self, results: Mapping[str, Arrays]) -> None:
        """Evaluate the results of `tasks`."""
        data, repeated = joined(results, "certificate"), joined(results, "noise_runs")
        self.frequency_hz = data["frequency_hz"]
        torque, position = data["torque"], data["position"]
        relative = torque.var(axis=0) / np.abs(torque.mean(axis=0)) ** 2
        self.reliable = relative <= INPUT_VARIANCE_LIMIT
        count, runs, noise_runs_count = len(data["g"]), len(position), len(repeated["g_2"])
        every, predicted = position / torque, data["fast_predicted"]
        scatter = predicted.var(axis=0) / predicted.mean(axis=0) ** 2
        self.fast_degrees = float(1.0 / np.median(scatter[self.reliable]))
        self.ratio = {
            "robust": empirical(data["g"]) / data["predicted"].mean(axis=0),
            "fast": empirical(every) / predicted.mean(axis=0),
            "noise": empirical(repeated["g_2"]) / repeated["predicted_2"].mean(axis=0),
        }
        self.limits = {
            "robust": bounds(count, count * (M - 1)),
            "fast": bounds(runs, runs * self.fast_degrees),
            "noise": bounds(noise_runs_count, noise_runs_count * (P - 1)),
        }
        truth = position.mean(axis=0) / torque.mean(axis=0)
        within = np.abs(every - truth) <= data["fast_radius"]
        self.covered = {
            "robust": np.mean(np.abs(data["g"] - truth) <= data["radius"], axis=0),
            "fast": within.mean(axis=0),
        }
        self.covered_limits = {
            "robust": coverage_bounds(count),
            "fast": coverage_bounds(runs),
        }
        self.laws = _laws(torque, position, repeated, self.reliable)

    def inside(self, name: str) -> float:
        """Return the percentage of reliable lines whose ratio lies within the bounds."""
        return self._inside(self.ratio[name], self.limits[name])

    def discs_inside(self, name: str) -> float:
        """Return the percentage of reliable lines whose coverage lies within the bounds."""
        return self._inside(self.covered[name], self.covered_limits[name])

    def _inside(self, values: np.ndarray, limits: tuple[float, float]) -> float:
        chosen = values[self.reliable]
        return float(100.0 * np.mean((chosen >= limits[0]) & (chosen <= limits[1])))

    @property
    def fast_bias(self) -> float:
        """Rms bias over reliable lines of the fast method's variance, that of chance taken off."""
        spread = np.mean(np.log(self.ratio["fast"][self.reliable]) ** 2)
        low, high = self.limits["fast"]
        return float(np.sqrt(max(spread - (np.log(high / low) / (2.0 * 1.96)) ** 2, 0.0)))


def _laws(
    torque: np.ndarray, position: np.ndarray, repeated: Arrays, reliable: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray, float, float]]:
    """Return (x, variance, slope, its standard error) of the 1/M and the 1/(MP) law."""
    total = []
    for size in GROUPS:
        sets = len(torque) // size
        shape = (sets, size, -1)
        u = torque[: sets * size].reshape(shape).mean(axis=1)
        y = position[: sets * size].reshape(shape).mean(axis=1)
        total.append(empirical(y / u)[reliable])
    noise = [empirical(repeated[f"g_{periods}"])[reliable] for periods in PERIODS]
    return {
        "1/M": _slope(np.array(GROUPS, float), np.array(total)),
        "1/(MP)": _slope(np.array(PERIODS, float), np.array(noise)),
    }


def _slope(x: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Fit log variance over log x at every line; return also the mean slope and its error."""
    slopes = np.polyfit(np.log(x), np.log(variance), 1)[0]
    geometric = np.exp(np.log(variance).mean(axis=1))
    return x, geometric, float(slopes.mean()), float(slopes.std(ddof=1) / np.sqrt(slopes.size))
