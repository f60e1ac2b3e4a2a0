"""Steady periods: what a change of the model would change of the diagnosis's misfit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fjr_records.noise import NoiseLevels, even_lines_as_noise
from fjr_records.periodic import RecordedExperiment

from ..model.misfit import Misfit
from ..model.rig_model import Model, too_stiff
from ..model.simulated_rig import Simulator
from ..which.attribution import CERTAIN, SMALL_GAIN
from ..which.scales import Scales

REALIZATIONS = 2
"""Realizations of each level that are simulated; they stand for the others."""


class PeriodicSight:
    """What the periods of an experiment show.

    Attributes:
        scales: what is usual in it.
        noise_known: whether noise was seen between periods.
    """

    def __init__(
        self, recorded: RecordedExperiment, nominal: Model, realizations: int | None = None
    ) -> None:
        """Take an experiment.

        Args:
            recorded: at least the realizations that stand for all.
            nominal: the bare plant.
            realizations: how many each level will have; None for those that are there.

        Raises:
            InputError: a controller of an unknown kind.
        """
        simulator = Simulator(recorded)
        noise: NoiseLevels | None = simulator.noise(nominal)
        self.noise_known = noise is not None
        std = (noise or even_lines_as_noise(recorded)).of_outputs(recorded)
        self.scales = Scales.of_experiment(recorded, nominal.plant)
        self._recorded, self._simulator = recorded, simulator
        runs = recorded.realizations
        members = {at: [i for i, r in enumerate(runs) if r.level == at] for at in recorded.levels}
        seen = [i for chosen in members.values() for i in chosen[:REALIZATIONS]]
        self._misfit = Misfit(recorded, simulator, std, seen)
        self._level = np.array([recorded.levels.index(runs[i].level) for i in seen])
        self._counts = [realizations or len(chosen) for chosen in members.values()]
        self._stands_for = [
            count / min(len(chosen), REALIZATIONS)
            for count, chosen in zip(self._counts, members.values(), strict=True)
        ]

    @property
    def levels(self) -> tuple[str, ...]:
        """Names of the levels."""
        return tuple(f"{1e3 * a:.3g} mrad" for a in self._recorded.amplitudes_rad)

    def errors(self, models: Sequence[Model]) -> np.ndarray:
        """Return the error vectors of models, as `Misfit.errors`, float64 (models, errors)."""
        return self._misfit.errors(models)

    def too_stiff(self, model: Model) -> bool:
        """Tell whether a model would take too long to play."""
        speed, torque = self.scales.velocity_rad_s, self.scales.peak_torque_nm
        rate = self._recorded.sample_rate_hz
        return too_stiff(model, self._simulator.samples, rate, speed, torque)

    def strength(self, change: np.ndarray) -> float:
        """Return how far a change shows, over what the diagnosis needs to name an effect.

        Half of the realizations are held out; on them the misfit must fall by the change's share
        of what noise leaves (`attribution`).
        """
        return math.sqrt(float(np.sum(self._squares(change) * self._held)) / self._needed)

    def best_level(self, change: np.ndarray) -> int:
        """Return the index of the level at which a change shows best."""
        return int(np.argmax(self._squares(change) * self._held))

    def fit_weights(self, errors: int) -> np.ndarray:
        """Return how many realizations of the fit each error stands for, (errors,)."""
        trained = np.array([(c + 1) // 2 / c for c in self._counts]) * self._stands_for
        return np.repeat(trained[self._level], errors // self._level.size)

    @cached_property
    def _held(self) -> np.ndarray:
        """For how many held-out realizations each simulated one stands, by level."""
        alone = max(self._counts) == 1  # then all serve both purposes
        held = [1.0 if alone else (c // 2) / c for c in self._counts]
        return np.array(held) * self._stands_for

    @cached_property
    def _needed(self) -> float:
        """By how much the chi-square over held-out realizations must fall."""
        each = self._misfit.size / self._level.size
        size = each * float(np.sum(np.bincount(self._level) * self._held))
        return max(CERTAIN, (SMALL_GAIN - 1.0) * size)

    def _squares(self, change: np.ndarray) -> np.ndarray:
        """Return the sum of squares of a change at each level."""
        by_realization = np.sum(change.reshape(self._level.size, -1) ** 2, axis=1)
        return np.bincount(self._level, by_realization, len(self._counts))
