"""The search: the refit first, then single effects, then combinations, ranked on held-out data.

Every candidate is fitted in closed loop with all base parameters free. Candidates are ranked by the
chi-square per degree of freedom on realizations that the fit has not seen, and, where it matters,
on an amplitude that it has not seen.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

from fjr_sim_node import effects as fx

from .attribution import NOTHING_LEFT, SECOND_GAIN, SMALL_GAIN, Attribution
from .equivalents import SCALES, founded, holders, partners, plainness, stands_for
from .fits import Fit, Fitter
from .harmonics import with_second_harmonics
from .ranking import Ranking
from .reduced_fits import without, without_scale
from .screening import Proposal, Screening
from .unseen_levels import across_levels

_FINALISTS = 4
_CLOSE = 2.0
_GIVE_UP = 4.0
_NEAR = 10.0
_ALIKE = 1.3  # near equivalents that fit worse than this are looked for again from each other
_WORTH_A_PAIR = 2.0
_WORTH_A_HARMONIC = 1.3
_SECOND_PROMISE = 1.2  # a second effect that has not gained that much after a few steps is dropped
_PROMISING_SECONDS = 5
_PROMISING_PARTNERS = 2
_PARENTS = 2  # leading effects unlike each other, beside which a second one is looked for
_HELD = 2  # of the leading effects: what holds one of them is tried as well
_SCREENED = 2  # times as many are tried at several sizes as are fitted
_SCALED, _FITTED = 12, 8  # effects that are tried at more sizes, and of these fitted

Progress = Callable[[str], None]


class Search:
    """The search over explanations of one experiment."""

    def __init__(
        self, fitter: Fitter, progress: Progress = lambda _: None, until: float = math.inf
    ) -> None:
        """Take the fitter, who is told of each try, and when to stop adding (`time.monotonic`)."""
        self._fitter, self._progress = fitter, progress
        self._until, self._complete = until, True
        self._found = Ranking(fitter)
        self._first: dict[str, Screening] = {}

    def _best(self, count: int) -> Fit | None:
        """Return the best explanation of `count` effects; None if none has converged.

        Among those that are close on held-out realizations, the prediction of an amplitude that the
        fit has not seen decides with the same weight; among those that can't be told apart, the one
        with the fewest parameters. What cannot be told from zero has no name.
        """
        ranked = self._found.sure(count)
        close = self._found.close(ranked[:_FINALISTS], _CLOSE)
        if len(close) < 2:
            return ranked[0] if ranked else None
        scores = []
        for fit in close:
            self._progress(f"{' + '.join(fit.effects)} on unseen amplitudes")
            amplitudes = across_levels(self._fitter, fit)
            scores.append(self._found.misfit(fit) * (1.0 if amplitudes is None else amplitudes))
        best = close[scores.index(min(scores))]
        tied = [best, *self._found.tied(best)]
        laws = [fit.effects for fit in tied]
        return min(
            tied,
            key=lambda fit: (
                *plainness(fit.effects, fit.space.effects, laws),
                self._found.misfit(fit),
            ),
        )

    def run(self) -> Attribution:
        """Search and judge."""
        self._progress("refit of the base parameters")
        refit = self._found.refit = self._fitter.refit()
        self._extend(refit, self._fitter.catalogue)
        leading = [fit.effects[0] for fit in self._found.ranked(1)[:_HELD]]
        self._extend(refit, holders(leading, self._fitter.catalogue))
        self._drop_holders(1)
        best = refit
        self._polish(1)
        self._enrich(1)
        single = self._found.sure(1)
        if single and self._found.calls_for(refit, single[0], SMALL_GAIN):
            best = self._best(self._effects_needed(single[0])) or single[0]
        found = self._found
        return Attribution(
            refit, found.all(), best, found.tied(best), found.explains(refit, best), self._complete
        )

    def _extend(
        self, parent: Fit, effects: Sequence[str], most: int | None = None, near: float = _NEAR
    ) -> None:
        """Fit the parent with each effect more, in the order of what their starts achieve.

        Args:
            parent: the explanation to extend.
            effects: identifiers to add, one at a time.
            most: how many of them to pursue; None for those that start well.
            near: how many times the best chi-square a converged fit may have to be left alone.
        """
        if self._over:
            return
        rivals = [fit.train_chi2 for fit in self._found.ranked(len(parent.effects) + 1)]
        least = min(parent.train_chi2, *rivals) if rivals else parent.train_chi2
        settled = self._found.settled(len(parent.effects) + 1, near)
        effects = [e for e in effects if tuple(sorted((*parent.effects, e))) not in settled]
        names, nominal = self._fitter.catalogue, self._fitter.nominal
        effects = founded(effects, parent.effects, nominal, names)
        hopeful, screened = self._screenings(parent, effects, most)
        hopeful = sorted(hopeful, key=lambda effect: screened[effect].least())[:_SCALED]
        proposals = {effect: screened[effect].proposals() for effect in hopeful}
        ordered = sorted(hopeful, key=lambda effect: proposals[effect][0][0])[: most or _FITTED]
        for partner in partners(ordered[:_PROMISING_PARTNERS], set(effects) - set(ordered)):
            if partner not in proposals:
                again = screened.get(partner) or self._fitter.screening(parent, partner)
                proposals[partner] = again.proposals()
            ordered.append(partner)
        for number, effect in enumerate(ordered, 1):
            if self._over:
                break
            name = " + ".join((*parent.effects, effect))
            self._progress(f"{name} ({number} of {len(ordered)})")
            limit = _GIVE_UP * max(least, self._fitter.train.size)
            if most is not None:
                limit = min(limit, parent.train_chi2 / _SECOND_PROMISE)
            if effect not in names:  # a law of several parts has to do better than its best part
                limit = min(limit, least)
            begun = [*self._from_parts(parent, effect), *proposals[effect]]
            fit = self._fitter.add(parent, effect, sorted(begun, key=lambda p: p[0]), limit)
            key = fit.effects
            if key not in self._found.fits or fit.train_chi2 < self._found.fits[key].train_chi2:
                self._found.fits[key] = fit
            least = min(least, fit.train_chi2)

    def _from_parts(self, parent: Fit, whole: str) -> list[Proposal]:
        """Return starts of a law from the fits that have one of its parts beside a parent."""
        keys = (tuple(sorted((*parent.effects, part))) for part in fx.EFFECTS[whole].contains)
        fits = [self._found.fits[key] for key in keys if key in self._found.fits]
        return [start for fit in fits for start in self._fitter.from_part(parent, whole, fit)]

    def _screenings(
        self, parent: Fit, effects: Sequence[str], most: int | None
    ) -> tuple[list[str], dict[str, Screening]]:
        """Return the hopeful ones of some effects, best first, and screenings beside a fit.

        What a seed changes hardly depends on the effects beside it: so the first screenings say
        which may gain as a second effect, and only those are screened anew, and effects that
        depend on others.
        """
        if most is None or not self._first:
            screened = {effect: self._fitter.screening(parent, effect) for effect in effects}
            self._first = self._first or screened
        else:
            promise = {
                e: self._fitter.promise(self._first[e], parent)
                for e in effects
                if e in self._first and not fx.EFFECTS[e].depends_on_others
            }
            best = sorted(promise, key=lambda e: -promise[e])[: _SCREENED * most]
            again = [e for e in effects if e in best or e not in promise]
            screened = {effect: self._fitter.screening(parent, effect) for effect in again}
        hopeful = sorted(screened, key=lambda effect: -screened[effect].gain)
        return (hopeful if most is None else hopeful[: _SCREENED * most]), screened

    @property
    def _over(self) -> bool:
        """Whether the time is up; what is left untried is remembered."""
        self._complete = self._complete and time.monotonic() <= self._until
        return not self._complete

    def _enrich(self, count: int) -> None:
        """Give second harmonics to the ripples of the explanations that are near the best."""
        for fit in self._found.close(self._found.ranked(count)[:_FINALISTS], _CLOSE):
            ripples = any(fx.EFFECTS[effect].ripple for effect in fit.effects)
            if ripples and self._found.misfit(fit) > _WORTH_A_HARMONIC:
                self._progress(f"{' + '.join(fit.effects)}, second harmonic")
                self._found.fits[fit.effects] = with_second_harmonics(self._fitter, fit)

    def _effects_needed(self, best: Fit) -> int:
        """Search forward, backward and by swaps for a second effect; return how many to name."""
        if self._found.misfit(best) < _WORTH_A_PAIR or self._found.owed_to_its_form(best):
            return 1
        self._take_parents_further(best)
        for parent in self._found.unlike(self._found.ranked(1))[:_PARENTS]:
            if self._found.misfit(parent) < _NEAR * self._found.misfit(best):
                others = [e for e in self._fitter.catalogue if e not in parent.effects]
                self._extend(parent, others, _PROMISING_SECONDS)
            self._found.drop_one_cause_twice()
            if any(self._found.misfit(pair) < NOTHING_LEFT for pair in self._found.ranked(2)):
                break
        self._swap(best)
        self._polish(2)
        self._found.drop_one_cause_twice()
        self._enrich(2)
        if self._pair_called_for(best, self._found.ranked(2)):
            self._drop_scales()
            best = self._found.sure(1)[0]
        return 2 if self._pair_called_for(best, self._found.sure(2)) else 1

    def _take_parents_further(self, best: Fit) -> None:
        """Take to their end the fits that were given up, but would be parents of pairs."""
        for fit in self._found.unlike(self._found.nearest(1))[:_PARENTS]:
            if not fit.converged and self._found.misfit(fit) < _NEAR * self._found.misfit(best):
                self._progress(f"{' + '.join(fit.effects)}, further")
                self._found.fits[fit.effects] = self._fitter.continued(fit)

    def _pair_called_for(self, best: Fit, pairs: Sequence[Fit]) -> bool:
        return bool(pairs) and self._found.calls_for(best, pairs[0], SECOND_GAIN)

    def _drop_scales(self) -> None:
        """Drop pairs, near the best, in which one effect does no more than scale the parameters.

        Such an effect lifts the bounds of the parameters beside the other one. So that one is
        fitted alone without those bounds; where it then does as well, it is the only cause.
        """
        tested: set[tuple[str, ...]] = set()
        while True:
            pairs = self._found.ranked(2)
            near = self._found.close(pairs, _CLOSE)
            left = [f for f in near if f.effects not in tested and set(f.effects) & set(SCALES)]
            if not left:
                return
            pair = left[0]
            tested.add(pair.effects)
            scale = next(effect for effect in SCALES if effect in pair.effects)
            self._progress(f"{' + '.join(pair.effects)}, parameters scaled instead")
            alone = without_scale(self._fitter, pair, scale)
            if alone.converged and alone.train_chi2 < self._found.fits[alone.effects].train_chi2:
                self._found.fits[alone.effects] = alone
            if scale == "torque_gain" or not self._found.calls_for(alone, pair, SECOND_GAIN):
                del self._found.fits[pair.effects]

    def _swap(self, best: Fit) -> None:
        """Fit the best pair with each member replaced by what is near it, holds it or leads.

        And by what it modifies, where the datasheet lacks that.
        """
        pairs = self._found.ranked(2)
        if not pairs or not self._found.calls_for(best, pairs[0], SECOND_GAIN):
            return
        for kept, swapped in (pairs[0].effects, pairs[0].effects[::-1]):
            alike = partners([swapped], set(self._fitter.catalogue) - {kept, swapped})
            alike += holders([swapped], self._fitter.catalogue)
            alike += {fx.EFFECTS[swapped].modifies} & set(self._fitter.catalogue) - {kept}
            leading = [fit.effects[0] for fit in self._found.unlike(self._found.ranked(1))[:_HELD]]
            alike += [e for e in leading if e not in (kept, swapped, *alike)]
            if alike:
                self._extend(without(self._fitter, pairs[0], swapped), alike, near=_ALIKE)
        self._drop_holders(2)

    def _drop_holders(self, count: int) -> None:
        """Drop explanations by a law that nobody asked for where one of its parts does as well.

        None of them leads then; see `Ranking.tied`.
        """
        for effects in [e for e in self._found.fits if len(e) == count]:
            for held in (e for e in effects if e not in self._fitter.catalogue):
                rest = [e for e in effects if e != held]
                parts = (tuple(sorted((*rest, p))) for p in fx.EFFECTS[held].contains)
                plain = [self._found.fits[p] for p in parts if p in self._found.fits]
                if any(
                    not self._found.calls_for(p, self._found.fits[effects], SECOND_GAIN)
                    for p in plain
                ):
                    self._found.holding.append(self._found.fits.pop(effects))
                    break

    def _polish(self, count: int) -> None:
        """Take fits further that have not converged but would lead, or stand for what leads."""
        ranked = self._found.ranked(count)
        best = min((fit.train_chi2 for fit in ranked), default=math.inf)
        for effects, fit in list(self._found.fits.items()):
            stands = ranked and stands_for(effects, ranked[0].effects)
            limit = _NEAR * best if stands else best
            if len(effects) == count and not fit.converged and fit.train_chi2 < limit:
                self._progress(f"{' + '.join(effects)}, further")
                self._found.fits[effects] = self._fitter.continued(fit)
