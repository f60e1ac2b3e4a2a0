"""Fits beside a remainder: the variance of each cell is what the model itself leaves there.

No model of a real rig leaves noise alone. So the weight of a cell of the evidence is not that of
noise: it is estimated from what the fit leaves on the fitted parts, and the fit is repeated with it
(iteratively reweighted least squares, the maximum-likelihood estimate for unknown variances by
cell). Models are compared by the log-likelihood of parts that no fit has seen. What a cell counts
for is said in `cell_weights`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fjr_sim_node import effects as fx

from ..model.evidence import Evidence
from ..model.rig_model import Model
from .comparison import NOTHING_LEFT, CellFit, Comparison
from .from_parts import from_part
from .least_squares import solve
from .other_splits import other_splits
from .ripples import Ripples
from .ripples_passed import fewest_cycles
from .scales import Scales
from .screening import LARGEST, LARGEST_OF_TORQUES, Proposal, Screening, as_they_are
from .search_space import Space, space_for, starts
from .seen_torques import FRICTIONS, LOADS, SeenTorques

STICKING = ("coulomb_friction", "presliding_friction")
"""Friction, and the bristles by which it yields before it slides."""
_REFIT_ROUNDS = (8, 5, 5)
_ADDED_ROUNDS = (6, 4)
_LEAST_PROMISE = 20.0  # a start that gains less than this (twice the nats) is not pursued
_STARTS = 2
RIPPLES_TRIED = 3
DRIFT = "nonstationary"
_DRIFTS = 0.1  # of friction, until the last run ends: where fits of a drift begin, either way
_RIVAL = 0.05  # an error: a second start that costs so much more than the first is not pursued
_FURTHER = 4  # times that a fit is taken further at the most
_STILL_FALLS = 0.8  # of its misfit


class CellFitter(Comparison):
    """Fits explanations to the evidence of records.

    Attributes:
        nominal: datasheet values of the base parameters.
        tolerance: how far one may be off, relative.
        fit_parts: indices of the parts that it fits.
        groups: (errors,), the stretch of time of each error of the fit, by its first part.
        runs: (errors,), the record of each error of the fit.
    """

    def __init__(self, evidence: Evidence, nominal: Mapping[str, float], tolerance: float) -> None:
        """Prepare."""
        super().__init__(evidence)
        self.nominal, self.tolerance = dict(nominal), tolerance
        self._rippled: tuple[CellFit, tuple[Ripples, SeenTorques]] | None = None
        self.fit_parts = self.weights.fit_parts
        self.groups, self.runs = evidence.stretch_of(self.fit_parts), self.weights.runs
        records = evidence.records
        self.scales = Scales.of_record(
            [r.position for r in records.records],
            [r.torque for r in records.records],
            records.sample_rate_hz,
            evidence.band_hz,
            self.nominal,
        )

    def refit(self) -> CellFit:
        """Fit the base parameters alone, from the datasheet."""
        space = Space(self.nominal, (), (), self.tolerance, self.scales)
        first = self._begun((), space, space.point(Model(self.nominal, {})))
        left = first.solution.residuals / self.weights.weight(first.variance)
        if self.weights.learn(left):
            first = self.further(first)
        return first if self.left_in_a_band(first) < NOTHING_LEFT else self._while_it_falls(first)

    def screening(self, parent: CellFit, effect: str) -> Screening:
        """Return what the starts of an effect promise beside a fit."""
        cycles, seen = None, []
        if fx.EFFECTS[effect].ripple:
            tried = self.scales.cycles()
            predicted, along = self._ripples(parent)
            cycles, seen = (
                predicted.cycles(effect, tried, RIPPLES_TRIED),
                along.seeds(effect, tried),
            )
        elif effect in LOADS:
            seen = self._ripples(parent)[1].load(effect)
        elif effect == DRIFT:
            seen = self._drifts()
        seeds = [*starts(effect, self.scales, cycles, self.nominal), *seen]
        return self.screening_of(parent, seeds, self._frictions(parent, effect, seeds))

    def _frictions(
        self, parent: CellFit, effect: str, seeds: Sequence[Mapping[str, float]]
    ) -> list[tuple[Space, np.ndarray]]:
        """Return points at which a law of friction explains what is seen along the motion."""
        if effect not in FRICTIONS or self.evidence.slow:
            return []
        space = self._space(parent, seeds[0])
        points = [space.point(model) for model in self._ripples(parent)[1].friction(effect)]
        return [(space, np.clip(point, *space.bounds())) for point in points]

    def _drifts(self) -> list[dict[str, float]]:
        """Return starts of a drift of friction over all runs."""
        records = self.evidence.records
        end = max(r.elapsed_s + r.samples / records.sample_rate_hz for r in records.records)
        return [{f"{DRIFT}.friction_per_s": sign * _DRIFTS / end} for sign in (1.0, -1.0)]

    def two_harmonics(self, parent: CellFit, effect: str) -> list[dict[str, float]]:
        """Return starts of a ripple with a second harmonic beside a fit, the best first.

        Only of those numbers of cycles at which the motion passes enough to see one.
        """
        tried = self.scales.cycles()
        tried = tried[tried >= fewest_cycles(self.scales)]
        if not tried.size:
            return []
        return self._ripples(parent)[0].harmonics(effect, tried, RIPPLES_TRIED)

    def screening_of(
        self,
        parent: CellFit,
        seeds: Sequence[Mapping[str, float]],
        points: Sequence[tuple[Space, np.ndarray]] = (),
    ) -> Screening:
        """Return what starts promise beside a fit; arguments as those of `Screening`."""
        return Screening(
            parent.solution,
            parent.model,
            seeds,
            partial(self._space, parent),
            partial(self._residuals, parent.variance),
            partial(self.weights.costs, parent.variance),
            LARGEST_OF_TORQUES if self.evidence.slow else LARGEST,
            points,
        )

    def from_part(self, parent: CellFit, whole: str, fit: CellFit) -> list[Proposal]:
        """Return starts of a law beside a fit, from a fit that has one of its parts more."""
        return from_part(
            whole,
            fit.effects[-1],
            fit.model,
            starts(whole, self.scales, None, self.nominal),
            partial(self._space, parent),
            partial(self._residuals, parent.variance),
            partial(self.weights.costs, parent.variance),
        )

    def promise(self, screened: Screening, before: CellFit, parent: CellFit) -> float:
        """Return what an effect promises beside a fit, by a screening beside another one.

        Args:
            screened: of the effect.
            before: the fit beside which it was screened.
            parent: the fit beside which it may be added.
        """
        ratio = self.weights.weight(parent.variance) / self.weights.weight(before.variance)
        costs = partial(self.weights.costs, parent.variance)
        return screened.gain_beside(parent.solution, ratio, costs)

    def sticking(self, parent: CellFit) -> CellFit | None:
        """Return a parent's explanation with Coulomb friction and the bristles by which it sticks.

        What is held between its moves ends elsewhere if it yields while it sticks, and where it
        rests decides over a weak loop: then Coulomb friction alone makes the error no smaller. None
        if no start promises anything.
        """
        friction, bristles = STICKING
        added = starts(friction, self.scales, None, self.nominal)[0]
        shapes = starts(bristles, self.scales, None, self.nominal)
        space = self._space(parent, {**added, **shapes[0]})
        seen = self._ripples(parent)[1].friction(friction)
        points = [
            np.clip(space.point(Model(m.plant, {**m.effects, **shape})), *space.bounds())
            for m in seen
            for shape in shapes
        ]
        if not points:
            return None
        proposals = as_they_are(
            [(space, point) for point in points],
            parent.solution,
            partial(self._residuals, parent.variance),
            partial(self.weights.costs, parent.variance),
        )
        return self.add(parent, bristles, proposals, 1, friction)

    def add(
        self,
        parent: CellFit,
        effect: str,
        proposals: Sequence[Proposal],
        most: int = _STARTS,
        *before: str,
    ) -> CellFit | None:
        """Fit a parent's explanation with one effect more; None if no start promises anything.

        Args:
            parent: the explanation to extend.
            effect: identifier of the effect to add.
            proposals: from `screening(parent, effect)`.
            most: how many starts are pursued.
            *before: what is added with it.
        """
        best: CellFit | None = None
        kept: list[Space] = []
        begun = self.begun(parent)
        numbers = self.weights.numbers(parent.variance).sum()
        rival = proposals[0][0] + _RIVAL * numbers if proposals else begun
        for cost, space, point in proposals:
            if cost > min(begun - _LEAST_PROMISE, rival) or len(kept) == most:
                break
            if any(space is one for one in kept):
                continue
            kept.append(space)
            errors = self.evidence.errors([space.model(point)], self.fit_parts)[0]
            variance = self.weights.variance(errors)
            ratio = self.weights.weight(variance) / self.weights.weight(parent.variance)
            known = parent.solution.jacobian * ratio[:, None] if len(kept) == 1 else None
            effects = (*parent.effects, *before, effect)
            fit = self._reweighted(effects, space, point, variance, _ADDED_ROUNDS, known)
            if best is None or self.gains(fit, best).sum() > 0.0:
                best = fit
        return None if best is None else replace(best, acts=self.acted(best, *before, effect))

    def promises(self, parent: CellFit, proposals: Sequence[Proposal]) -> bool:
        """Tell whether a start beside a fit gains enough to be pursued."""
        return any(cost <= self.begun(parent) - _LEAST_PROMISE for cost, *_ in proposals[:1])

    def begun(self, parent: CellFit) -> float:
        """Return what a fit costs itself, as its proposals do."""
        return float(self.weights.costs(parent.variance, parent.solution.residuals[None])[0])

    def further(self, fit: CellFit) -> CellFit:
        """Return a fit taken further from where it stands."""
        known = fit.solution.jacobian
        ended = self._reweighted(
            fit.effects, fit.space, fit.solution.x, fit.variance, _REFIT_ROUNDS, known
        )
        return replace(ended, acts=fit.acts)

    def to_its_end(self, fit: CellFit) -> CellFit:
        """Return a fit taken further while what it leaves over noise still falls.

        Weighed by what itself leaves, a fit may stay where it misses much in a cell, which then
        counts for little. So it is also begun with the weights of noise, and the better one counts.
        """
        fit = self._of_other_split(self._while_it_falls(fit))
        if not self.left_in_a_band(fit) > NOTHING_LEFT:
            return fit
        noise = self.weights.floor
        other = self._reweighted(fit.effects, fit.space, fit.solution.x, noise, _REFIT_ROUNDS)
        return replace(other, acts=fit.acts) if self.gains(other, fit).sum() > 0.0 else fit

    def _of_other_split(self, fit: CellFit) -> CellFit:
        """Return a fit, or a better one with another share of inertia behind the transmission."""
        best = fit
        if not self.left_in_a_band(fit) > NOTHING_LEFT:
            return best
        for effects in other_splits(fit.model.effects):
            start = fit.space.point(Model(fit.model.plant, effects))
            start = np.clip(start, *fit.space.bounds())
            other = replace(self._begun(fit.effects, fit.space, start), acts=fit.acts)
            if self.gains(other, best).sum() > 0.0:
                best = self._while_it_falls(other)
        return best

    def _while_it_falls(self, fit: CellFit) -> CellFit:
        for _ in range(_FURTHER):
            before, fit = fit, self.further(fit)
            if not self.misfit(fit) < _STILL_FALLS * self.misfit(before):
                break
        return fit

    def taken_over(self, fit: CellFit) -> CellFit:
        """Return what the fit of another fitter comes to here, from where it ended there."""
        return self._begun(fit.effects, fit.space, fit.solution.x)

    def without(self, fit: CellFit, effect: str) -> CellFit:
        """Return a fit with one effect taken out and all else fitted anew.

        Its weights begin with what is left where the effect is missing: with those of the fit, the
        cells in which it acts would pull all other parameters away.
        """
        names = tuple(n for n in fit.space.effects if not n.startswith(f"{effect}."))
        units = tuple(
            u for n, u in zip(fit.space.effects, fit.space.units, strict=True) if n in names
        )
        space = replace(fit.space, effects=names, units=units)
        rest = tuple(e for e in fit.effects if e != effect)
        return self._begun(rest, space, space.point(fit.model))

    def _ripples(self, parent: CellFit) -> tuple[Ripples, SeenTorques]:
        if self._rippled is None or self._rippled[0] is not parent:
            weight, solution = self.weights.weight(parent.variance), parent.solution
            at = self.evidence, self.fit_parts, parent.model
            self._rippled = parent, (Ripples(*at, weight, solution), SeenTorques(*at))
        return self._rippled[1]

    def _space(self, parent: CellFit, seed: Mapping[str, float]) -> Space:
        added = space_for(self.nominal, seed, self.scales, self.tolerance)
        return replace(
            parent.space,
            effects=parent.space.effects + added.effects,
            units=parent.space.units + added.units,
        )

    def _residuals(self, variance: np.ndarray, models: Sequence[Model]) -> np.ndarray:
        return self.evidence.errors(models, self.fit_parts) * self.weights.weight(variance)

    def _begun(self, effects: tuple[str, ...], space: Space, start: np.ndarray) -> CellFit:
        """Return a fit whose weights begin with what its start leaves."""
        errors = self.evidence.errors([space.model(start)], self.fit_parts)[0]
        return self._reweighted(effects, space, start, self.weights.variance(errors), _REFIT_ROUNDS)

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
            before = self.weights.weight(variance)
            errors = solution.residuals / before
            variance, x = self.weights.variance(errors), solution.x
            known = solution.jacobian * (self.weights.weight(variance) / before)[:, None]
        assert solution is not None and known is not None
        left = errors * self.weights.weight(variance)
        ended = replace(solution, residuals=left, jacobian=known, cost=float(left @ left))
        model = space.model(x)
        return CellFit(effects, space, model, ended, variance, self.left_by(model, variance))
