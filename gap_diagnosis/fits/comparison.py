"""A fit, and what it leaves and gains on parts that no fit has seen.

Models are compared by the log-likelihood of these parts, the variance of each band of each part
unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from fjr_kit.least_squares import Solution

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..starts.search_space import Space
from .cell_weights import CellWeights
from .unseen_friction import beside_scatter, deviated

NOTHING_LEFT = 2.0
"""Mean squared error over noise below which noise explains what is left."""
CHANCE = 1e-4  # that noise leaves as much in a band: then something else is left there
_ACTS = 0.1
"""Of what is left in a band of a part: an effect that moves it by less does not act there."""


@dataclass(frozen=True, eq=False)
class CellFit:
    """One explanation after fitting, equal to itself only.

    Attributes:
        effects: identifiers in the order in which they were added.
        space: what was free.
        model: the fitted model.
        solution: the optimiser's end, its residuals and Jacobian times `CellFitter.weight`.
        variance: (cells,), of an error in each cell, rad2.
        left: (parts, bands), mean square of what is left on each part that selects, noise and the
            simulation's own error added, rad2.
        acts: (parts,), whether what was added last moves a part that selects; None
            where that was not looked at.
    """

    effects: tuple[str, ...]
    space: Space
    model: Model
    solution: Solution
    variance: np.ndarray
    left: np.ndarray
    acts: np.ndarray | None = None


class Comparison:
    """Compares fits on the parts that select.

    Attributes:
        evidence: the records.
        weights: of the errors.
        select_parts: indices of the parts.
    """

    def __init__(self, evidence: Evidence) -> None:
        """Prepare."""
        self.evidence, self.weights = evidence, CellWeights(evidence)
        self.select_parts = self.weights.select_parts

    def misfit(self, fit: CellFit) -> float:
        """Return what a fit leaves on unseen parts over noise and the simulation's own error.

        A mean over all errors: 1 where nothing else is left; NaN where noise is not known.
        """
        if not self.evidence.noise.known:
            return math.nan
        relative = fit.left / self.weights.select_floor - 1.0
        return float(np.sum(self.weights.counts * relative) / self.weights.counts.sum())

    def left_in_a_band(self, fit: CellFit) -> float:
        """Return the misfit in the band of the level in which a fit leaves most beyond chance.

        A cause that acts in a narrow band hardly shows in the mean over all. NaN as above; 0 where
        chance explains what is left in every band.
        """
        if not self.evidence.noise.known:
            return math.nan
        weights, worst = self.weights, 0.0
        relative = weights.counts * (fit.left / weights.select_floor - 1.0)
        for level in np.unique(weights.select_levels):
            own = weights.select_levels == level
            numbers, squares = weights.counts[own].sum(axis=0), relative[own].sum(axis=0)
            chance = stats.chi2.sf(squares, np.maximum(numbers, 1))
            seen = (chance < CHANCE) & (numbers > 0)
            if seen.any():
                worst = max(worst, float((squares / np.maximum(numbers, 1))[seen].max()))
        return worst

    def gains(self, after: CellFit, before: CellFit) -> np.ndarray:
        """Return the log-likelihood that one fit gains over another on each part that selects.

        With the variance of each band of each part unknown it is n/2 ln(left before/left after),
        summed over bands of n independent numbers: no part counts by its size, and no outlier by
        its square.

        Returns:
            (parts,), nats.
        """
        return self.weights.gained(after.left, before.left).sum(axis=1)

    def acted(self, fit: CellFit, *effects: str) -> np.ndarray:
        """Return whether effects move each part that selects, beside what the fit leaves there.

        A saturation does nothing where it is not reached; what such a part gains or loses says
        something of the parameters beside it, and of friction that scatters from run to run.

        Returns:
            bool (parts,).
        """
        values = fit.model.effects.items()
        rest = {n: v for n, v in values if n.split(".", 1)[0] not in effects}
        models = [fit.model, Model(fit.model.plant, rest)]
        errors = self.evidence.errors(models, self.select_parts)
        moved = self.weights.mean_squares(errors[1] - errors[0])
        return np.any(moved >= _ACTS * fit.left, axis=1)

    def left_by(self, model: Model, variance: np.ndarray) -> np.ndarray:
        """Return `CellFit.left` of a model, with weights by such variances of the cells, rad2."""
        others = deviated(model) if self.weights.unseen else []
        errors = self.evidence.errors([model, *others], self.select_parts)
        weight = self.weights.select_weight(variance)
        alone = beside_scatter(errors, weight, self.weights.unseen)
        return self.weights.mean_squares(alone) + self.weights.select_floor
