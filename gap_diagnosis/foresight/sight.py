"""What a change of the model would change of the evidence in windows and lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2

from fjr_records.records import RecordSet

from ..fits.comparison import CHANCE, NOTHING_LEFT
from ..fits.gains import LEAST_GAIN
from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..starts.scales import Scales

_FARTHEST = 30.0  # logarithm of the factors within which a size is looked for
RECORDS = 3
"""Records of each level that are simulated: one for each purpose of a diagnosis."""


class Sight:
    """What runs show.

    Attributes:
        levels: names of their levels.
        scales: what is usual in them.
        noise_known: whether their noise is known.
    """

    def __init__(
        self,
        records: RecordSet,
        nominal: Model,
        levels: Sequence[str],
        realizations: int | None = None,
    ) -> None:
        """Take runs.

        Args:
            records: at least those that stand for all.
            nominal: the bare plant.
            levels: their names.
            realizations: how many each level will have; None for those that are there.

        Raises:
            InputError: a controller that is described badly.
        """
        self.levels = tuple(levels)
        members = {at: [r for r in records.records if r.level == at] for at in records.levels}
        chosen = [r for runs in members.values() for r in runs[:RECORDS]]
        records = replace(records, records=tuple(chosen))
        counts = [realizations or len(runs) for runs in members.values()]
        self._stands_for = [max(count / RECORDS, 1.0) for count in counts]
        self._evidence = Evidence(records, nominal.whole_plant)
        self.noise_known = self._evidence.noise.known
        self.scales = Scales.of_record(
            [r.position for r in chosen],
            [r.torque for r in chosen],
            records.sample_rate_hz,
            self._evidence.band_hz,
            nominal.plant,
        )
        fitted = self._evidence.parts_for("fit")
        judged = self._evidence.parts_for("select") or fitted
        self._parts = (*fitted, *(part for part in judged if part not in fitted))
        cell = self._evidence.cell_of(self._parts)
        self._std = np.sqrt(self._evidence.floor(self._parts))[cell]
        part = self._evidence.part_of(self._parts)
        self._fitted = np.isin(part, fitted)
        self._levels_of = np.array([p.level for p in self._evidence.parts])[part]
        self._judged = np.isin(part, judged)
        bands = self._evidence.bands
        own = part[self._judged] * bands + cell[self._judged] % bands
        bins, self._bins = np.unique(own, return_inverse=True)
        self._counts = np.bincount(self._bins)
        level = np.array([p.level for p in self._evidence.parts])[bins // bands]
        _, self._cells = np.unique(level * bands + bins % bands, return_inverse=True)
        self._numbers = np.bincount(self._cells, self._counts)
        self._count = len(judged)

    def errors(self, models: Sequence[Model]) -> np.ndarray:
        """Return errors over their standard deviation, float64 (models, errors)."""
        return self._evidence.errors(models, self._parts) / self._std

    def too_stiff(self, model: Model) -> bool:
        """Tell whether a model would take too long to play in one of the records."""
        simulator = self._evidence.player
        return any(simulator.too_stiff(model, i) for i in range(len(simulator.records.records)))

    def strength(self, change: np.ndarray) -> float:
        """Return how many times smaller a change may be for a diagnosis still to name an effect.

        Two things are needed (`stepwise`): without the effect, more than noise must be left in some
        band of a level, and an unseen part must gain enough log-likelihood by it, of which each
        band has n/2 ln(1 + mean square of the change over that of noise).
        """
        squares = np.bincount(self._bins, change[self._judged] ** 2) / self._counts
        totals = np.bincount(self._cells, squares * self._counts) / self._numbers
        beyond = np.maximum(NOTHING_LEFT, chi2.isf(CHANCE, self._numbers) / self._numbers) - 1.0
        left = math.sqrt(max(float((totals / beyond).max()), 0.0))
        if not np.isfinite(squares).all():
            return math.inf

        def lacks(logarithm: float) -> float:
            smaller = squares * math.exp(-2.0 * logarithm)
            return LEAST_GAIN - 0.5 * float(self._counts @ np.log1p(smaller)) / self._count

        low, high = -_FARTHEST, _FARTHEST
        if lacks(low) > 0.0:
            return 0.0
        gained = math.exp(high if lacks(high) < 0.0 else brentq(lacks, low, high, xtol=1e-6))
        return min(gained, left)

    def best_level(self, change: np.ndarray) -> int:
        """Return the index of the level at which a change shows best."""
        levels = self._evidence.records.levels
        return int(np.argmax([np.mean(change[self._levels_of == level] ** 2) for level in levels]))

    def fit_weights(self, errors: int) -> np.ndarray:
        """Return how many parts of the fit each error stands for, (errors,)."""
        place = [self._evidence.records.levels.index(level) for level in self._levels_of]
        found = np.where(self._fitted, np.array(self._stands_for)[place], 0.0)
        assert found.size == errors
        return found
