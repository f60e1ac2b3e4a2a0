"""Fits that have lost a cause, or have another one in its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import gain, stands_for
from ..which.equivalents import founded, partners
from ..which.found import Found
from .passed_over import beside, passed_over
from .tested_causes import Tested


def in_its_place(
    fitter: CellFitter, found: Found, best: CellFit, tested: Tested, names: Sequence[str]
) -> CellFit | None:
    """Return the best fit with another effect in the place of one; None if none does as well."""
    effect, without = tested.effect, tested.without
    near = [*partners([effect], set(names), fitter.nominal), fx.EFFECTS[effect].modifies]
    near += passed_over(fitter, found, best, effect)
    others = [e for e in dict.fromkeys(near) if e in names and e not in best.effects]
    tried = founded(others, without.effects, fitter.nominal, names)
    fits = [fit for other in tried if (fit := beside(fitter, without, other)) is not None]
    if not fits:
        return None
    most = max(fits, key=lambda fit: gain(fitter, fit, without).mean)
    return most if stands_for(fitter, most, best, tested.gain.mean) else None


def taken_out(fitter: CellFitter, before: Sequence[CellFit], weakest: Tested) -> list[CellFit]:
    """Return the steps without a cause.

    Args:
        fitter: of the search.
        before: the steps that lack it.
        weakest: the cause, with the last fit without it.
    """
    last = weakest.without
    if last.effects != before[-1].effects:
        return [*before, _begun_anew(fitter, last, before[-1])]
    better = fitter.gains(last, before[-1]).sum() > 0.0
    return [*before[:-1], last if better else before[-1]]


def _begun_anew(fitter: CellFitter, fit: CellFit, before: CellFit) -> CellFit:
    """Return a fit that has lost a cause, or the same causes begun from an earlier step, if better.

    A cause that stood for another one leaves the fit where that other one did little.
    """
    added = [effect for effect in fit.effects if effect not in before.effects]
    if len(added) != 1:
        return fit
    proposals = fitter.screening(before, added[0]).proposals()
    anew = fitter.add(before, added[0], proposals) if proposals else None
    if anew is None:
        return fit
    anew = anew if anew.solution.converged else fitter.further(anew)
    return anew if fitter.gains(anew, fit).sum() > 0.0 else fit


def one_by_one(fitter: CellFitter, fit: CellFit, tested: Sequence[Tested]) -> list[CellFit]:
    """Return a fit reached cause after cause, what gains most first: each has one cause more.

    What changes another cause comes after it, since before it does nothing.
    """
    worth = {t.effect: t.gain.mean for t in tested}
    bases = {effect: fx.EFFECTS[effect].modifies for effect in worth}
    worth |= {e: min(worth[e], worth[base]) for e, base in bases.items() if base in worth}
    order = sorted(worth, key=lambda e: (-worth[e], bases[e] in worth))
    without = {t.effect: t.without for t in tested}
    fits = [fit]
    for effect in order[:0:-1]:
        fewer = without[effect] if fits[0] is fit else fitter.without(fits[0], effect)
        fits.insert(0, fewer)
    return [replace(one, effects=tuple(order[:count])) for count, one in enumerate(fits, 1)]
