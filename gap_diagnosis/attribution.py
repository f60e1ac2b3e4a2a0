"""Which effect: the refit first, then single effects, then combinations, ranked on held-out data.

Every candidate is fitted in closed loop with all base parameters free. Candidates are ranked by the
chi-square per degree of freedom on realizations that the fit has not seen, and, where it matters,
on an amplitude that it has not seen. All thresholds are ratios of those figures, because a rig is
never exactly of the model's family. They were set by hand on training cases of the blind check.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .fits import Fit, Fitter
from .ripples import RIPPLES

CERTAIN = 60.0
"""Least fall of the held-out chi-square that an effect must bring, whatever its share."""
SMALL_GAIN = 1.25
"""An effect must lower the held-out misfit of the refit at least by this factor."""
SECOND_GAIN = 2.0
"""A second effect must lower the held-out misfit of the first at least by this factor."""
NOTHING_LEFT = 2.0
"""Held-out misfit per degree of freedom below which nothing is left to explain."""
PLAIN = 4.0
"""The same for the refit alone, where no effect gains anything."""
STANDS_OUT = 40.0
"""An explanation that leaves more must stand out: the refit's misfit beyond noise over its own,
times the next explanation's misfit over its own. A rig's law is never exactly the catalogue's, so a
right one may leave a lot; what only substitutes for an unknown effect has others nearly as good
(at most 18 on the training cases it was set by, right ones at least 90; one later substitute, a
ripple of the torque constant that goes for cogging, passed)."""
TIE = 0.5
"""Explanations can't be told apart if their misfits differ by less than this share of what even
the best leaves beyond noise: so much the model's own form may be wrong."""

NEAR_EQUIVALENTS: tuple[frozenset[str], ...] = (
    frozenset({"torque_bias", "asymmetric_friction", "gravity", "cogging"}),
    frozenset({"backlash", "piecewise_stiffness"}),
    frozenset({"delay", "actuator_lag"}),
    frozenset({"transmission_damping", "hysteresis"}),
)
"""Effects that a motor-side encoder can hardly tell apart; where one promises, all are fitted."""

_FINALISTS = 4
_CLOSE = 2.0
_GIVE_UP = 4.0
_NEAR = 10.0
_ALIKE = 1.3  # near equivalents that fit worse than this are looked for again from each other
_NOTHING = 1.0  # misfit per degree of freedom that noise alone leaves
_WORTH_A_PAIR = 2.0
_WORTH_A_HARMONIC = 1.3
_SECOND_PROMISE = 1.2  # a second effect that has not gained that much after a few steps is dropped
_PROMISING_SECONDS = 5
_PROMISING_PARTNERS = 2
_SCREENED = 2  # times as many are tried at several sizes as are fitted

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Attribution:
    """What the search found.

    Attributes:
        refit: the base parameters alone.
        candidates: all explanations with effects that were fitted, best first; those that have not
            converged stand last.
        best: the explanation chosen; the refit if no effect is called for.
        tied: explanations that the data can't tell from the best, without it.
        explained: whether the best leaves nothing worth explaining.
    """

    refit: Fit
    candidates: tuple[Fit, ...]
    best: Fit
    tied: tuple[Fit, ...]
    explained: bool


def _partners(found: Sequence[str], among: set[str]) -> list[str]:
    """Return the near equivalents of effects, so that a set is never short of one not tried."""
    groups = [group for group in NEAR_EQUIVALENTS if group & set(found)]
    return sorted(among & set().union(*groups))


def _stands_for(effects: Sequence[str], others: Sequence[str]) -> bool:
    """Tell whether explanations differ by one effect and a near equivalent of it."""
    mine, theirs = set(effects) - set(others), set(others) - set(effects)
    return len(mine) == 1 and bool(_partners(sorted(theirs), mine))


def stands_out(left: float, refit: float, rival: float) -> float:
    """Return by how much an explanation beats refit and next explanation, multiplied.

    Args:
        left: its misfit per degree of freedom, above 1.
        refit: that of the refit.
        rival: that of the next explanation.
    """
    return (refit - _NOTHING) / (left - _NOTHING) * rival / left


class Search:
    """The search over explanations of one experiment."""

    def __init__(self, fitter: Fitter, progress: Progress = lambda _: None) -> None:
        """Take the fitter of the experiment."""
        self._fitter = fitter
        self._progress = progress
        self._fits: dict[tuple[str, ...], Fit] = {}

    def misfit(self, fit: Fit) -> float:
        """Return the chi-square per degree of freedom of a fit over held-out realizations."""
        return fit.held_chi2 / self._fitter.held.size

    def _best(self, count: int) -> Fit | None:
        """Return the best explanation of `count` effects; None if none has converged.

        Among those that are close on held-out realizations, the prediction of an amplitude that the
        fit has not seen decides with the same weight; among those that can't be told apart, the one
        with the fewest parameters.
        """
        ranked = self._ranked(count)
        close = [f for f in ranked[:_FINALISTS] if self.misfit(f) < _CLOSE * self.misfit(ranked[0])]
        if len(close) < 2:
            return ranked[0] if ranked else None
        scores = []
        for fit in close:
            self._progress(f"{' + '.join(fit.effects)} on unseen amplitudes")
            amplitudes = self._fitter.across_levels(fit)
            scores.append(self.misfit(fit) * (1.0 if amplitudes is None else amplitudes))
        best = close[scores.index(min(scores))]
        tied = [best, *self._tied(best)]
        return min(tied, key=lambda fit: (len(fit.space.effects), self.misfit(fit)))

    def run(self) -> Attribution:
        """Search and judge."""
        self._progress("refit of the base parameters")
        refit = self._fitter.refit()
        self._extend(refit, self._fitter.catalogue)
        best = refit
        self._polish(1)
        self._enrich(1)
        single = self._ranked(1)
        if single and self._calls_for(refit, single[0], SMALL_GAIN):
            best = self._best(self._effects_needed(single[0])) or single[0]
        return Attribution(
            refit, self._all_ranked(), best, self._tied(best), self._explains(refit, best)
        )

    def _extend(
        self,
        parent: Fit,
        effects: Sequence[str],
        most: int | None = None,
        near: float = _NEAR,
    ) -> None:
        """Fit the parent with each effect more, in the order of what their starts achieve.

        Args:
            parent: the explanation to extend.
            effects: identifiers to add, one at a time.
            most: how many of them to pursue; None for all.
            near: how many times the best chi-square a converged fit may have to be left alone.
        """
        rivals = [fit.train_chi2 for fit in self._ranked(len(parent.effects) + 1)]
        least = min(parent.train_chi2, *rivals) if rivals else parent.train_chi2
        settled = self._settled(len(parent.effects) + 1, near)
        effects = [e for e in effects if tuple(sorted((*parent.effects, e))) not in settled]
        screened = {effect: self._fitter.screening(parent, effect) for effect in effects}
        hopeful = sorted(effects, key=lambda effect: -screened[effect].gain)
        if most is not None:
            hopeful = hopeful[: _SCREENED * most]
        proposals = {effect: screened[effect].proposals() for effect in hopeful}
        ordered = sorted(hopeful, key=lambda effect: proposals[effect][0][0])[:most]
        for partner in _partners(ordered[:_PROMISING_PARTNERS], set(effects) - set(ordered)):
            proposals.setdefault(partner, screened[partner].proposals())
            ordered.append(partner)
        for number, effect in enumerate(ordered, 1):
            name = " + ".join((*parent.effects, effect))
            self._progress(f"{name} ({number} of {len(ordered)})")
            limit = _GIVE_UP * max(least, self._fitter.train.size)
            if most is not None:
                limit = min(limit, parent.train_chi2 / _SECOND_PROMISE)
            fit = self._fitter.add(parent, effect, proposals[effect], limit)
            key = fit.effects
            if key not in self._fits or fit.train_chi2 < self._fits[key].train_chi2:
                self._fits[key] = fit
            least = min(least, fit.train_chi2)

    def _enrich(self, count: int) -> None:
        """Give second harmonics to the ripples of the explanations that are near the best."""
        ranked = self._ranked(count)
        for fit in ranked[:_FINALISTS]:
            near = self.misfit(fit) < _CLOSE * self.misfit(ranked[0])
            if near and self.misfit(fit) > _WORTH_A_HARMONIC and set(fit.effects) & set(RIPPLES):
                self._progress(f"{' + '.join(fit.effects)}, second harmonic")
                self._fits[fit.effects] = self._fitter.with_second_harmonics(fit)

    def _ranked(self, count: int) -> list[Fit]:
        """Return the converged fits of `count` effects, best first."""
        fits = [fit for fit in self._fits.values() if len(fit.effects) == count and fit.converged]
        return sorted(fits, key=self.misfit)

    def _all_ranked(self) -> tuple[Fit, ...]:
        ordered = sorted(self._fits.values(), key=lambda fit: (not fit.converged, self.misfit(fit)))
        return tuple(ordered)

    def _calls_for(self, simple: Fit, rich: Fit, gain: float) -> bool:
        """Whether the richer explanation is worth its effect: a gain on held-out data.

        What gains on held-out data alone has only happened to extrapolate better.
        """
        before, after = self.misfit(simple), self.misfit(rich)
        certain = before - after > CERTAIN / self._fitter.held.size
        return certain and min(before / after, simple.train_chi2 / rich.train_chi2) > gain

    def _explains(self, refit: Fit, best: Fit) -> bool:
        left = self.misfit(best)
        if not best.effects:
            return left < PLAIN
        if left < NOTHING_LEFT:
            return True
        return stands_out(left, self.misfit(refit), self._next(refit, best)) > STANDS_OUT

    def _next(self, refit: Fit, best: Fit) -> float:
        """Return the misfit of the best explanation that does not stand for the chosen one.

        A fit that was given up counts as well: it could only have become better.
        """
        alike = {*best.effects, *_partners(best.effects, set(self._fitter.catalogue))}
        others = [
            fit
            for fit in self._fits.values()
            if len(fit.effects) == len(best.effects) and not set(fit.effects) <= alike
        ]
        return min(self.misfit(fit) for fit in (refit, *others))

    def _effects_needed(self, best: Fit) -> int:
        """Search forward, backward and by swaps for a second effect; return how many to name."""
        if self.misfit(best) < _WORTH_A_PAIR:
            return 1
        for parent in self._ranked(1)[:2]:
            if self.misfit(parent) < _NEAR * self.misfit(best):
                others = [e for e in self._fitter.catalogue if e not in parent.effects]
                self._extend(parent, others, _PROMISING_SECONDS)
            if any(self.misfit(pair) < NOTHING_LEFT for pair in self._ranked(2)):
                break
        self._swap(best)
        self._polish(2)
        self._enrich(2)
        pairs = self._ranked(2)
        return 2 if pairs and self._calls_for(best, pairs[0], SECOND_GAIN) else 1

    def _swap(self, best: Fit) -> None:
        """Fit the best pair with each member replaced by its near equivalents."""
        pairs = self._ranked(2)
        if not pairs or not self._calls_for(best, pairs[0], SECOND_GAIN):
            return
        for kept, swapped in (pairs[0].effects, pairs[0].effects[::-1]):
            partners = _partners([swapped], set(self._fitter.catalogue) - {kept, swapped})
            if partners:
                self._extend(self._fitter.without(pairs[0], swapped), partners, near=_ALIKE)

    def _settled(self, count: int, near: float) -> set[tuple[str, ...]]:
        """Return which explanations of `count` effects another start could not help."""
        ranked = self._ranked(count)
        best = min((fit.train_chi2 for fit in ranked), default=math.inf)
        return {fit.effects for fit in ranked if fit.train_chi2 < near * best}

    def _polish(self, count: int) -> None:
        """Take fits further that have not converged but would lead, or stand for what leads."""
        ranked = self._ranked(count)
        best = min((fit.train_chi2 for fit in ranked), default=math.inf)
        for effects, fit in list(self._fits.items()):
            stands = ranked and _stands_for(effects, ranked[0].effects)
            limit = _NEAR * best if stands else best
            if len(effects) == count and not fit.converged and fit.train_chi2 < limit:
                self._progress(f"{' + '.join(effects)}, further")
                self._fits[effects] = self._fitter.continued(fit)

    def _tied(self, best: Fit) -> tuple[Fit, ...]:
        """Return the converged explanations of as many effects that do as well as the best."""
        if not best.effects:
            return ()
        left = self.misfit(best)
        limit = left + 0.5 * CERTAIN / self._fitter.held.size + TIE * max(left - _NOTHING, 0.0)
        return tuple(
            fit
            for fit in self._ranked(len(best.effects))
            if fit is not best and self.misfit(fit) < limit
        )
