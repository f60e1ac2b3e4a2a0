"""Steady periods repeated by a model: in the loop that was recorded, or as a prediction."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from controller_node.law import law_of
from fjr_kit.errors import InputError
from fjr_records.noise import NoiseLevels, noise_levels
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_sim_node.simulation import rig
from fjr_sim_node.simulation.closed_loop import State, Trajectory, simulate, simulate_law

from . import prediction
from .rig_model import Model, too_stiff

Signals = tuple[np.ndarray, np.ndarray]
"""One steady period of y (rad) and of u (N m) of every realization, float64 (n, N) each."""

_SETTLED = (1e-6, 1e-4)
"""Least and greatest part of the rms position that is left of a transient; between them the median
standard deviation of a line, for a tail that lies in one line must not count there."""
_SLOWER = 1.5  # times as long as it took the model that is simulated first
_Result = TypeVar("_Result")
_POOL = ThreadPoolExecutor(len(os.sched_getaffinity(0)))


def run_parallel(run: Callable[[Any], _Result], jobs: Sequence[Any]) -> list[_Result]:
    """Return the results of jobs, run on all cores; the kernels release the interpreter lock."""
    return list(_POOL.map(run, jobs))


def last_samples(model: Model, run: Trajectory, samples: int) -> np.ndarray:
    """Return y, u and q at the end of a model's run, float64 (3, samples); of one body, q is th."""
    link = run.motor if model.one_body else run.link
    return np.array([signal[-samples:] for signal in (run.position, run.torque, link)])


class Simulator:
    """Repeats a recorded experiment with a model, without noise.

    Where controller and references are known, the loop itself is repeated from rest, one period
    longer than the transient, and the last period is then periodic. Else the mean recorded period
    of u drives the model, held to that of y by an observer (`prediction`).

    A model that is near to another one is sooner in its steady state from that one's than from
    rest (`begin_near`), unless it remembers for longer.
    """

    def __init__(self, recorded: RecordedExperiment) -> None:
        """Take the signals that drive the simulation."""
        description = recorded.experiment
        self.sample_rate_hz = description.sample_rate_hz
        self.repeats = recorded.repeatable
        self._recorded = recorded
        self._samples = description.samples_per_period
        self._outputs = 2 if recorded.has_link else 1
        if self.repeats:
            self._law = law_of(description.controller, self.sample_rate_hz)
        else:
            self._observer = prediction.observer(recorded)
        self._periods = max(description.transient_periods, 1) + 1
        self._inputs = [self._mean_inputs(realization) for realization in recorded.realizations]
        self._elapsed = [realization.experiment.elapsed_s for realization in recorded.realizations]
        self._speeds = [
            float(np.std(np.diff(r.position.ravel())) * self.sample_rate_hz)
            for r in recorded.realizations
        ]
        self._torques = [float(np.abs(r.torque).max()) for r in recorded.realizations]
        self._begins: dict[int, tuple[int, State]] = {}
        self._added: np.ndarray | None = None

    def adding(self, signals: np.ndarray) -> Simulator:
        """Return a simulator that adds signals to y, u and q of models whose encoder is smooth.

        Args:
            signals: what rounding adds on the average, float64 (realizations, 3, N).
        """
        other = copy.copy(self)
        other._added = signals
        return other

    @property
    def samples(self) -> int:
        """How many samples of a realization are simulated from rest."""
        return self._periods * self._samples

    def begin_near(self, model: Model, noise_std: np.ndarray, which: Sequence[int]) -> None:
        """Let `many` begin realizations in the steady state of a model, before the last period.

        How long before says the model's own way from rest: when its first period has come near
        the last one, nearer where there is less noise.

        Args:
            model: the one to begin near.
            noise_std: `NoiseLevels.of_outputs`, (realizations, outputs, lines), rad.
            which: indices of the realizations; all others are played from rest.
        """
        noise = np.median(noise_std[:, 0], axis=1)
        begins = run_parallel(lambda index: self._begin_near(model, index, noise[index]), which)
        self._begins = {i: begin for i, begin in zip(which, begins, strict=True) if begin}

    def _begin_near(self, model: Model, index: int, noise: float) -> tuple[int, State] | None:
        """Return from which sample on a realization has to be simulated, and the state before."""
        inputs, elapsed = self._inputs[index], self._elapsed[index]
        if self._stiff(model, index):
            return None
        try:
            first = self._simulated(model, inputs, elapsed)
            off = np.abs(first.position[: self._samples] - first.position[-self._samples :])
            rms = float(np.std(first.position[-self._samples :]))
            limit = min(max(noise, _SETTLED[0] * rms), _SETTLED[1] * rms)
            settled = int(_SLOWER * np.flatnonzero(np.append(True, off > limit))[-1])
            begin = self.samples - self._samples - settled
            if begin <= 0:
                return None
            until = self._simulated(model, tuple(signal[:begin] for signal in inputs), elapsed)
        except InputError:
            return None
        now = elapsed + begin / self.sample_rate_hz
        middle = float(first.motor[-self._samples :].mean())
        rig.complete(until.end.rig, float(until.torque[-1]), now, middle)
        return begin, until.end

    def many(self, models: Sequence[Model], which: Sequence[int] | None = None) -> np.ndarray:
        """Return one steady period of the measured outputs for each model.

        Args:
            models: the models to run.
            which: indices of the realizations to repeat; None for all.

        Returns:
            float64 (models, n, outputs, N) in rad; y, and q if the rig has a second encoder. A
            motion that diverges, or that would take too long to play, gives NaN.
        """
        runs = self._run(models, which, self._begins)
        return runs[:, :, [0, 2][: self._outputs]]

    def signals(self, model: Model, which: Sequence[int] | None = None) -> Signals:
        """Return one steady period of y and of u."""
        run = self._run([model], which)[0]
        return run[:, 0], run[:, 1]

    def motion(
        self, model: Model, which: Sequence[int]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return one steady period of y (rad), u (N m) and q (rad), float64 (n, N) each."""
        run = self._run([model], which)[0]
        return run[:, 0], run[:, 1], run[:, 2]

    def disturbed(self, model: Model, index: int, noise: np.ndarray) -> np.ndarray:
        """Return one steady period of y, u and q from rest with noise of the encoder.

        Args:
            model: the model.
            index: of the realization, whose loop is known.
            noise: (samples,), rad.

        Returns:
            float64 (3, N); NaN where the motion diverges.
        """
        try:
            run = self._simulated(model, self._inputs[index], self._elapsed[index], noise=noise)
        except InputError:
            return np.full((3, self._samples), np.nan)
        return last_samples(model, run, self._samples)

    def noise(self, model: Model) -> NoiseLevels | None:
        """Return the noise of what is compared: of the signals, or of their prediction errors.

        Where a prediction is compared, a model predicts every period as it was recorded; what it
        does wrong repeats with the periods, so that the scatter is that of the noise alone.
        """
        if self.repeats:
            return noise_levels(self._recorded)
        runs = [
            self._simulated(model, (r.position.ravel(), r.torque.ravel()), self._elapsed[index])
            for index, r in enumerate(self._recorded.realizations)
        ]
        return noise_levels(prediction.errors(self._recorded, runs))

    def _mean_inputs(self, realization: RecordedRealization) -> tuple[np.ndarray, ...]:
        """Return what drives the simulation, periods after each other: r, or y and u."""
        if self.repeats:
            return (np.resize(realization.played.ravel(), self.samples),)
        signals = (realization.position, realization.torque)
        return tuple(np.resize(realization.kept(s).mean(axis=0), self.samples) for s in signals)

    def _run(
        self,
        models: Sequence[Model],
        which: Sequence[int] | None,
        begins: Mapping[int, tuple[int, State]] = MappingProxyType({}),
    ) -> np.ndarray:
        """Return y, u and q, float64 (models, n, 3, N)."""
        indices = range(len(self._inputs)) if which is None else which
        jobs = [(model, index, begins.get(index)) for model in models for index in indices]
        out = np.array(run_parallel(self._one, jobs))
        return out.reshape(len(models), len(indices), 3, self._samples)

    def _one(self, job: tuple[Model, int, tuple[int, State] | None]) -> np.ndarray:
        model, index, begun = job
        first, begin = (0, None) if begun is None or model.settles_slowly else begun
        if self._stiff(model, index):
            return np.full((3, self._samples), np.nan)
        try:
            inputs = tuple(signal[first:] for signal in self._inputs[index])
            run = self._simulated(model, inputs, self._elapsed[index], begin)
        except InputError:
            return np.full((3, self._samples), np.nan)
        out = last_samples(model, run, self._samples)
        return out if self._added is None or model.rounds else out + self._added[index]

    def _stiff(self, model: Model, index: int) -> bool:
        speed, torque = self._speeds[index], self._torques[index]
        return too_stiff(model, self.samples, self.sample_rate_hz, speed, torque)

    def _simulated(
        self,
        model: Model,
        inputs: tuple[np.ndarray, ...],
        elapsed_s: float,
        begin: State | None = None,
        noise: np.ndarray | None = None,
    ) -> Trajectory:
        p, e = model.plant_coefficients, model.effect_coefficients
        if self.repeats:
            (reference,) = inputs
            return simulate(
                reference, self.sample_rate_hz, p, self._law, noise, e, elapsed_s, begin
            )
        position, torque = inputs
        speed = (position[1] - position[0]) * self.sample_rate_hz
        return simulate_law(
            position, self.sample_rate_hz, p, self._observer, None, e, elapsed_s,
            command=torque, start=(float(position[0]), float(speed)), begin=begin,
        )  # fmt: skip
