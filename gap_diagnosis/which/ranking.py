"""Fits by what they leave on held-out data: which lead, which count, what may stand for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from fjr_sim_node import effects as fx

from .attribution import (
    CERTAIN,
    MOST_LEFT,
    NOTHING_LEFT,
    PLAIN,
    SMALL_GAIN,
    STANDS_OUT,
    stands_out,
    tie_limit,
)
from .equivalents import ONE_CAUSE, partners, stands_for
from .estimates import sure as known
from .fits import Fit, Fitter

_FORM = 0.0025  # of the misfit: a law is wrong by up to 5 % (rms) of what it does


class Ranking:
    """The fits of one experiment.

    Attributes:
        fits: by their effects, sorted.
        refit: that of the base parameters alone; None before there is one.
        holding: laws that nobody asked for, of which one part does as well; they never lead.
    """

    def __init__(self, fitter: Fitter) -> None:
        """Take who makes the fits."""
        self.fits: dict[tuple[str, ...], Fit] = {}
        self.refit: Fit | None = None
        self.holding: list[Fit] = []
        self._held, self._names = fitter.held, set(fitter.catalogue)
        self._groups = fitter.train.groups()

    def misfit(self, fit: Fit) -> float:
        """Return the chi-square per degree of freedom of a fit over held-out realizations."""
        return fit.held_chi2 / self._held.size

    def ranked(self, count: int) -> list[Fit]:
        """Return the converged fits of `count` effects, best first."""
        fits = [fit for fit in self.fits.values() if len(fit.effects) == count and fit.converged]
        return sorted(fits, key=self.misfit)

    def nearest(self, count: int) -> list[Fit]:
        """Return the fits of `count` effects, best first, those that were given up as well."""
        return sorted((f for f in self.fits.values() if len(f.effects) == count), key=self.misfit)

    def close(self, ranked: Sequence[Fit], times: float) -> list[Fit]:
        """Return which of some fits, best first, leave less than `times` what the first does."""
        return [fit for fit in ranked if self.misfit(fit) < times * self.misfit(ranked[0])]

    @staticmethod
    def unlike(ranked: Sequence[Fit]) -> list[Fit]:
        """Return fits of one effect without those whose effect is much like one that stands before.

        What is much like another effect goes with the same further causes.
        """
        kept: list[Fit] = []
        for fit in ranked:
            if not any(stands_for(fit.effects, other.effects) for other in kept):
                kept.append(fit)
        return kept

    def sure(self, count: int) -> list[Fit]:
        """Return the converged fits of `count` effects none of which could be zero, best first."""
        for effects, fit in self.fits.items():
            if len(effects) == count:
                self.fits[effects] = replace(fit, without=self._without(effects))
        return [fit for fit in self.ranked(count) if known(fit, self._groups)]

    def _without(self, effects: Sequence[str]) -> dict[str, float]:
        """Return the training chi-square of the fits that lack one of some effects."""
        found = {}
        for effect in effects:
            rest = tuple(other for other in effects if other != effect)
            fit = self.fits.get(rest) if rest else self.refit
            if fit is not None and fit.converged:
                found[effect] = fit.train_chi2
        return found

    def all(self) -> tuple[Fit, ...]:
        """Return all fits, best first; those that have not converged stand last."""
        return tuple(sorted(self.fits.values(), key=lambda f: (not f.converged, self.misfit(f))))

    def calls_for(self, simple: Fit, rich: Fit, gain: float) -> bool:
        """Whether the richer explanation is worth its effect: a gain on held-out data.

        What gains on held-out data alone has only happened to extrapolate better.
        """
        before, after = self.misfit(simple), self.misfit(rich)
        certain = before - after > CERTAIN / self._held.size
        return certain and min(before / after, simple.train_chi2 / rich.train_chi2) > gain

    def explains(self, refit: Fit, best: Fit) -> bool:
        """Whether the best leaves nothing worth explaining, see `attribution`."""
        left = self.misfit(best)
        if not best.effects:
            return left < PLAIN
        if left < NOTHING_LEFT:
            return True
        motion = [self._held.left(fit.model) for fit in (best, refit)]
        if motion[0] > MOST_LEFT * motion[1]:
            return False
        return stands_out(left, self.misfit(refit), self._next(refit, best)) > STANDS_OUT

    def _next(self, refit: Fit, best: Fit) -> float:
        """Return the misfit of the best explanation that does not stand for the chosen one.

        A fit that was given up counts as well: it could only have become better.
        """
        alike = {*best.effects, *partners(best.effects, self._names)}
        others = [
            fit
            for fit in self.fits.values()
            if len(fit.effects) == len(best.effects) and not set(fit.effects) <= alike
        ]
        return min(self.misfit(fit) for fit in (refit, *others))

    def owed_to_its_form(self, best: Fit) -> bool:
        """Tell whether an effect leaves no more of the gap than its law's form may be wrong by."""
        return self._leaves(best) < _FORM

    def _leaves(self, fit: Fit) -> float:
        """Return what a fit leaves of the gap, beyond noise."""
        assert self.refit is not None
        return (self.misfit(fit) - 1.0) / max(self.misfit(self.refit) - 1.0, 1e-300)

    def drop_one_cause_twice(self) -> None:
        """Drop pairs of near equivalents of which one alone does nearly all; see `ONE_CAUSE`."""
        for fit in self.ranked(1):
            if self._leaves(fit) < ONE_CAUSE:
                for other in fx.near_equivalents(fit.effects[0]):
                    self.fits.pop(tuple(sorted((*fit.effects, other))), None)

    def settled(self, count: int, near: float) -> set[tuple[str, ...]]:
        """Return which explanations of `count` effects another start could not help."""
        ranked = self.ranked(count)
        best = min((fit.train_chi2 for fit in ranked), default=math.inf)
        return {fit.effects for fit in ranked if fit.train_chi2 < near * best}

    def tied(self, best: Fit) -> tuple[Fit, ...]:
        """Return the converged explanations of as many effects that do as well as the best.

        One that only contains the best is no rival. But a law of several parts of which the best is
        one may be what is there, where it gains what calls for an effect, if not the factor that it
        takes to lead; or where it does as well and both look alike. Likewise a part of the best
        that looks like it, if the form of its law may be all that it leaves.
        """
        if not best.effects:
            return ()
        limit = tie_limit(self.misfit(best), self._held.size)
        rivals = [fit for fit in self.sure(len(best.effects)) if self.misfit(fit) < limit]
        own = best.effects
        others = [f for f in rivals if f.effects != own and not fx.contains(f.effects, own)]
        for fit in self.holding:
            as_well = stands_for(fit.effects, own) and self.misfit(fit) < limit
            may_be = as_well or self.calls_for(best, fit, SMALL_GAIN)
            if fx.contains(fit.effects, own) and may_be:
                others.append(fit)
        there = {fit.effects for fit in others}
        for fit in self.ranked(len(own)):
            part = fx.contains(own, fit.effects) and stands_for(fit.effects, own)
            if part and fit.effects not in there and self.owed_to_its_form(fit):
                others.append(fit)
        return tuple(others)
