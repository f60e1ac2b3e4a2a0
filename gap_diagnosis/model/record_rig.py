"""The simulated rig under recorded runs that do not repeat: each is played from its true start.

Where controller and references are known, the loop itself is simulated. Else the recorded torque
drives the model, and an observer holds its motion to the recorded position (`prediction`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fjr_kit.errors import InputError
from fjr_records.record_noise import RecordNoise
from fjr_records.records import Record, RecordSet
from fjr_sim_node import plant
from fjr_sim_node.simulation.closed_loop import Trajectory, simulate_law

from .prediction import CROSSOVER_SHARE, model_observer
from .record_loop import RecordLoop, loop_of
from .simulated_rig import Model, run_parallel

_AT_REST = 5.0  # standard deviations of noise that a record at rest may begin away from zero
_FIRST_SAMPLES = 10
_MOST_STEPS, _MOST_STEPS_A_SAMPLE = 1e6, 20.0  # of the integration of one run


class RecordSimulator:
    """Plays recorded runs with models, without noise.

    Attributes:
        records: what is played.
        loop: how the loop is known.
        crossover_hz: crossover of the observer.
    """

    def __init__(
        self, records: RecordSet, noise: RecordNoise, top_hz: float, nominal: Mapping[str, float]
    ) -> None:
        """Take the signals that drive the simulation.

        Args:
            records: the runs.
            noise: of their positions.
            top_hz: highest frequency at which the position holds a signal.
            nominal: datasheet values by the names of PLANT, which the observer must hold.

        Raises:
            InputError: a controller that is described badly.
        """
        self.records = records
        self._rate = records.sample_rate_hz
        self.loop: RecordLoop = loop_of(records)
        self._starts = [_start(r, noise) for r in records.records]
        self._speeds = [float(np.std(np.diff(r.position)) * self._rate) for r in records.records]
        self._torques = [float(np.abs(r.torque).max()) for r in records.records]
        self.crossover_hz, self._observer = model_observer(
            nominal, CROSSOVER_SHARE * top_hz, self._rate
        )
        self._entries = [
            law.entering_state(r.reference, r.position, r.torque)
            if law is not None and r.reference is not None and start != (0.0, 0.0)
            else None
            for law, r, start in zip(self.loop.laws, records.records, self._starts, strict=True)
        ]

    def response(self, frequency_hz: np.ndarray, index: int) -> np.ndarray:
        """Return C_y of what holds a run: its controller, or the observer; complex, N m/rad."""
        law = self.loop.laws[index] or self._observer
        return law.response(frequency_hz, self._rate)[1]

    def run(self, models: Sequence[Model], which: Sequence[int]) -> list[list[np.ndarray]]:
        """Return y, u and q of each model in each run.

        Args:
            models: the models.
            which: indices of the runs.

        Returns:
            for each model, for each run, float64 (3, samples): rad, N m, rad; NaN where the motion
            diverges, or is too stiff to be followed in reasonable time.
        """
        jobs = [(model, index) for model in models for index in which]
        found = run_parallel(self._one, jobs)
        return [found[i * len(which) : (i + 1) * len(which)] for i in range(len(models))]

    def missing_torque(self, model: Model, which: Sequence[int]) -> list[np.ndarray]:
        """Return the torque that an observer must add to hold a model to each recorded motion.

        Returns:
            float64 (samples,) for each run, N m; NaN where the motion diverges.
        """
        return run_parallel(self._missing, [(model, index) for index in which])

    def _missing(self, job: tuple[Model, int]) -> np.ndarray:
        model, index = job
        record = self.records.records[index]
        try:
            return self._observed(model, index).torque - record.torque
        except InputError:
            return np.full(record.samples, np.nan)

    def _observed(self, model: Model, index: int) -> Trajectory:
        record, (p, e) = self.records.records[index], _coefficients(model)
        return simulate_law(
            record.position, self._rate, p, self._observer, None, e,
            added_torque=record.torque, start=self._starts[index],
        )  # fmt: skip

    def _one(self, job: tuple[Model, int]) -> np.ndarray:
        model, index = job
        if self._too_stiff(model, index):
            return np.full((3, self.records.records[index].samples), np.nan)
        try:
            run = self._simulated(model, index)
        except InputError:
            return np.full((3, self.records.records[index].samples), np.nan)
        return np.array([run.position, run.torque, run.motor if model.rigid else run.link])

    def _too_stiff(self, model: Model, index: int) -> bool:
        """Tell whether a model would take so long to play as no record can call for."""
        record, (p, e) = self.records.records[index], _coefficients(model)
        seconds = record.samples / self._rate
        steps = seconds * plant.steps_per_second(self._speeds[index], self._torques[index], p, e)
        return bool(steps > max(_MOST_STEPS, _MOST_STEPS_A_SAMPLE * record.samples))

    def _simulated(self, model: Model, index: int) -> Trajectory:
        law = self.loop.laws[index]
        if law is None:
            return self._observed(model, index)
        record, (p, e) = self.records.records[index], _coefficients(model)
        assert record.reference is not None
        return simulate_law(
            record.reference, self._rate, p, law, None, e,
            start=self._starts[index], controller_state=self._entries[index],
        )  # fmt: skip


def _coefficients(model: Model) -> tuple[tuple[float, ...], tuple[float, ...] | None]:
    return model.plant_coefficients, model.effect_coefficients


def _start(record: Record, noise: RecordNoise) -> tuple[float, float]:
    """Return position (rad) and velocity (rad/s) at the first sample; zero where noise explains."""
    first = record.position[:_FIRST_SAMPLES]
    std = noise.std_rad if noise.known else 0.0
    if np.abs(first).max() <= _AT_REST * std:
        return 0.0, 0.0
    time = np.arange(first.size) / record.description.sample_rate_hz
    if np.ptp(first) <= 2.0 * _AT_REST * std:
        return float(first.mean()), 0.0
    speed, position = np.polyfit(time, first, 1)
    return float(position), float(speed)
