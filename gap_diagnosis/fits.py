"""Fits of one explanation: a set of effects with all base parameters free, in closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fjr_sim_node import effects as fx

from .least_squares import Solution, solve
from .misfit import Misfit
from .model import LINK_EFFECTS, Model, Simulator
from .records import RecordedExperiment
from .ripples import RIPPLES, RippleSearch
from .screening import Proposal, Screening
from .search_space import STARTS, TOLERANCE, Space, space_for, starts

_KEPT_STARTS = 2
_MOST_STEPS = 40
_MORE_STEPS = 160  # along a valley in which sizes and parameters nearly replace each other
_NESTED_STEPS = 3
_FIRST_STEPS = 6
_RIPPLES_TRIED = 4
_WORTH_A_HARMONIC = 0.9
_RIVAL = 1.5  # a second start that stays this far above the first is not pursued
_NO_PROMISE = 0.998  # of the parent's chi-square: a start that gains less is not pursued far


_Start = tuple[Space, np.ndarray, np.ndarray | None]
"""A space, a point in it, and what is known of the Jacobian there."""


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
    """

    effects: tuple[str, ...]
    model: Model
    space: Space
    solution: Solution
    train_chi2: float
    held_chi2: float

    @property
    def converged(self) -> bool:
        """Whether the optimiser converged; only then is the fit ranked."""
        return self.solution.converged


class Fitter:
    """Fits explanations to one recorded experiment."""

    def __init__(
        self,
        recorded: RecordedExperiment,
        simulator: Simulator,
        noise_std: np.ndarray,
        nominal: Mapping[str, float],
        train: Sequence[int],
        held: Sequence[int],
        tolerance: float = TOLERANCE,
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
        """
        self._recorded, self._simulator = recorded, simulator
        self._levels = [realization.level for realization in recorded.realizations]
        self._misfit = lambda which: Misfit(recorded, simulator, noise_std, which)
        self.nominal = dict(nominal)
        self.tolerance = tolerance
        self.train = Misfit(recorded, simulator, noise_std, train)
        self.held = Misfit(recorded, simulator, noise_std, held)
        self.peak_torque_nm = max(float(np.abs(r.torque).max()) for r in recorded.realizations)
        self.evaluations = 0

    @property
    def catalogue(self) -> list[str]:
        """Effects that this rig can have: a rigid axis has none of transmission and link."""
        rigid = "k0" not in self.nominal
        return [effect for effect in STARTS if not (rigid and effect in LINK_EFFECTS)]

    def refit(self) -> Fit:
        """Fit the base parameters alone, level after level added from the lowest amplitude up.

        At a large amplitude a loop near its stability margin answers erratically to a parameter
        that is off; the low ones bring it near first.
        """
        space = Space(self.nominal, (), (), self.tolerance)
        x = np.zeros(len(self.nominal))
        levels = sorted({self._levels[i] for i in self.train.which})
        for highest in levels[:-1]:
            misfit = self._misfit([i for i in self.train.which if self._levels[i] <= highest])
            x = self._reached(space, x, misfit, _FIRST_STEPS).x
        return self._solve((), space, x)

    def judge(self, effects: Sequence[str], model: Model) -> tuple[float, float]:
        """Return training and held-out chi-square of a model."""
        train = self.train.errors([model])[0]
        held = self.held.errors([model])[0]
        return float(train @ train), float(held @ held)

    def across_levels(self, fit: Fit) -> float | None:
        """Return how well an explanation predicts an amplitude that it has not seen.

        For each level the fit is continued on the training data of the other levels, and judged on
        all realizations of that one.

        Returns:
            chi-square per degree of freedom, geometric mean over levels; None with one level.
        """
        levels = sorted(set(self._levels))
        if len(levels) < 2:
            return None
        values = []
        for level in levels:
            others = [i for i in self.train.which if self._levels[i] != level]
            seen, unseen = (
                self._misfit(others),
                self._misfit([i for i, at in enumerate(self._levels) if at == level]),
            )
            known = self._rows(fit, others)
            reached = self._reached(fit.space, fit.solution.x, seen, _NESTED_STEPS, known)
            values.append(unseen.chi2(fit.space.model(reached.x)))
        return float(np.exp(np.mean(np.log(np.maximum(values, 1e-3)))))

    def _rows(self, fit: Fit, which: Sequence[int]) -> np.ndarray:
        """Return the rows of a fit's Jacobian that belong to some of the training realizations."""
        jacobian = fit.solution.jacobian
        by_realization = jacobian.reshape(len(self.train.which), -1, jacobian.shape[1])
        chosen = by_realization[[self.train.which.index(i) for i in which]]
        return chosen.reshape(-1, jacobian.shape[1])

    def _reached(
        self, space: Space, x: np.ndarray, misfit: Misfit, steps: int, known=None
    ) -> Solution:
        """Return where a few steps lead on some of the realizations."""

        def residuals(points: np.ndarray) -> np.ndarray:
            self.evaluations += len(points)
            return misfit.errors([space.model(point) for point in points])

        return solve(residuals, x, *space.bounds(), most_steps=steps, known=known)

    def screening(self, parent: Fit, effect: str) -> Screening:
        """Return what the starts of an effect promise beside a fit."""
        cycles = None
        if effect in RIPPLES and self._recorded.repeatable:
            cycles = self._ripples(effect, parent).cycles(_RIPPLES_TRIED)
        return Screening(
            parent.solution,
            parent.model,
            starts(effect, self.peak_torque_nm, cycles),
            partial(self._space, parent),
            self._errors,
        )

    def _ripples(self, effect: str, parent: Fit) -> RippleSearch:
        return RippleSearch(
            effect, self._recorded, self._simulator, self.train, parent.model, parent.solution
        )

    def _space(self, parent: Fit, seed: Mapping[str, float]) -> Space:
        added = space_for(self.nominal, seed)
        return Space(
            self.nominal,
            parent.space.effects + added.effects,
            parent.space.units + added.units,
            self.tolerance,
        )

    def _errors(self, models: Sequence[Model]) -> np.ndarray:
        self.evaluations += len(models)
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
        if proposals[0][0] > _NO_PROMISE * parent.train_chi2:
            return self._without_promise(parent, effect, names, proposals[0], give_up_above)
        fits: list[Fit] = []
        for _, space, point in _different(proposals, _KEPT_STARTS):
            limit = give_up_above
            fits.append(self._solve(names, space, point, limit, known=parent.solution.jacobian))
            rival = _RIVAL * fits[-1].train_chi2
            give_up_above = rival if limit is None else min(limit, rival)
        return min(fits, key=lambda fit: (not fit.converged, fit.train_chi2))

    def continued(self, fit: Fit) -> Fit:
        """Return a fit that has not converged, taken further from where it stands."""
        return self._solve(
            fit.effects, fit.space, fit.solution.x, most_steps=_MORE_STEPS,
            known=fit.solution.jacobian,
        )  # fmt: skip

    def with_second_harmonics(self, fit: Fit) -> Fit:
        """Return a fit with a second harmonic of its ripples, or the fit itself if none helps.

        One ripple fitted to two lies between them, so that both are looked for anew as well.
        """
        for effect in fit.effects:
            if effect not in RIPPLES or f"{effect}.second_ratio" in fit.space.effects:
                continue
            found = [*self._second_harmonics(fit, effect), *self._two_harmonics(fit, effect)]
            for space, point, known in found:
                worth = _WORTH_A_HARMONIC * fit.train_chi2
                richer = self._solve(fit.effects, space, point, worth, known=known)
                if richer.converged and richer.train_chi2 < worth:
                    fit = richer
        return fit

    def _second_harmonics(self, fit: Fit, effect: str) -> list[_Start]:
        """Return where to start with a second harmonic of a ripple; nothing if none gains."""
        ratio, phase = f"{effect}.second_ratio", f"{effect}.second_phase_rad"
        found = Screening(
            fit.solution,
            fit.model,
            [{ratio: 0.2, phase: angle} for angle in (0.0, 0.5 * np.pi)],
            partial(self._space, fit),
            self._errors,
        ).proposals()
        if not found or found[0][0] > _NO_PROMISE * fit.train_chi2:
            return []
        return [(found[0][1], found[0][2], fit.solution.jacobian)]

    def _two_harmonics(self, fit: Fit, effect: str) -> list[_Start]:
        """Return where to start with a ripple and its second harmonic in place of a ripple."""
        if not self._recorded.repeatable:
            return []
        rest = self.without(fit, effect)
        size, *shape = (name for name in fit.space.effects if name.startswith(f"{effect}."))
        names = (size, *shape, f"{effect}.second_ratio", f"{effect}.second_phase_rad")
        found = []
        for values in self._ripples(effect, rest).harmonics(_RIPPLES_TRIED):
            for share in (1.0, 0.4):
                seed = dict(zip(names, (share * values[0], *values[1:]), strict=True))
                space = self._space(rest, seed)
                point = np.clip(space.point(rest.model.with_effects(seed)), *space.bounds())
                found.append((space, point, None))
        errors = self._errors([space.model(point) for space, point, _ in found])
        return [found[int(np.argmin(np.einsum("ij,ij->i", errors, errors)))]]

    def without(self, fit: Fit, effect: str) -> Fit:
        """Return a fit with one of its effects off and all else as it was: not a minimum."""
        base = len(fit.space.nominal)
        names = [n for n in fit.space.effects if not n.startswith(f"{effect}.")]
        chosen = [base + fit.space.effects.index(name) for name in names]
        units = tuple(fit.space.units[index - base] for index in chosen)
        space = Space(fit.space.nominal, tuple(names), units, fit.space.tolerance)
        columns = [*range(base), *chosen]
        x = fit.solution.x[columns]
        errors = self._errors([space.model(x)])[0]
        cost = float(errors @ errors)
        solution = Solution(x, cost, fit.solution.jacobian[:, columns], errors, False, 1)
        rest = tuple(name for name in fit.effects if name != effect)
        return Fit(rest, space.model(x), space, solution, cost, float("inf"))

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
            seed.update(starts(effect, self.peak_torque_nm)[0])
            space = self._space(parent, seed)
            start = np.clip(space.point(parent.model), *space.bounds())
        fit = self._solve(names, space, start, most_steps=1, known=parent.solution.jacobian)
        if fit.train_chi2 < _NO_PROMISE * parent.train_chi2:
            known = fit.solution.jacobian
            return self._solve(names, space, fit.solution.x, give_up_above, known=known)
        return replace(fit, solution=replace(fit.solution, converged=parent.converged))

    def _solve(
        self,
        effects: tuple[str, ...],
        space: Space,
        start: np.ndarray,
        give_up_above: float | None = None,
        most_steps: int = _MOST_STEPS,
        known: np.ndarray | None = None,
    ) -> Fit:
        low, high = space.bounds()

        def residuals(points: np.ndarray) -> np.ndarray:
            return self._errors([space.model(point) for point in points])

        solution = solve(
            residuals, start, low, high,
            most_steps=most_steps, give_up_above=give_up_above, known=known,
        )  # fmt: skip
        model = space.model(solution.x)
        held = self.held.errors([model])[0]
        return Fit(effects, model, space, solution, solution.cost, float(held @ held))


def _different(proposals: Sequence[Proposal], most: int) -> list[Proposal]:
    """Return the best proposals that differ by more than a size, at the most `most`."""
    kept: list[Proposal] = []
    for proposal in proposals:
        if all(proposal[1] is not other[1] for other in kept):
            kept.append(proposal)
        if len(kept) == most:
            break
    return kept
