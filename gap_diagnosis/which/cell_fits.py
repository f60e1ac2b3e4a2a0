"""Fits beside a remainder: the variance of each cell is what the model itself leaves there.

No model of a real rig leaves noise alone. So the weight of a cell of the evidence is not that of
noise: it is estimated from what the fit leaves on the fitted parts, and the fit is repeated with it
(iteratively reweighted least squares, the maximum-likelihood estimate for unknown variances by
cell). Models are compared by the log-likelihood of parts that no fit has seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..model.evidence import Evidence
from ..model.simulated_rig import Model
from .least_squares import Solution, solve
from .screening import Proposal, Screening
from .search_space import Space, space_for, starts

_REFIT_ROUNDS = (8, 5, 5)
_ADDED_ROUNDS = (6, 4)
_NO_PROMISE = 0.998  # of the parent's cost: a start that gains less is not pursued
_STARTS = 2
_RIVAL = 1.05  # a second start that costs more than this times the first is not pursued


@dataclass(frozen=True)
class CellFit:
    """One explanation after fitting.

    Attributes:
        effects: identifiers in the order in which they were added.
        space: what was free.
        model: the fitted model.
        solution: the optimiser's end, its residuals in standard deviations of `variance`.
        variance: (cells,), of an error in each cell, rad2.
        scores: (parts,), log-likelihood per number of the parts that select, by their order.
    """

    effects: tuple[str, ...]
    space: Space
    model: Model
    solution: Solution
    variance: np.ndarray
    scores: np.ndarray


class CellFitter:
    """Fits explanations to the evidence of records.

    Attributes:
        evidence: the records.
        nominal: datasheet values of the base parameters.
        tolerance: how far one may be off, relative.
        fit_parts, select_parts: indices of parts.
    """

    def __init__(self, evidence: Evidence, nominal: Mapping[str, float], tolerance: float) -> None:
        """Prepare."""
        self.evidence, self.nominal, self.tolerance = evidence, dict(nominal), tolerance
        self.fit_parts = evidence.parts_for("fit")
        self.select_parts = evidence.parts_for("select") or self.fit_parts
        self._cell = evidence.cell_of(self.fit_parts)
        self._floor = evidence.floor(self.fit_parts)
        self.groups = evidence.part_of(self.fit_parts)
        self._peak = max(float(np.abs(r.torque).max()) for r in evidence.records.records)

    def refit(self) -> CellFit:
        """Fit the base parameters alone, from the datasheet."""
        space = Space(self.nominal, (), (), self.tolerance)
        start = space.point(Model(self.nominal, {}))
        errors = self.evidence.errors([space.model(start)], self.fit_parts)[0]
        return self._reweighted((), space, start, self._variance(errors), _REFIT_ROUNDS)

    def screening(self, parent: CellFit, effect: str) -> Screening:
        """Return what the starts of an effect promise beside a fit."""
        return Screening(
            parent.solution,
            parent.model,
            starts(effect, self._peak),
            partial(self._space, parent),
            partial(self._residuals, parent.variance),
        )

    def add(self, parent: CellFit, effect: str, proposals: Sequence[Proposal]) -> CellFit | None:
        """Fit a parent's explanation with one effect more; None if no start promises anything."""
        best: CellFit | None = None
        kept: list[Space] = []
        for cost, space, point in proposals:
            if cost > _NO_PROMISE * parent.solution.cost or len(kept) == _STARTS:
                break
            if cost > _RIVAL * proposals[0][0]:
                break
            if any(space is one for one in kept):
                continue
            kept.append(space)
            known = parent.solution.jacobian if len(kept) == 1 else None
            fit = self._reweighted(
                (*parent.effects, effect), space, point, parent.variance, _ADDED_ROUNDS, known
            )
            if best is None or fit.scores.mean() > best.scores.mean():
                best = fit
        return best

    def without(self, fit: CellFit, effect: str) -> CellFit:
        """Return a fit with one effect taken out and all else fitted anew."""
        names = tuple(n for n in fit.space.effects if not n.startswith(f"{effect}."))
        units = tuple(
            u for n, u in zip(fit.space.effects, fit.space.units, strict=True) if n in names
        )
        space = replace(fit.space, effects=names, units=units)
        start = space.point(fit.model)
        rest = tuple(e for e in fit.effects if e != effect)
        return self._reweighted(rest, space, start, fit.variance, _ADDED_ROUNDS)

    def score(self, model: Model, variance: np.ndarray, parts: Sequence[int]) -> np.ndarray:
        """Return the log-likelihood per number of each part, (parts,)."""
        evidence = self.evidence
        errors = evidence.errors([model], parts)[0]
        v = variance[evidence.cell_of(parts)]
        each = -0.5 * (np.log(v) + errors**2 / v)
        place = {part: k for k, part in enumerate(parts)}
        part = np.array([place[p] for p in evidence.part_of(parts)])
        return np.bincount(part, each) / np.bincount(part)

    def _space(self, parent: CellFit, seed: Mapping[str, float]) -> Space:
        added = space_for(self.nominal, seed)
        return replace(
            parent.space,
            effects=parent.space.effects + added.effects,
            units=parent.space.units + added.units,
        )

    def _residuals(self, variance: np.ndarray, models: Sequence[Model]) -> np.ndarray:
        return self.evidence.errors(models, self.fit_parts) / np.sqrt(variance[self._cell])

    def _variance(self, errors: np.ndarray) -> np.ndarray:
        found = self.evidence.mean_squares(errors, self.fit_parts)
        return np.maximum(found, self._floor)

    def _reweighted(
        self,
        effects: tuple[str, ...],
        space: Space,
        start: np.ndarray,
        variance: np.ndarray,
        rounds: Sequence[int],
        known: np.ndarray | None = None,
    ) -> CellFit:
        x, solution = start, None
        for steps in rounds:

            def residuals(points: np.ndarray, variance: np.ndarray = variance) -> np.ndarray:
                return self._residuals(variance, [space.model(point) for point in points])

            solution = solve(residuals, x, *space.bounds(), most_steps=steps, known=known)
            errors = solution.residuals * np.sqrt(variance[self._cell])
            before, variance, x = variance, self._variance(errors), solution.x
            change = np.sqrt(before / variance)[self._cell]
            known = solution.jacobian * change[:, None]
        assert solution is not None and known is not None
        ended = replace(
            solution,
            residuals=errors / np.sqrt(variance[self._cell]),
            jacobian=known,
            cost=float(np.sum(errors**2 / variance[self._cell])),
        )
        model = space.model(x)
        scores = self.score(model, variance, self.select_parts)
        return CellFit(effects, space, model, ended, variance, scores)
