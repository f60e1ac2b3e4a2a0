"""The simulated rig under recorded runs that do not repeat: each is played from its true start.

Where controller and references are known, the loop itself is simulated. Else the recorded torque
drives the model, and an observer holds its motion to the recorded position (`prediction`), unless
the model comes to rest by itself.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError
from fjr_records.record_noise import RecordNoise
from fjr_records.records import RecordSet
from fjr_sim_node.simulation.closed_loop import State, Trajectory

from .drive import Drive
from .near_steady import begins
from .prediction import CROSSOVER_SHARE, Added, model_observer, prediction_error, settles
from .record_loop import RecordLoop, loop_of, without_erratic, without_swinging
from .record_start import held_at, start_of
from .rig_model import Model, too_stiff
from .simulated_rig import run_parallel
from .steady_runs import SteadyRuns

_SMALL = 1e-4  # relative: a change of an inertia that must not grow
_NOTHING = TransferFunction.of([0.0], [1.0])
_LOST = 100.0  # times the recorded range, off the recorded motion that an observer holds it to


class RecordSimulator:
    """Plays recorded runs with models, without noise.

    Attributes:
        records: what is played.
        loop: how the loop is known.
        crossover_hz: crossover of the observer.
        settles: whether models come to rest by themselves, so that the recorded torque alone drives
            them where the loop is not known.
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
        self._added: Sequence[np.ndarray] | None = None
        self._named = False
        self.loop: RecordLoop = without_swinging(loop_of(records), records)
        self._starts = [start_of(r, noise) for r in records.records]
        self._held_at = [
            held_at(r, start, nominal)
            for r, start in zip(records.records, self._starts, strict=True)
        ]
        self._speeds = [float(np.std(np.diff(r.position)) * self._rate) for r in records.records]
        self._torques = [float(np.abs(r.torque).max()) for r in records.records]
        self._farthest = [_LOST * float(np.ptp(r.position)) or math.inf for r in records.records]
        self.crossover_hz, self._observer = model_observer(
            nominal, CROSSOVER_SHARE * top_hz, self._rate
        )
        self._nominal = nominal
        shortest = min(r.samples for r in records.records)
        self.settles = settles(nominal, shortest / self._rate)
        self._entries = [self._entry(index) for index in range(len(records.records))]
        names = [r.name for r in records.records]
        self._begins: dict[int, tuple[int, State]] = {}
        self.loop = without_erratic(self.loop, names, self._growth(Model.nominal(nominal)))
        if isinstance(records, SteadyRuns):
            self._begins = begins(self, Model.nominal(nominal), records.run_in, noise)

    @property
    def driven(self) -> str:
        """How the recorded torque makes the motion where the loop is not known, in words."""
        if self.settles:
            return "the recorded torque alone drives the model, which comes to rest by itself"
        return (
            "the recorded torque drives the model, and an observer of "
            f"{self.crossover_hz:.3g} Hz holds it to the recorded position"
        )

    @property
    def loses(self) -> str:
        """What errors do not show where the loop is not known, in words that end a sentence."""
        if self.settles:
            return ": the torque shows no error"
        return (
            ": below that, errors show smaller than they are, and the figures of the torque are "
            "those of what the observer adds"
        )

    @property
    def _holding(self) -> TransferFunction:
        """What holds models where the loop is not known."""
        return _NOTHING if self.settles else self._observer

    def adding(self, signals: Sequence[np.ndarray] | None) -> RecordSimulator:
        """Return a simulator that adds signals to y, u and q of models whose encoder is smooth.

        Args:
            signals: what rounding adds on the average to each run, float64 (3, samples); None for
                nothing.
        """
        other = copy.copy(self)
        other._added, other._named = signals, False
        return other

    def naming(self) -> RecordSimulator:
        """Return a simulator that adds the same to models whose encoder rounds, and to no others.

        It plays these with a smooth encoder: no rounding that is simulated is that of the record,
        sample by sample.
        """
        other = copy.copy(self)
        other._named = True
        return other

    @property
    def adds(self) -> bool:
        """Whether it adds what rounding does."""
        return self._added is not None

    def _entry(self, index: int) -> np.ndarray | None:
        """Return the state in which the law of a run enters it; None for zero."""
        law, record = self.loop.laws[index], self.records.records[index]
        rests = self._starts[index] == (0.0, 0.0) and self.loop.added[index] is None
        rests &= record.after_s == 0.0
        if law is None or record.reference is None or rests:
            return None
        return law.entering_state(record.reference, record.position, record.torque)

    def _growth(self, nominal: Model) -> list[float]:
        """Return how a small change of the inertia grows in each run, see `GROWS`."""
        other = Model({**nominal.plant, "jm": nominal.plant["jm"] * (1.0 + _SMALL)}, {})
        which = [index for index, law in enumerate(self.loop.laws) if law is not None]
        growth = [0.0] * len(self.loop.laws)
        for index, one, two in zip(which, *self.run([nominal, other], which), strict=True):
            change = float(np.sqrt(np.mean((two[0] - one[0]) ** 2)))
            moved = float(np.sqrt(np.mean(one[0] ** 2))) + 1e-300
            growth[index] = change / moved / _SMALL if np.isfinite(change) else np.inf
        return growth

    def response(self, frequency_hz: np.ndarray, index: int) -> np.ndarray:
        """Return C_y of what holds a run: its controller, or the observer; complex, N m/rad."""
        law = self.loop.laws[index] or self._holding
        return law.response(frequency_hz, self._rate)[1]

    def scattered(self, scatter: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return how errors differ between periods of each run, float64 (differences, N) in rad.

        What makes the periods differ moves a model that the recorded torque drives, too.

        Args:
            scatter: (2, differences, N) for each run, of position and torque.
        """
        found = []
        for law, (position, torque) in zip(self.loop.laws, scatter, strict=True):
            if law is None:
                driving = self._nominal, self._holding, self._rate
                position = prediction_error(position, torque, *driving)
            found.append(position)
        return found

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
        runs = zip(self.held(model, which), which, strict=True)
        return [run[1] - self.records.records[index].torque for run, index in runs]

    def held(self, model: Model, which: Sequence[int]) -> list[np.ndarray]:
        """Return y, u and q of a model that an observer holds to each recorded motion.

        Returns:
            float64 (3, samples) for each run: rad, N m with what the observer adds, rad; NaN where
            the motion diverges.
        """
        return run_parallel(self._held, [(model, index) for index in which])

    def _held(self, job: tuple[Model, int]) -> np.ndarray:
        model, index = job
        try:
            run = self._observed(index).simulated(self._rate, *self.coefficients(model))
        except InputError:
            return np.full((3, self.records.records[index].samples), np.nan)
        return _signals(model, run)

    def added(self, model: Model) -> Added:
        """Return what says which torque that observer adds for one that a model lacks."""
        return Added(model.whole_plant, self._observer, self._rate)

    def drive(self, index: int) -> Drive:
        """Return what drives a simulation of one run."""
        law, record = self.loop.laws[index], self.records.records[index]
        if law is None:
            return self.observed(index)
        assert record.reference is not None
        start, entry = self._starts[index], self._entries[index]
        added = self.loop.added[index]
        held = self._held_at[index]
        return Drive(record.reference, law, None, start, entry, record.elapsed_s, added, held)

    def observed(self, index: int) -> Drive:
        """Return what drives one run by its torque, its loop being known or not."""
        observed = self._observed(index)
        return replace(observed, law=_NOTHING) if self.settles else observed

    def _observed(self, index: int) -> Drive:
        record = self.records.records[index]
        start = self._starts[index]
        return Drive(
            record.position, self._observer, record.torque, start, elapsed_s=record.elapsed_s,
            held_at=self._held_at[index], farthest=self._farthest[index],
        )  # fmt: skip

    def disturbed(
        self, model: Model, index: int, noise: np.ndarray | None, torque: np.ndarray | None = None
    ) -> np.ndarray:
        """Return y, u and q of a model in one run, to which nothing is added, with noise.

        Args:
            model: the model.
            index: of the run.
            noise: of the encoder, (samples,), rad; None for none.
            torque: noise of the torque that drives the run, (samples,), N m; None for none.

        Returns:
            float64 (3, samples); NaN where the motion diverges.
        """
        try:
            drive = self.drive(index)
            if torque is not None:
                assert drive.command is not None
                drive = replace(drive, command=drive.command + torque)
            run = drive.simulated(self._rate, *self.coefficients(model), noise)
        except InputError:
            return np.full((3, self.records.records[index].samples), np.nan)
        return _signals(model, run)

    def _one(self, job: tuple[Model, int]) -> np.ndarray:
        model, index = job
        if self.too_stiff(model, index):
            return np.full((3, self.records.records[index].samples), np.nan)
        drive, samples = self.drive(index), self.records.records[index].samples
        first, state = (0, None) if model.settles_slowly else self._begins.get(index, (0, None))
        if state is not None:
            drive = drive.part(slice(first, None), state)
        try:
            run = drive.simulated(self._rate, *self.coefficients(model))
        except InputError:
            return np.full((3, samples), np.nan)
        out = _signals(model, run)
        if first:
            record = self.records.records[index]
            link = record.position if record.link is None else record.link
            before = np.array([record.position, record.torque, link])[:, :first]
            out = np.concatenate([before, out], axis=1)
        if self._added is None or model.rounds != self._named:
            return out
        return out + self._added[index]

    def coefficients(self, model: Model) -> tuple[tuple[float, ...], np.ndarray | None]:
        """Return what a simulation of a model takes: its plant and its effects."""
        played = model.smooth if self._named else model
        return played.plant_coefficients, played.effect_coefficients

    def too_stiff(self, model: Model, index: int) -> bool:
        """Tell whether a model would take so long to play as no record can call for."""
        samples = self.records.records[index].samples
        return too_stiff(model, samples, self._rate, self._speeds[index], self._torques[index])


def _signals(model: Model, run: Trajectory) -> np.ndarray:
    return np.array([run.position, run.torque, run.motor if model.rigid else run.link])
