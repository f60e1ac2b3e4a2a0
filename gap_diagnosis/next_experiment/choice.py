"""The next experiment: which one best separates the explanations that the data leave.

For each feasible trial and each pair of explanations, one plays the rig and the other is refitted
to it, all its parameters free but held by the data that are already there; what still differs, in
standard deviations of the noise, is the separation that the trial promises. A pair counts by its
weaker direction. Some pairs no experiment separates (a torque bias is the same as a Coulomb
friction that depends on direction); so that trial is best that separates most pairs, and of those
the one that separates them best for its rig time.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from controller_node.law import law_of
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum
from fjr_sim_node.simulation.closed_loop import simulate

from ..fits.comparison import CellFit
from ..model.rig_model import Model
from ..model.simulated_rig import last_samples, run_parallel
from ..outcome.cause_words import tells
from ..outcome.diagnosis import NextExperiment
from .trials import Trial, trials

LEAST_SIGMA = 10.0
"""A pair counts as separated from this on: the chi-square of an effect that is called for."""
ENOUGH_SIGMA = 40.0
"""More than that is not worth rig time."""
TORQUE_MARGIN = 2.5
"""A trial may ask for so many times the torque of the record."""
MOST_RIVALS = 4
_STEP = 1e-4
_MODEL_ERROR = 1e-3  # of a line: error of the simulation itself
_REFINED = 2  # trials whose separation is computed with refits that are not only linear
_PASSES = 3
_WORTH_A_PASS = 0.99  # of what differed before: a refit that leaves more ends
_FAR = 4.0 * ENOUGH_SIGMA  # so does one that leaves more than this

Pair = tuple[int, int]
_Promise = tuple[Trial, Mapping[Pair, float]]
"""A trial, and the separation of each pair that it promises, in sigma."""


def next_experiment(
    recorded: RecordedExperiment, noise_std: np.ndarray, fits: Sequence[CellFit], misfit: float
) -> NextExperiment | None:
    """Choose the experiment that best separates explanations, for the rig time it costs.

    Args:
        recorded: the experiment so far.
        noise_std: `NoiseLevels.of_outputs`, (realizations, outputs, lines), rad.
        fits: the explanations that the data leave, best first; at most four are compared.
        misfit: mean squared error over noise that the best one leaves; counts as noise.

    Returns:
        None with fewer than two explanations, where the loop cannot be simulated, or where no
        feasible trial promises to separate any of them.
    """
    rivals = list(fits)[:MOST_RIVALS]
    if len(rivals) < 2 or not recorded.repeatable:
        return None
    bench = _Bench(recorded, noise_std, rivals, misfit)
    refined: list[_Promise] = []
    for trial, linear in _most_promising(bench, trials(recorded, bench.rigid)):
        if any(bench.merit(*one) >= bench.merit(trial, linear) for one in refined):
            break
        refined.append((trial, bench.refitted(trial)))
    if not refined:
        return None
    best, sigmas = max(refined, key=lambda one: bench.merit(*one))
    told = _told(sigmas)
    if not told:
        return None
    names = [" + ".join(fit.effects) or "parameters" for fit in rivals]
    apart = [fit.effects for fit in rivals]
    return NextExperiment(
        kind=best.kind,
        description=f"{best.description} {tells([*sigmas], told, apart)}",
        separates=[name for i, name in enumerate(names) if any(i in pair for pair in told)],
        predicted_sigma=min(sigmas[pair] for pair in told),
        rig_time_s=bench.rig_time_s(best),
        settings=dict(best.settings),
    )


def _most_promising(bench: _Bench, tried: Sequence[Trial]) -> list[_Promise]:
    """Return the feasible trials that separate most with linear refits, the best first.

    A refit only brings rivals nearer, so what they differ by without one is a bound: a trial whose
    bound is no better than what others are sure of needs none.
    """
    bounds = [(t, bound) for t in tried if (bound := bench.without_refit(t))]
    found: list[_Promise] = []
    for trial, bound in sorted(bounds, key=lambda one: bench.merit(*one), reverse=True):
        if len(found) == _REFINED and bench.merit(trial, bound) <= bench.merit(*found[-1]):
            break
        found.append((trial, bench.linear(trial)))
        found = sorted(found, key=lambda one: bench.merit(*one), reverse=True)[:_REFINED]
    return found


def _told(sigmas: Mapping[Pair, float]) -> list[Pair]:
    """Return the pairs that are separated."""
    return [pair for pair, sigma in sigmas.items() if sigma >= LEAST_SIGMA]


@dataclass(frozen=True)
class _Response:
    """A rival in a trial: lines of its outputs, and how they change with its parameters."""

    lines: np.ndarray  # complex (outputs, lines)
    slopes: np.ndarray  # complex (parameters, outputs, lines)


class _Bench:
    """Simulates trials with the rivals; the first realization of a trial stands for all."""

    def __init__(
        self,
        recorded: RecordedExperiment,
        noise_std: np.ndarray,
        fits: Sequence[CellFit],
        misfit: float,
    ) -> None:
        description = recorded.experiment
        self._rate = description.sample_rate_hz
        self._law = law_of(description.controller, self._rate)
        self._samples = description.samples_per_period
        self._periods = description.periods
        self._transient = max(description.transient_periods, 1)
        torques = [float(np.abs(r.torque).max()) for r in recorded.realizations]
        self._most_torque = TORQUE_MARGIN * max(torques)
        self._noise = np.median(noise_std, axis=0)
        self._fits = list(fits)
        self._left = max(1.0, misfit) ** 0.5
        # What the recorded data say of each rival's parameters, by what it leaves.
        self._held = [np.linalg.qr(f.solution.jacobian)[1] for f in fits]
        self._responses: dict[tuple[str, int], _Response] = {}

    @property
    def rigid(self) -> bool:
        """Whether the rig is a rigid axis."""
        return self._fits[0].model.rigid

    def rig_time_s(self, trial: Trial) -> float:
        """Return what a trial costs (s)."""
        played = (self._discarded(trial) + self._periods) * self._samples / self._rate
        return trial.setup_s + played * len(trial.periods_rad)

    def merit(self, trial: Trial, sigmas: Mapping[Pair, float]) -> tuple[float, ...]:
        """Return what trials are compared by: pairs separated, then separation for its cost.

        Twice the rig time averages twice the noise, so separation grows with the root of it. The
        greater any separation, the greater is the merit.
        """
        told = _told(sigmas)
        least = min((sigmas[pair] for pair in told), default=max(sigmas.values()))
        return len(told), min(least, ENOUGH_SIGMA) / self.rig_time_s(trial) ** 0.5

    def without_refit(self, trial: Trial) -> dict[Pair, float] | None:
        """Return what the rivals of each pair differ by as they are; None if it is not feasible."""
        runs = self._run(trial, [fit.model for fit in self._fits])
        if not np.isfinite(runs).all() or np.abs(runs[:, 1]).max() > self._most_torque:
            return None
        lines = self._lines_of(trial, runs)
        off = [_parts((lines - own) * self._weight(trial, own)) for own in lines]
        return self._weaker(trial, lambda a, b: float(np.linalg.norm(off[a][b])))

    def linear(self, trial: Trial) -> dict[Pair, float]:
        """Return the separation of each pair with linear refits."""
        return self._weaker(trial, lambda a, b: self._linear(trial, a, b))

    def refitted(self, trial: Trial) -> dict[Pair, float]:
        """Return the separation of each pair with simulated refits."""
        return self._weaker(trial, lambda a, b: self._refit(trial, a, b))

    def _weaker(self, trial: Trial, separation) -> dict[Pair, float]:
        """Return the smaller of the separations of both directions, over all realizations.

        Where one direction does not separate a pair, the other one is not looked at.
        """
        found, more = {}, len(trial.periods_rad) ** 0.5
        for a, b in itertools.combinations(range(len(self._fits)), 2):
            found[a, b] = more * separation(a, b)
            if found[a, b] >= LEAST_SIGMA:
                found[a, b] = min(found[a, b], more * separation(b, a))
        return found

    def _discarded(self, trial: Trial) -> int:
        return self._transient + (1 if trial.offset_rad else 0)

    def _run(self, trial: Trial, models: Sequence[Model]) -> np.ndarray:
        """Return the last period of y, u and q, float64 (models, 3, N); NaN if it diverges."""
        reference = trial.references(self._discarded(trial) + 1)[0]

        def one(model: Model) -> np.ndarray:
            p, e = model.plant_coefficients, model.effect_coefficients
            try:
                run = simulate(reference, self._rate, p, self._law, None, e)
            except InputError:
                return np.full((3, self._samples), np.nan)
            return last_samples(model, run, self._samples)

        return np.array(run_parallel(one, [trial.loaded(model) for model in models]))

    def _lines(self, trial: Trial, models: Sequence[Model]) -> np.ndarray:
        """Return the lines of y (and q) of each model, complex (models, outputs, lines)."""
        return self._lines_of(trial, self._run(trial, models))

    def _lines_of(self, trial: Trial, runs: np.ndarray) -> np.ndarray:
        outputs = [0, 2][: self._noise.shape[0]]
        return line_spectrum(runs[:, outputs], trial.lines)

    def _response(self, trial: Trial, rival: int) -> _Response:
        """Return the response of a rival as it was fitted to the record; simulated once."""
        known = trial.description, rival
        if known not in self._responses:
            fit = self._fits[rival]
            x, steps = fit.solution.x, _steps(fit, fit.solution.x)
            points = np.vstack([x, x + np.diag(steps)])
            lines = self._lines(trial, [fit.space.model(point) for point in points])
            slopes = (lines[1:] - lines[0]) / steps[:, None, None]
            self._responses[known] = _Response(lines[0], slopes)
        return self._responses[known]

    def _begun(self, trial: Trial, truth: int, rival: int) -> tuple[np.ndarray, np.ndarray]:
        """Return by what a rival differs before its refit, and the slopes of that, in sigma."""
        target, mine = self._response(trial, truth).lines, self._response(trial, rival)
        weight = self._weight(trial, target)
        slopes = np.vstack([_parts(mine.slopes * weight).T, self._held[rival]])
        d = _parts((mine.lines - target) * weight)
        return np.concatenate([d, np.zeros(len(slopes) - d.size)]), slopes

    def _linear(self, trial: Trial, truth: int, rival: int) -> float:
        """Return what differs after a linear refit of the rival to the truth, in sigma."""
        d, slopes = self._begun(trial, truth, rival)
        return float(np.linalg.norm(d - slopes @ np.linalg.lstsq(slopes, d, rcond=1e-9)[0]))

    def _refit(self, trial: Trial, truth: int, rival: int) -> float:
        """Return what differs after the rival was refitted to the truth, in sigma.

        The refit ends once it is clear whether the two are separated.
        """
        fit, more = self._fits[rival], len(trial.periods_rad) ** 0.5
        target = self._response(trial, truth).lines
        weight = self._weight(trial, target)
        low, high = fit.space.bounds()

        def differences(points: np.ndarray) -> np.ndarray:
            """Return weighted differences, and what the record says against each point."""
            lines = self._lines(trial, [fit.space.model(point) for point in points]) - target
            held = (points - fit.solution.x) @ self._held[rival].T
            return np.nan_to_num(np.hstack([_parts(lines * weight), held]), nan=1e6)

        x = fit.solution.x
        d, slopes = self._begun(trial, truth, rival)
        for later in range(_PASSES):
            if later:
                steps = _steps(fit, x)
                slopes = ((differences(x + np.diag(steps)) - d) / steps[:, None]).T
            change = np.linalg.lstsq(slopes, -d, rcond=1e-9)[0]
            left = float(np.linalg.norm(d + slopes @ change))
            if more * left < LEAST_SIGMA:
                return left
            points = np.clip(x + np.array([[1.0], [0.3], [0.1]]) * change, low, high)
            found = differences(points)
            before, costs = float(d @ d), np.einsum("ij,ij->i", found, found)
            best = int(np.argmin(costs))
            if costs[best] < before:
                x, d = points[best], found[best]
            if costs[best] > min(_WORTH_A_PASS**2 * before, (_FAR / more) ** 2):
                break
        return float(np.linalg.norm(d))

    def _weight(self, trial: Trial, target: np.ndarray) -> np.ndarray:
        """Return the inverse standard deviation of the lines of a trial, as in the misfit."""
        noise = self._noise
        beyond = max(trial.lines - noise.shape[1], 0)
        noise = np.concatenate([noise, np.repeat(noise[:, -1:], beyond, axis=1)], axis=1)
        weight = np.sqrt(2.0) / np.hypot(noise[:, : trial.lines], _MODEL_ERROR * np.abs(target))
        weight[:, 0] /= np.sqrt(2.0)
        weight[1:, 0] = 0.0
        return weight / self._left


def _steps(fit: CellFit, x: np.ndarray) -> np.ndarray:
    """Return steps of finite differences that stay within the bounds."""
    return np.where(x + _STEP <= fit.space.bounds()[1], _STEP, -_STEP)


def _parts(lines: np.ndarray) -> np.ndarray:
    """Return real and imaginary parts of lines (..., outputs, lines), as (..., errors)."""
    parts = np.concatenate([lines.real, lines[..., 1:].imag], axis=-1)
    return parts.reshape(*lines.shape[:-2], -1)
