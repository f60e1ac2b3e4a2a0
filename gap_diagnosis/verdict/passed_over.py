"""What a search passed over for the sake of a cause, and a fit to which that is added."""

from __future__ import annotations

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import gain
from ..which.found import Found

_RIVALS = 3


def passed_over(fitter: CellFitter, found: Found, best: CellFit, effect: str) -> list[str]:
    """Return the effects that did best when a cause was chosen, best first, itself among them."""
    before = best.effects[: best.effects.index(effect)]
    chosen = [
        (gain(fitter, fit, found.steps[0]).mean, fit.effects[-1])
        for fits in found.rivals.values()
        for fit in fits
        if fit.effects[:-1] == before
    ]
    return [name for _, name in sorted(chosen, reverse=True)[:_RIVALS]]


def beside(fitter: CellFitter, fit: CellFit, effect: str) -> CellFit | None:
    """Return a fit with an effect more; None if that repeats on no unseen parts."""
    proposals = fitter.screening(fit, effect).proposals()
    more = fitter.add(fit, effect, proposals) if proposals else None
    if more is None or not gain(fitter, more, fit).present:
        return None
    return fitter.further(more)
