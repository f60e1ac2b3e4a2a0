"""Where fits of an explanation begin, and which of their starts are pursued.

What an effect promises beside a fit is screened over its usual starts and over those that the
record itself shows; the best of them are fitted (`reweighted`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fjr_records.records import RecordSet
from fjr_sim_node import effects as fx

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..starts.from_parts import from_part
from ..starts.other_splits import YIELDS
from ..starts.ripples import Ripples
from ..starts.ripples_passed import fewest_cycles
from ..starts.screening import LARGEST, LARGEST_OF_TORQUES, Proposal, Screening, as_they_are
from ..starts.search_space import Space, space_for, starts
from ..starts.seen_together import LOADS, lacked
from ..starts.seen_torques import FRICTIONS, SeenTorques
from ..starts.seen_twist import PLAYS, play
from .comparison import CellFit
from .reweighted import ReweightedFits

STICKING = ("coulomb_friction", "presliding_friction")
"""Friction, and the bristles by which it yields before it slides."""
_ADDED_ROUNDS = (6, 4)
_LEAST_PROMISE = 20.0  # a start that gains less than this (twice the nats) is not pursued
_STARTS = 2
RIPPLES_TRIED = 3
DRIFT = "nonstationary"
_DRIFTS = 0.1  # of friction, until the last run ends: where fits of a drift begin, either way
_RIVAL = 0.05  # an error: a second start that costs so much more than the first is not pursued


class CellFitter(ReweightedFits):
    """Extends explanations of records by effects, from the starts that promise most."""

    def __init__(self, evidence: Evidence, nominal: Mapping[str, float], tolerance: float) -> None:
        """Prepare."""
        super().__init__(evidence, nominal, tolerance)
        self._rippled: tuple[CellFit, tuple[Ripples, SeenTorques]] | None = None

    def with_runs(self, records: RecordSet) -> CellFitter:
        """Return what fits the same runs with other torques or times, cut as these are."""
        plant = Model(self.nominal, {}).whole_plant
        evidence = Evidence(records, plant, parts=self.evidence.parts)
        return CellFitter(evidence, self.nominal, self.tolerance)

    def screening(self, parent: CellFit, effect: str) -> Screening:
        """Return what the starts of an effect promise beside a fit."""
        cycles, seen = None, []
        if fx.EFFECTS[effect].ripple:
            tried = self.scales.cycles()
            predicted, along = self._ripples(parent)
            likely = predicted.seeds(effect, tried, RIPPLES_TRIED)
            cycles = [one[f"{effect}.cycles_per_turn"] for one in likely]
            seen = [*likely, *along.seeds(effect, tried)]
        elif effect in LOADS:
            seen = self._ripples(parent)[1].load(effect)
        elif effect == DRIFT:
            seen = self._drifts()
        seeds = [*starts(effect, self.scales, cycles, self.nominal), *seen]
        return self.screening_of(parent, seeds, self._seen(parent, effect, seeds))

    def _seen(
        self, parent: CellFit, effect: str, seeds: Sequence[Mapping[str, float]]
    ) -> list[tuple[Space, np.ndarray]]:
        """Return points at which a law explains what is seen of it, all else solved with it.

        Friction is seen in the torque that the fit lacks along the motion, play in the twist.
        """
        models: list[Model] = []
        if effect in FRICTIONS and not self.evidence.slow:
            models = self._ripples(parent)[1].friction(effect)
        elif effect == YIELDS and not self.evidence.slow:
            models = self._ripples(parent)[1].resonance()
        elif effect in PLAYS and self.evidence.twist is not None:
            bare = Model.nominal(self.nominal)
            models = play(self.evidence, self.fit_parts, parent.model, effect, bare)
        if not models:
            return []
        space = self._space(parent, seeds[0])
        return [(space, np.clip(space.point(model), *space.bounds())) for model in models]

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
            partial(self.residuals, parent.variance),
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
            partial(self.residuals, parent.variance),
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
        models = self._ripples(parent)[1].friction(STICKING[0])
        return self._jointly(parent, STICKING, models)

    def together(self, parent: CellFit, effects: Sequence[str]) -> list[CellFit]:
        """Return a parent's explanation with frictions and a load that only together are seen.

        Args:
            parent: the explanation, of the base parameters alone.
            effects: identifiers of what may be there.
        """
        (friction, bristles), fits = STICKING, []
        for names, model in self._ripples(parent)[1].together(effects):
            sets = [names]
            if friction in names and bristles in effects:
                at = names.index(friction) + 1
                sets.insert(0, (*names[:at], bristles, *names[at:]))
            fits += [self._jointly(parent, each, [model]) for each in sets]
        return [fit for fit in fits if fit is not None]

    def _jointly(
        self, parent: CellFit, effects: Sequence[str], models: Sequence[Model]
    ) -> CellFit | None:
        """Return a parent's explanation with several effects more, begun at models that have them.

        Bristles are tried in every usual size. None if no start promises anything.
        """
        usual = [starts(effect, self.scales, None, self.nominal) for effect in effects]
        shapes = usual[effects.index(STICKING[1])] if STICKING[1] in effects else [{}]
        space = self._space(parent, {n: v for seeds in usual for n, v in seeds[0].items()})
        points = [
            np.clip(space.point(Model(m.plant, {**m.effects, **shape})), *space.bounds())
            for m in models
            for shape in shapes
        ]
        if not points:
            return None
        proposals = as_they_are(
            [(space, point) for point in points],
            parent.solution,
            partial(self.residuals, parent.variance),
            partial(self.weights.costs, parent.variance),
        )
        return self.add(parent, effects[-1], proposals, 1, *effects[:-1])

    def add(
        self,
        parent: CellFit,
        effect: str,
        proposals: Sequence[Proposal],
        most: int = _STARTS,
        *before: str,
    ) -> CellFit | None:
        """Fit a parent's explanation with one effect more; None if no start promises anything.

        Friction that the datasheet lacks is fitted from its best start, whatever that promises: a
        fit without it has bent all else to do what it does.

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
            promises = cost <= begun - _LEAST_PROMISE or (
                not kept and effect in lacked(self.nominal)
            )
            if not promises or cost > rival or len(kept) == most:
                break
            if any(space is one for one in kept):
                continue
            kept.append(space)
            errors = self.evidence.errors([space.model(point)], self.fit_parts)[0]
            variance = self.weights.variance(errors)
            ratio = self.weights.weight(variance) / self.weights.weight(parent.variance)
            known = parent.solution.jacobian * ratio[:, None] if len(kept) == 1 else None
            effects = (*parent.effects, *before, effect)
            fit = self.reweighted(effects, space, point, variance, _ADDED_ROUNDS, known)
            if best is None or self.gains(fit, best).sum() > 0.0:
                best = fit
        return None if best is None else replace(best, acts=self.acted(best, *before, effect))

    def halved(self, parent: CellFit, effect: str) -> CellFit | None:
        """Fit an effect beside the one of the parent that does the part of both, from half of each.

        None if the parent lacks that one; see `Effect.takes_from`.
        """
        takes_from = {e: fx.EFFECTS[e].takes_from for e in (*parent.effects, effect)}
        whole = [e for e in parent.effects if takes_from[e] == effect or takes_from[effect] == e]
        sizes = [name for e in whole for name in fx.EFFECTS[e].size_names]
        half = {name: 0.5 * parent.model.effects.get(name, 0.0) for name in sizes}
        if not any(half.values()):
            return None
        seed = {fx.EFFECTS[effect].size_names[0]: sum(half.values())}
        space = self._space(parent, seed)
        begun = Model(parent.model.plant, {**parent.model.effects, **half, **seed})
        point = np.clip(space.point(begun), *space.bounds())
        variance = self.weights.variance(
            self.evidence.errors([space.model(point)], self.fit_parts)[0]
        )
        fit = self.reweighted((*parent.effects, effect), space, point, variance, _ADDED_ROUNDS)
        return replace(fit, acts=self.acted(fit, effect))

    def promises(self, parent: CellFit, proposals: Sequence[Proposal]) -> bool:
        """Tell whether a start beside a fit gains enough to be pursued."""
        return any(cost <= self.begun(parent) - _LEAST_PROMISE for cost, *_ in proposals[:1])

    def begun(self, parent: CellFit) -> float:
        """Return what a fit costs itself, as its proposals do."""
        return float(self.weights.costs(parent.variance, parent.solution.residuals[None])[0])

    def _ripples(self, parent: CellFit) -> tuple[Ripples, SeenTorques]:
        if self._rippled is None or self._rippled[0] is not parent:
            weight, ended = self.weights.weight(parent.variance), parent.solution
            at = self.evidence, self.fit_parts, parent.model
            ripples = Ripples(*at, weight, ended.residuals, ended.jacobian)
            self._rippled = parent, (ripples, SeenTorques(*at))
        return self._rippled[1]

    def _space(self, parent: CellFit, seed: Mapping[str, float]) -> Space:
        added = space_for(self.nominal, seed, self.scales, self.tolerance)
        return replace(
            parent.space,
            effects=parent.space.effects + added.effects,
            units=parent.space.units + added.units,
        )
