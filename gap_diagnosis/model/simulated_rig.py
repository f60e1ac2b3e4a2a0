"""Steady periods repeated by a model: in the loop that was recorded, or as a prediction."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

from controller_node.law import law_of
from fjr_kit.errors import InputError
from fjr_records.noise import NoiseLevels, noise_levels
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_sim_node.simulation.closed_loop import Trajectory, simulate, simulate_law

from . import prediction
from .rig_model import Model, too_stiff

Signals = tuple[np.ndarray, np.ndarray]
"""One steady period of y (rad) and of u (N m) of every realization, float64 (n, N) each."""

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
    """

    def __init__(self, recorded: RecordedExperiment) -> None:
        """Take the signals that drive the simulation."""
        description = recorded.experiment
        self.sample_rate_hz = description.sample_rate_hz
        self.repeats = recorded.repeatable
        self._recorded = recorded
        self._samples = description.samples_per_period
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

    @property
    def samples(self) -> int:
        """How many samples of a realization are simulated from rest."""
        return self._periods * self._samples

    def signals(self, model: Model, which: Sequence[int] | None = None) -> Signals:
        """Return one steady period of y and of u."""
        run = self._run(model, which)
        return run[:, 0], run[:, 1]

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

    def _run(self, model: Model, which: Sequence[int] | None) -> np.ndarray:
        """Return y, u and q, float64 (n, 3, N); NaN where the motion diverges, or is too stiff."""
        indices = range(len(self._inputs)) if which is None else which
        return np.array(run_parallel(lambda index: self._one(model, index), indices))

    def _one(self, model: Model, index: int) -> np.ndarray:
        if self._stiff(model, index):
            return np.full((3, self._samples), np.nan)
        try:
            run = self._simulated(model, self._inputs[index], self._elapsed[index])
        except InputError:
            return np.full((3, self._samples), np.nan)
        return last_samples(model, run, self._samples)

    def _stiff(self, model: Model, index: int) -> bool:
        speed, torque = self._speeds[index], self._torques[index]
        return too_stiff(model, self.samples, self.sample_rate_hz, speed, torque)

    def _simulated(
        self,
        model: Model,
        inputs: tuple[np.ndarray, ...],
        elapsed_s: float,
    ) -> Trajectory:
        p, e = model.plant_coefficients, model.effect_coefficients
        if self.repeats:
            (reference,) = inputs
            return simulate(reference, self.sample_rate_hz, p, self._law, None, e, elapsed_s)
        position, torque = inputs
        speed = (position[1] - position[0]) * self.sample_rate_hz
        return simulate_law(
            position, self.sample_rate_hz, p, self._observer, None, e, elapsed_s,
            command=torque, start=(float(position[0]), float(speed)),
        )  # fmt: skip
