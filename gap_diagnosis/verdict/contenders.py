"""What a verdict chose among: its explanation beside those that data could not, or could, tell off.

All are compared on the data that select, which are not those that report.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import Gain, gain, stands_for
from ..outcome.contender import Contender
from ..which.equivalents import founded, holders, partners
from ..which.found import Found
from .tested_causes import Tested


def tied_fits(
    fitter: CellFitter, found: Found, tested: Sequence[Tested], names: Sequence[str]
) -> dict[str, list[CellFit]]:
    """Return, for each cause, fits in which another effect does as well in its place.

    Args:
        fitter: that made all fits.
        found: the steps of the search.
        tested: the causes that are kept.
        names: identifiers of what may be named.
    """
    return {t.effect: _tied(fitter, found, t, names) for t in tested}


def _tied(fitter: CellFitter, found: Found, tested: Tested, names: Sequence[str]) -> list[CellFit]:
    """Return fits in which an effect does as well in place of a cause, all else fitted anew.

    A near equivalent is in the set unless unseen parts tell it from the cause as surely as they
    must show a cause at all. A torque of the angle that holds the cause, or one like it, as a limit
    case does as well by itself: it counts only where it surely does better.
    """
    best = found.best
    near = {*partners([tested.effect], set(names), fitter.nominal)}
    tied, beside = [], tested.without.effects
    angle = fx.EFFECTS[tested.effect].of_the_angle
    whole = holders([tested.effect], names, beside) if angle else []
    others = {*near, *found.alternatives.get(tested.effect, ())} - {*best.effects, *whole}
    searched = {fit.effects: fit for fits in found.rivals.values() for fit in fits}
    for effect in founded([*sorted(others), *whole], beside, fitter.nominal, names):
        other = searched.get((*beside, effect))
        if other is None:
            proposals = fitter.screening(tested.without, effect).proposals()
            other = fitter.add(tested.without, effect, proposals) if proposals else None
        if other is None:
            continue
        as_well = partial(
            stands_for, fitter, best=best, first=tested.gain.mean, near=effect in near
        )
        further = other
        if effect in whole:
            does = gain(fitter, other, best).surely_present
        else:
            does = as_well(other) or as_well(further := fitter.further(other))
        if does:
            tied.append(further)
    return tied


def contenders(fitter: CellFitter, found: Found, tied: Sequence[CellFit]) -> list[Contender]:
    """Return the chosen explanation, then what it was compared with, the best first.

    That are the fits in which another member of a set stands in place of its cause. Where no cause
    is named it is what was tried beside the refit.

    Args:
        fitter: that made all fits.
        found: the steps of the search; the last is the chosen explanation.
        tied: fits in which another effect does as well in place of one of the causes.

    Returns:
        Empty where there is nothing to compare.
    """
    best = found.best
    others = tied if best.effects else found.rivals.get(1, [])
    if not others:
        return []
    gains = [gain(fitter, fit, best) for fit in others]
    ranked = sorted(zip(gains, others, strict=True), key=lambda one: -one[0].mean)
    return [
        Contender(
            effects=list(fit.effects),
            held_out_chi2=fitter.misfit(fit),
            gain=gained.mean,
            better=gained.present,
            converged=fit.solution.converged,
        )
        for gained, fit in [(Gain(0.0, 0.0, 0.0, 1.0), best), *ranked]
    ]
