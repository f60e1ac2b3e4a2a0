"""Causes beside a remainder: one after the other, each kept only if unseen parts call for it.

An effect is added if it raises the log-likelihood of nearly all parts that no fit has seen, by more
than these parts differ; where none does, two may together. An effect that the others can do without
is taken out again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from fjr_kit.telling import Progress

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..fits.gains import closed, left_of
from ..starts.seen_together import LACKED, lacked
from .exchange import drop_hindering, replace_bounded
from .extension import Extension
from .found import Found
from .friction_left import FRICTION, lacks_friction

MOST_CAUSES = 5
_PARENTS = 3  # leading fits beside which a second cause is looked for
_HALVES = 2  # the same of fits that repeat but close too little
LEAST_CLOSED = 0.25
"""Least share of what is left, in the band where it gains most, that a further cause closes: one
that closes less would not be named, for it may be a part of what no effect explains."""
LEAST_CLOSED_LATER = 0.5
"""The same for a third cause and any later one, of which one must be sure; not for the friction
that a datasheet lacks and every joint has."""
_CERTAIN_CAUSES = 2
_MUCH = 0.1
"""Share of the motion that an explanation misses, rms, above which something great is not found
yet: where what promises most does not pass, what promises less is fitted, too."""


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
        self._fitter, self._until, self._misses = fitter, until, misses
        self._lacked = lacked(fitter.nominal)
        self.extension = Extension(fitter, effects, progress)

    def run(self, refit: CellFit) -> Found:
        """Search forward from the fit of the base parameters alone."""
        return self.go_on(Found([refit]))

    def go_on(self, begun: Found) -> Found:
        """Search forward from what was found already."""
        found = self._onward(begun)
        other = self._from_both_frictions(found)
        if other is not None and self.extension.gain(other.best, found.best).present:
            return other
        return found

    def _from_both_frictions(self, found: Found) -> Found | None:
        """Search anew from the frictions that the datasheet lacks and every joint has.

        Where one of them alone did as well at first, all else was bent to do what the other does;
        no start leads from there to both. None if both were found, or nothing is left.
        """
        both, best = {*LACKED}, found.best
        if not both <= self._lacked:
            return None
        if both <= {*best.effects} or not both <= {*self.extension.effects} or self._over:
            return None
        if self._fitter.left_in_a_band(best) < NOTHING_LEFT:
            return None
        begun = [fit for fit in found.rivals.get(1, []) if both <= {*fit.effects}]
        if not begun:
            return None
        first = self.extension.ranked(begun, found.steps[0])[0]
        return self._onward(Found([found.steps[0], first], rivals={1: found.rivals[1]}))

    def _onward(self, found: Found) -> Found:
        """Add to what was found, cause after cause."""
        while len(found.best.effects) < MOST_CAUSES:
            if self._fitter.left_in_a_band(found.best) < NOTHING_LEFT:
                break
            if self._over:
                found.complete = False
                break
            if not self._step(found):
                break
            replace_bounded(found, self._fitter, self.extension)
            drop_hindering(found, self._fitter, self.extension)
        return found

    def _step(self, found: Found) -> bool:
        """Add what repeats on unseen parts, by the first look that finds it; tell if one did."""
        fits: list[CellFit] = []
        looks = [self._singles, self._less_promising, self._frictions, self._halves]
        if self._fitter.evidence.slow:
            looks = [self._singles, self._pairs_of_slow_motion]
        for look in looks:
            if fits and self._over:
                found.complete = False
                return False
            if not (new := look(fits, found)):
                continue
            if (chosen := self._repeating(new, found)) is not None:
                found.alternatives[chosen.effects[-1]] = self.extension.tied(
                    chosen, new, found.best
                )
                found.steps.append(chosen)
                return True
            fits += new
        return False

    def _singles(self, _: Sequence[CellFit], found: Found) -> list[CellFit]:
        fits = self.extension.extended(found.best, found.steps)
        return self.extension.ranked([self._or_known(fit, found) for fit in fits], found.best)

    def _or_known(self, fit: CellFit, found: Found) -> CellFit:
        """Return a fit, or one of the same causes from an earlier step, if that does better.

        What came together with others may have gone further than what is added after them.
        """
        tried = [f for fits in found.rivals.values() for f in fits]
        known = [f for f in tried if {*f.effects} == {*fit.effects}]
        best = max(known, key=lambda f: self._fitter.gains(f, fit).sum(), default=fit)
        if not self._fitter.gains(best, fit).sum() > 0.0:
            return fit
        acts = self._fitter.acted(best, fit.effects[-1])
        return replace(best, effects=fit.effects, acts=acts)

    def _less_promising(self, fits: Sequence[CellFit], found: Found) -> list[CellFit]:
        """Return fits of what promises less, where something great is not found yet."""
        if self._misses(found.best) <= _MUCH:
            return []
        passed = [fit.effects[-1] for fit in fits]
        return self.extension.extended(found.best, found.steps, passed)

    def _pairs_of_slow_motion(self, fits: Sequence[CellFit], found: Found) -> list[CellFit]:
        """Return the leading fits with each promising effect more.

        Causes of slow motion may show only together: friction and gravity, say, are offsets of
        every short way, so one alone leaves as much as it takes away.
        """
        return self._pairs(fits[:_PARENTS], found)

    def _frictions(self, fits: Sequence[CellFit], found: Found) -> list[CellFit]:
        """Return pairs of laws of friction, where most of what is missing goes with velocity.

        Of a friction that falls from breakaway and then grows, neither law alone is much better;
        nor is one where it falls and its bristles yield, since a joint stops and starts by both.
        The datasheet that lacks friction lacks its form as well.
        """
        laws = [fit for fit in fits if fit.effects[-1] in FRICTION]
        if not laws or not (self._lacked or lacks_friction(self._fitter, found.best)):
            return []
        others = [e for e in self.extension.effects if e not in FRICTION]
        return self._pairs(laws[:_PARENTS], found, others)

    def _halves(self, fits: Sequence[CellFit], found: Found) -> list[CellFit]:
        """Return pairs with what repeats on unseen parts but closes too little by itself.

        It may be one of two causes that are better only together.
        """
        if not found.best.effects:
            return []
        gained = [(fit, self.extension.gain(fit, found.best)) for fit in fits]
        return self._pairs([fit for fit, gain in gained if gain.present][:_HALVES], found)

    def _pairs(
        self, fits: Sequence[CellFit], found: Found, tried: Sequence[str] = ()
    ) -> list[CellFit]:
        """Return fits with each promising effect more, best on unseen parts first."""
        steps = found.steps
        pairs = [pair for fit in fits for pair in self.extension.extended(fit, steps, tried)]
        return self.extension.ranked(pairs, steps[0])

    def _repeating(self, fits: Sequence[CellFit], found: Found) -> CellFit | None:
        """Return what is chosen of the fits that close enough, and keep them all."""
        best = found.best
        found.rivals[len(best.effects) + 1] = [
            *found.rivals.get(len(best.effects) + 1, []), *fits
        ]  # fmt: skip
        closing = [f for f in fits if self._closes(f, best) >= self._least_closed(f, found)]
        return self.extension.chosen(closing, best)

    def _closes(self, fit: CellFit, before: CellFit) -> float:
        """Return how much a fit closes of the band in which it gains most, or of all if more.

        What closes nearly all of a slow error may gain most where little but noise is, by many
        lines that each become a little better.
        """
        return max(closed(self._fitter, fit, before), 1.0 - left_of(self._fitter, fit, before))

    @property
    def _over(self) -> bool:
        return time.monotonic() > self._until

    def _least_closed(self, fit: CellFit, found: Found) -> float:
        """Return how much of its best band a further cause must close to be named in the end."""
        sure = len(found.best.effects) < _CERTAIN_CAUSES or fit.effects[-1] in self._lacked
        return LEAST_CLOSED if sure else LEAST_CLOSED_LATER
