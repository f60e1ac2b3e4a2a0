"""Causes beside a remainder: one after the other, each kept only if unseen parts call for it.

An effect is added if it raises the log-likelihood of nearly all parts that no fit has seen, by more
than these parts differ; an effect that the others can do without is taken out again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

from fjr_sim_node import effects as fx

from .cell_fits import CellFit, CellFitter
from .equivalents import ONE_CAUSE, founded, holders, partners, plainness
from .found import Found
from .friction_left import FRICTION, lacks_friction
from .gains import Gain, closed, gain, left_of, stands_for
from .harmonics import with_second_harmonic
from .presence import at_its_bound
from .screening import Proposal, Screening

MOST_CAUSES = 5
_PROPOSED, _FITTED, _STARTS = (7, 5), (5, 3), (2, 1)
"""Effects that are tried at several sizes, those of them that are fitted, and from how many starts:
beside no cause yet, beside others."""
_PARENTS = 3  # leading fits beside which a second cause of slow motion is looked for
_POLISHED = 2  # leading fits of a step that are taken further
_WORTH_A_HARMONIC = 1.3  # a misfit: what noise leaves is no second harmonic
_AGAIN = 8  # effects that are screened beside a cause, and those that depend on others
_OUTDATED = 0.1  # of the squared error that is left: then what was screened before is too far
NOTHING_LEFT = 2.0
"""Mean squared error over noise below which noise explains what is left."""
LEAST_CLOSED = 0.25
"""Least share of what is left, in the band where it gains most, that a further cause closes: one
that closes less would not be named, for it may be a part of what no effect explains."""
LEAST_CLOSED_LATER = 0.5
"""The same for a third cause and any later one, of which one must be sure."""
_CERTAIN_CAUSES = 2
_MUCH = 0.1
"""Share of the motion that an explanation misses, rms, above which something great is not found
yet: where what promises most does not pass, what promises less is fitted, too."""
_MUCH_LESS = 0.3  # of the greatest gain: a cause that gains less waits for the next step
_START_LESS = 0.2  # of the greatest gain of a start: an effect whose best one gains less waits

Progress = Callable[[str], None]


class Stepwise:
    """The search over causes of one set of records."""

    def __init__(
        self,
        fitter: CellFitter,
        effects: Sequence[str],
        progress: Progress = lambda _: None,
        until: float = float("inf"),
        misses: Callable[[CellFit], float] = lambda _: 0.0,
    ) -> None:
        """Take what to search.

        Args:
            fitter: fits explanations.
            effects: identifiers to try.
            progress: told what is tried.
            until: instant of `time.monotonic` after which nothing new is begun.
            misses: how much of the motion an explanation misses, as a share.
        """
        self._fitter, self._effects, self._progress, self._until = fitter, effects, progress, until
        self._misses = misses
        self._first: tuple[CellFit, dict[str, Screening]] | None = None

    def run(self, refit: CellFit) -> Found:
        """Search forward from the fit of the base parameters alone."""
        found = Found([refit])
        while len(found.best.effects) < MOST_CAUSES:
            if self._fitter.misfit(found.best) < NOTHING_LEFT:
                break
            if self._over:
                found.complete = False
                break
            fits = self._extended(found.best, found.steps[0])
            chosen = self._repeating(fits, found)
            slow = self._fitter.evidence.slow
            if chosen is None and slow:
                fits = self._pairs(fits, found.steps[0])
                chosen = self._repeating(fits, found)
            if chosen is None and not self._over and self._misses(found.best) > _MUCH:
                passed = [fit.effects[-1] for fit in fits]
                fits = self._extended(found.best, found.steps[0], passed)
                chosen = self._repeating(fits, found)
            if chosen is None and not slow and not self._over:
                fits = self._frictions(fits, found)
                chosen = self._repeating(fits, found)
            if chosen is None:
                break
            found.alternatives[chosen.effects[-1]] = self._tied(chosen, fits, found.best)
            found.steps.append(chosen)
            self._replace_bounded(found)
        return found

    def _replace_bounded(self, found: Found) -> None:
        """Put another effect in the place of a former cause whose shape has come to a bound.

        While a further cause is missing, a law may do in part what that does, and beside it end as
        a limit case of another law: a cable that gives way at once is viscous friction.
        """
        for effect in found.best.effects[:-1]:
            best = found.best
            if not at_its_bound(best, effect):
                continue
            without = self._fitter.without(best, effect)
            fits = self._extended(without, found.steps[0])
            free = [f for f in fits if not at_its_bound(f, f.effects[-1])]
            other = self._chosen(free, without)
            worth = self._gain(best, without).mean
            if other is None or not stands_for(self._gain(best, other), worth):
                continue
            before = [fit for fit in found.steps if effect not in fit.effects]
            found.alternatives[other.effects[-1]] = self._tied(other, fits, without)
            found.steps[:] = [*before, without, other]

    def _pairs(
        self, fits: Sequence[CellFit], refit: CellFit, tried: Sequence[str] = ()
    ) -> list[CellFit]:
        """Return the leading fits with each promising effect more, best on unseen parts first.

        Causes of slow motion may show only together: friction and gravity, say, are offsets of
        every short way, so one alone leaves as much as it takes away.
        """
        pairs = [pair for fit in fits[:_PARENTS] for pair in self._extended(fit, refit, tried)]
        return self._ranked(pairs, refit)

    def _frictions(self, fits: Sequence[CellFit], found: Found) -> list[CellFit]:
        """Return pairs of laws of friction, where most of what is missing goes with velocity.

        Of a friction that falls from breakaway and then grows, neither law alone is much better.
        """
        laws = [fit for fit in fits if fit.effects[-1] in FRICTION]
        if not laws or not lacks_friction(self._fitter, found.best):
            return []
        others = [e for e in self._effects if e not in FRICTION]
        return self._pairs(laws, found.steps[0], others)

    def _repeating(self, fits: Sequence[CellFit], found: Found) -> CellFit | None:
        """Return what `_chosen` takes of the fits that close enough, and keep them all."""
        best = found.best
        found.rivals[len(best.effects) + 1] = [
            *found.rivals.get(len(best.effects) + 1, []), *fits
        ]  # fmt: skip
        least = self._least_closed(found)
        return self._chosen([f for f in fits if self._closes(f, best) >= least], best)

    def _closes(self, fit: CellFit, before: CellFit) -> float:
        """Return how much a fit closes of the band in which it gains most, or of all if more.

        What closes nearly all of a slow error may gain most where little but noise is, by many
        lines that each become a little better.
        """
        return max(closed(self._fitter, fit, before), 1.0 - left_of(self._fitter, fit, before))

    @property
    def _over(self) -> bool:
        return time.monotonic() > self._until

    @staticmethod
    def _least_closed(found: Found) -> float:
        """Return how much of its best band a further cause must close to be named in the end."""
        return LEAST_CLOSED if len(found.best.effects) < _CERTAIN_CAUSES else LEAST_CLOSED_LATER

    def _extended(
        self, parent: CellFit, refit: CellFit, tried: Sequence[str] = ()
    ) -> list[CellFit]:
        """Return the parent with each promising effect more, best on unseen parts first.

        Args:
            parent: the explanation to extend.
            refit: the fit of the base parameters alone.
            tried: effects that are left out, since they were tried.
        """
        names, nominal = self._effects, self._fitter.nominal
        there = {*parent.effects, *tried, *self._one_cause(parent, refit)}
        effects = [e for e in names if e not in there]
        effects = founded(effects, parent.effects, nominal, names)
        screened = self._screened(parent, effects)
        later = bool(parent.effects)
        hopeful = sorted(screened, key=lambda e: -screened[e].gain)[: _PROPOSED[later]]
        proposals = {e: screened[e].proposals() for e in hopeful}
        ordered = sorted((e for e in hopeful if proposals[e]), key=lambda e: proposals[e][0][0])
        chosen = self._worth_a_fit(parent, proposals, ordered[: _FITTED[later]])
        held = founded(holders(chosen[:2], names), parent.effects, nominal, names)
        alike = {*partners(chosen[:2], set(effects)), *held}
        for effect in sorted(alike - set(chosen)):
            if effect not in proposals:
                again = screened.get(effect) or self._fitter.screening(parent, effect)
                proposals[effect] = again.proposals()
            chosen.append(effect)
        fits: list[CellFit] = []
        for number, effect in enumerate(chosen, 1):
            self._progress(f"{' + '.join((*parent.effects, effect))} ({number} of {len(chosen)})")
            parts = [f for f in fits if f.effects[-1] in fx.EFFECTS[effect].contains]
            begun = [p for f in parts for p in self._fitter.from_part(parent, effect, f)]
            begun = sorted([*begun, *proposals[effect]], key=lambda p: p[0])
            fit = self._fitter.add(parent, effect, begun, _STARTS[later])
            if fit is not None:
                fits.append(fit)
        fits = self._ranked(fits, parent)
        first = [fit.effects[-1] for fit in fits[:_POLISHED]]
        near = len(partners(first[:1], set(first))) > 1
        leading = [self._enriched(self._settled(f, parent, near)) for f in fits[:_POLISHED]]
        return self._ranked([*leading, *fits[_POLISHED:]], parent)

    def _worth_a_fit(
        self, parent: CellFit, proposals: Mapping[str, list[Proposal]], ordered: list[str]
    ) -> list[str]:
        """Return the effects whose starts gain enough beside the best start of all.

        What gains much less waits for the next step anyway.
        """
        gains = {e: self._fitter.begun(parent) - proposals[e][0][0] for e in ordered}
        most = max(gains.values(), default=0.0)
        return [e for e in ordered if gains[e] >= _START_LESS * most]

    def _ranked(self, fits: Sequence[CellFit], parent: CellFit) -> list[CellFit]:
        return sorted(fits, key=lambda fit: -self._gain(fit, parent).mean)

    def _settled(self, fit: CellFit, parent: CellFit, alike: bool) -> CellFit:
        """Return a fit that leads, taken to its end.

        A fit begins with the weights of what its parent leaves, so one that closes most of that
        ends elsewhere by the weights of what itself leaves; which of two that are near equivalents
        does better shows there alone.

        Args:
            fit: one that leads.
            parent: the fit that it extends.
            alike: whether it has a near equivalent that leads as well.
        """
        closes_little = left_of(self._fitter, fit, parent) > _OUTDATED
        if fit.solution.converged and closes_little and not alike:
            return fit
        self._progress(f"{' + '.join(fit.effects)}, further")
        return self._fitter.further(fit)

    def _enriched(self, fit: CellFit) -> CellFit:
        """Return a fit whose last effect is a ripple with its second harmonic, if that repeats.

        A ripple of two harmonics that is taken for one leaves what looks like a further cause.
        """
        effect = fit.effects[-1]
        if not fx.EFFECTS[effect].ripple or self._fitter.misfit(fit) < _WORTH_A_HARMONIC:
            return fit
        self._progress(f"{' + '.join(fit.effects)}, second harmonic")
        richer = with_second_harmonic(self._fitter, fit, effect)
        if richer is None or not self._gain(richer, fit).present:
            return fit
        # both by the weights of what they leave themselves
        richer, alone = self._fitter.further(richer), self._fitter.further(fit)
        return richer if self._gain(richer, alone).present else alone

    def _one_cause(self, parent: CellFit, refit: CellFit) -> list[str]:
        """Return what could only name a cause of the parent twice; see `ONE_CAUSE`."""
        left, gap = self._fitter.misfit(parent) - 1.0, self._fitter.misfit(refit) - 1.0
        return partners(parent.effects, set(self._effects)) if left < ONE_CAUSE * gap else []

    def _screened(self, parent: CellFit, effects: Sequence[str]) -> dict[str, Screening]:
        """Return screenings beside a fit: of all effects the first time, then of those that count.

        What a seed changes hardly depends on causes beside it, so the first changes say which
        effects may gain beside others; where a cause has closed most of the error, that is not so
        near any more, and all are screened anew. So are effects that depend on others.
        """
        anew = self._first is None or left_of(self._fitter, parent, self._first[0]) < _OUTDATED
        if self._first is not None and not anew:
            before, screened = self._first
            promise = {
                e: self._fitter.promise(screened[e], before, parent)
                for e in effects
                if e in screened and not fx.EFFECTS[e].depends_on_others
            }
            best = sorted(promise, key=lambda e: -promise[e])[:_AGAIN]
            effects = [e for e in effects if e in best or e not in promise]
        found = {}
        for effect in effects:
            self._progress(f"{' + '.join((*parent.effects, effect))}, screened")
            found[effect] = self._fitter.screening(parent, effect)
        if anew:
            self._first = parent, found
        return found

    def _gain(self, after: CellFit, before: CellFit) -> Gain:
        return gain(self._fitter, after, before)

    def _chosen(self, fits: Sequence[CellFit], parent: CellFit) -> CellFit | None:
        """Return the best fit whose gain repeats, unless another one gains much more.

        Of those that unseen parts cannot tell from it, one that holds no other as a limit case, the
        one with the fewest parameters, and then the commoner one.
        """
        gains = [gain(self._fitter, fit, parent, fit.acts) for fit in fits]
        repeating = [
            fit
            for fit, found in zip(fits, gains, strict=True)
            if found.present and found.mean > _MUCH_LESS * gains[0].mean
        ]
        if not repeating:
            return None
        first = repeating[0]
        worth = self._gain(first, parent).mean
        alike = [f for f in repeating if f is first or stands_for(self._gain(first, f), worth)]
        laws = [fit.effects for fit in alike]
        return min(alike, key=lambda fit: plainness(fit.effects, fit.space.effects, laws))

    def _tied(self, chosen: CellFit, fits: Sequence[CellFit], parent: CellFit) -> list[str]:
        """Return the effects that unseen parts cannot tell from the chosen one."""
        first = self._gain(chosen, parent).mean
        others = [f for f in fits if f is not chosen and f.effects[:-1] == chosen.effects[:-1]]
        return [f.effects[-1] for f in others if stands_for(self._gain(chosen, f), first)]
