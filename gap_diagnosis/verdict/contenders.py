"""What a verdict chose among: its explanation beside those that data could not, or could, tell off.

All are compared on the data that select, which are not those that report.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import Gain, gain
from ..outcome.contender import Contender
from ..which.found import Found


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
