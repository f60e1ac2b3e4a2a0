"""Fits of one explanation: a set of effects with all base parameters free, in closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from fjr_records.periodic import RecordedExperiment
from fjr_sim_node import effects as fx

from ..model.misfit import Misfit
from ..model.rig_model import Model
from ..model.simulated_rig import Simulator
from .catalogue import catalogue
from .from_parts import from_part
from .least_squares import Solution, solve
from .ripples import RippleSearch
from .screening import Costs, Proposal, Screening, different, sums_of_squares
from .search_space import TOLERANCE, Scales, Space, space_for, starts

_KEPT_STARTS = 2
_MOST_STEPS = 40
MORE_STEPS = 160  # along a valley in which sizes and parameters nearly replace each other
_FIRST_STEPS = 6
RIPPLES_TRIED = 4
_LITTLE = 0.95  # of the parent's chi-square: another start of what leaves more is not pursued,
_HOPELESS = 2.0  # nor of what leaves as many times that up to which a fit goes on,
_FOUND = 0.01  # nor of what leaves less than this share of the parent's
_RIVAL = 1.5  # a second start that stays this far above the first is not pursued
NO_PROMISE = 0.998  # of the parent's chi-square: a start that gains less is not pursued far


@dataclass(frozen=True)
class Fit:
    """One explanation after fitting.

    Attributes:
        effects: identifiers, sorted; empty for the refit of the base parameters alone.
        model: the fitted model.
        space: the space in which it was fitted.
        solution: the optimiser's end.
        train_chi2: sum of squares over the training realizations.
        held_chi2: sum of squares over the held-out realizations.
        without: training chi-square of the fit that lacks an effect, by identifier, where that was
            fitted.
    """

    effects: tuple[str, ...]
    model: Model
    space: Space
    solution: Solution
    train_chi2: float
    held_chi2: float
    without: Mapping[str, float] = field(default_factory=dict)

    @property
    def converged(self) -> bool:
        """Whether the optimiser converged; only then is the fit ranked."""
        return self.solution.converged


class Fitter:
    """Fits explanations to one recorded experiment.

    Attributes:
        recorded: the experiment.
        nominal: datasheet values of the base parameters.
        tolerance: how far a datasheet value may be off, relative.
        levels: level of each realization.
        misfit_of: takes indices of realizations, returns their misfit.
        train, held: misfit of the realizations to fit, and of those to judge by.
        scales: what is usual in the record, the measures of starts and bounds.
        catalogue: effects to look for.
    """

    def __init__(
        self,
        recorded: RecordedExperiment,
        simulator: Simulator,
        noise_std: np.ndarray,
        nominal: Mapping[str, float],
        train: Sequence[int],
        held: Sequence[int],
        tolerance: float = TOLERANCE,
        effects: Sequence[str] | None = None,
    ) -> None:
        """Prepare.

        Args:
            recorded: the experiment.
            simulator: repeats it.
            noise_std: `NoiseLevels.of_outputs`, (realizations, outputs, lines), rad.
            nominal: datasheet values of the base parameters.
            train: realizations to fit.
            held: realizations to judge by.
            tolerance: how far a datasheet value may be off, relative.
            effects: identifiers to look for; None for all.
        """
        self.catalogue = catalogue(nominal, effects)
        self.recorded, self._simulator, self._noise_std = recorded, simulator, noise_std
        self.levels = [realization.level for realization in recorded.realizations]
        self.misfit_of = lambda which: Misfit(recorded, simulator, noise_std, which)
        self.nominal = dict(nominal)
        self.tolerance = tolerance
        self.train = Misfit(recorded, simulator, noise_std, train)
        self.held = Misfit(recorded, simulator, noise_std, held)
        self._few = [next(i for i in train if self.levels[i] == k) for k in self._train_levels]
        self._screened = self.misfit_of(self._few)
        self.scales = Scales.of_experiment(recorded, self.nominal)

    @property
    def _train_levels(self) -> list[int]:
        return sorted({self.levels[i] for i in self.train.which})

    def refit(self) -> Fit:
        """Fit the base parameters alone, level after level added from the lowest amplitude up.

        At a large amplitude a loop near its stability margin answers erratically to a parameter
        that is off; the low ones bring it near first. From then on all models begin the training
        realizations near the refit, so that none of them gains by where it begins.
        """
        space = Space(self.nominal, (), (), self.tolerance, self.scales)
        x = np.zeros(len(self.nominal))
        for highest in self._train_levels[:-1]:
            misfit = self.misfit_of([i for i in self.train.which if self.levels[i] <= highest])
            x = self.reached(space, x, misfit, _FIRST_STEPS).x
        fit = self.solve((), space, x)
        self._simulator.begin_near(fit.model, self._noise_std, self.train.which)
        return self.solve((), space, fit.solution.x, known=fit.solution.jacobian)

    def rows(self, fit: Fit, which: Sequence[int]) -> np.ndarray:
        """Return the rows of a fit's Jacobian that belong to some of the training realizations."""
        jacobian = fit.solution.jacobian
        by_realization = jacobian.reshape(len(self.train.which), -1, jacobian.shape[1])
        chosen = by_realization[[self.train.which.index(i) for i in which]]
        return chosen.reshape(-1, jacobian.shape[1])

    def reached(
        self, space: Space, x: np.ndarray, misfit: Misfit, steps: int, known=None
    ) -> Solution:
        """Return where a few steps lead on some of the realizations."""

        def residuals(points: np.ndarray) -> np.ndarray:
            return misfit.errors([space.model(point) for point in points])

        return solve(residuals, x, *space.bounds(), most_steps=steps, known=known)

    def screening(self, parent: Fit, effect: str) -> Screening:
        """Return what the starts of an effect promise beside a fit.

        They are tried on one realization of each level, and cost as much as they would if all the
        others answered alike.
        """
        cycles = None
        if fx.EFFECTS[effect].ripple and self.recorded.repeatable:
            cycles = self.ripples(effect, parent).cycles(RIPPLES_TRIED)
        solution = self._solution_of_few(parent)
        return Screening(
            solution,
            parent.model,
            starts(effect, self.scales, cycles, self.nominal),
            partial(self.space, parent),
            self._screened.errors,
            self._costs_of_few(parent, solution),
        )

    def from_part(self, parent: Fit, whole: str, fit: Fit) -> list[Proposal]:
        """Return starts of a law beside a fit, from a fit that has one of its parts more."""
        (part,) = set(fit.effects) - set(parent.effects)
        seeds, space = starts(whole, self.scales, None, self.nominal), partial(self.space, parent)
        return from_part(whole, part, fit.model, seeds, space, self.errors, sums_of_squares)

    def promise(self, screened: Screening, parent: Fit) -> float:
        """Return what an effect promises beside a fit, by a screening beside another one."""
        solution = self._solution_of_few(parent)
        one = np.ones(solution.residuals.size)
        return screened.gain_beside(solution, one, self._costs_of_few(parent, solution))

    def _solution_of_few(self, parent: Fit) -> Solution:
        solution, size = parent.solution, len(self.train.which)
        place = [self.train.which.index(i) for i in self._few]
        residuals = solution.residuals.reshape(size, -1)[place].ravel()
        return replace(
            solution, residuals=residuals, jacobian=self.rows(parent, self._few),
            cost=float(residuals @ residuals),
        )  # fmt: skip

    def _costs_of_few(self, parent: Fit, few: Solution) -> Costs:
        scale = parent.train_chi2 / few.cost if few.cost > 0.0 else 1.0  # nothing may be left

        def costs(errors: np.ndarray) -> np.ndarray:
            return scale * sums_of_squares(errors)

        return costs

    def ripples(self, effect: str, parent: Fit) -> RippleSearch:
        """Return what ripples of an effect could do about the errors that a fit leaves."""
        return RippleSearch(
            effect, self.recorded, self._simulator, self.train, parent.model, parent.solution,
            self.scales.cycles(),
        )  # fmt: skip

    def space(self, parent: Fit, seed: Mapping[str, float]) -> Space:
        """Return the space of a fit with the parameters of a seed free as well."""
        added = space_for(self.nominal, seed, self.scales, self.tolerance)
        return replace(
            added,
            effects=parent.space.effects + added.effects,
            units=parent.space.units + added.units,
        )

    def errors(self, models: Sequence[Model]) -> np.ndarray:
        """Return the training error vectors of models, float64 (models, errors)."""
        return self.train.errors(models)

    def add(
        self,
        parent: Fit,
        effect: str,
        proposals: Sequence[Proposal],
        give_up_above: float | None = None,
    ) -> Fit:
        """Fit a parent's explanation with one effect more, from its most promising starts.

        Args:
            parent: the explanation to extend.
            effect: identifier of the effect to add.
            proposals: from `screening(parent, effect)`.
            give_up_above: training chi-square above which a fit is not pursued.

        Returns:
            the best fit; it is never worse than the parent, which it contains.
        """
        names = tuple(sorted((*parent.effects, effect)))
        if proposals[0][0] > NO_PROMISE * parent.train_chi2:
            return self._without_promise(parent, effect, names, proposals[0], give_up_above)
        fits: list[Fit] = []
        for _, space, point in different(proposals, _KEPT_STARTS):
            limit = give_up_above
            fits.append(self.solve(names, space, point, limit, known=parent.solution.jacobian))
            left, most = fits[-1].train_chi2, _LITTLE * parent.train_chi2
            if left > min(most, _HOPELESS * (limit or most)) or left < _FOUND * parent.train_chi2:
                break
            rival = _RIVAL * fits[-1].train_chi2
            give_up_above = rival if limit is None else min(limit, rival)
        return min(fits, key=lambda fit: (not fit.converged, fit.train_chi2))

    def continued(self, fit: Fit) -> Fit:
        """Return a fit that has not converged, taken further from where it stands."""
        return self.solve(
            fit.effects, fit.space, fit.solution.x, most_steps=MORE_STEPS,
            known=fit.solution.jacobian,
        )  # fmt: skip

    def _without_promise(
        self,
        parent: Fit,
        effect: str,
        names: tuple[str, ...],
        proposal: Proposal,
        give_up_above: float | None,
    ) -> Fit:
        """Return the parent with next to nothing of the effect, never worse than the parent.

        No start gained anything; if a step from there gains nothing either, this is where the
        effect ends, as converged as the parent.
        """
        cost, space, start = proposal
        if cost > parent.train_chi2:
            seed = dict.fromkeys(fx.EFFECTS[effect].names, 0.0)
            seed.update(starts(effect, self.scales, nominal=self.nominal)[0])
            space = self.space(parent, seed)
            start = np.clip(space.point(parent.model), *space.bounds())
        fit = self.solve(names, space, start, most_steps=1, known=parent.solution.jacobian)
        if fit.train_chi2 < NO_PROMISE * parent.train_chi2:
            known = fit.solution.jacobian
            return self.solve(names, space, fit.solution.x, give_up_above, known=known)
        return replace(fit, solution=replace(fit.solution, converged=parent.converged))

    def solve(
        self,
        effects: tuple[str, ...],
        space: Space,
        start: np.ndarray,
        give_up_above: float | None = None,
        most_steps: int = _MOST_STEPS,
        known: np.ndarray | None = None,
    ) -> Fit:
        """Return the fit of effects from a start; its other arguments are those of `solve`."""
        low, high = space.bounds()

        def residuals(points: np.ndarray) -> np.ndarray:
            return self.errors([space.model(point) for point in points])

        solution = solve(
            residuals, start, low, high,
            most_steps=most_steps, give_up_above=give_up_above, known=known,
        )  # fmt: skip
        model = space.model(solution.x)
        held = self.held.errors([model])[0]
        return Fit(effects, model, space, solution, solution.cost, float(held @ held))
