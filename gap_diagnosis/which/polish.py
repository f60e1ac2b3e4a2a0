"""The leading fits of a step of the search, taken to their end before one is chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import closed, gain, left_of
from ..fits.harmonics import WORTH_A_HARMONIC, with_second_harmonic
from .equivalents import partners

_POLISHED = 2  # leading fits of a step that are taken further
OUTDATED = 0.1  # of the squared error that is left: then what was screened before is too far
MOST = 0.5  # of the squared error: a fit that leaves more leaves most of it
MUCH_LESS = 0.3  # of the greatest gain: a cause that gains less waits for the next step
_WORTH_RICHER = 0.2
"""Of what is left in the band where it gains most: a ripple that closes less is none of two
harmonics either, and its second one is not looked for, which costs more than all else."""


def ranked(fitter: CellFitter, fits: Sequence[CellFit], parent: CellFit) -> list[CellFit]:
    """Return fits by what they gain over their parent on unseen parts, the best first."""
    return sorted(fits, key=lambda fit: -gain(fitter, fit, parent).mean)


class Polish:
    """Takes the leading fits of a step further."""

    def __init__(self, fitter: CellFitter, progress: Callable[[str], None]) -> None:
        """Take what fits explanations, and what is told which of them."""
        self._fitter, self._progress = fitter, progress

    def polished(self, fits: Sequence[CellFit], parent: CellFit) -> list[CellFit]:
        """Return ranked fits, those that lead and may be chosen taken further, ranked anew."""
        leading = fits[:_POLISHED]
        first = [fit.effects[-1] for fit in leading]
        near = len(partners(first[:1], set(first), self._fitter.nominal)) > 1
        promising = [fit for fit in leading if self._may_be_chosen(fit, leading[0], parent)]
        if near and promising:
            promising = list(leading)
        others = [fit for fit in fits if not any(fit is one for one in promising)]
        further = [self._enriched(self._settled(f, parent, near), parent) for f in promising]
        return ranked(self._fitter, [*further, *others], parent)

    def _may_be_chosen(self, fit: CellFit, first: CellFit, parent: CellFit) -> bool:
        """Tell whether a fit that leads may be chosen once it is taken further.

        Not where it neither repeats on unseen parts nor closes much, or gains much less than the
        first one.
        """
        left, found = left_of(self._fitter, fit, parent), gain(self._fitter, fit, parent)
        if left < OUTDATED:
            return True
        repeats = found.present or left < MOST
        return repeats and found.mean > MUCH_LESS * gain(self._fitter, first, parent).mean

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
        closes_little = left_of(self._fitter, fit, parent) > OUTDATED
        added = fit.effects[len(parent.effects) :]
        alike = alike or any(fx.EFFECTS[effect].of_bare_plant for effect in added)
        if fit.solution.converged and closes_little and not alike:
            return fit
        self._progress(f"{' + '.join(fit.effects)}, further")
        return self._fitter.to_its_end(fit)

    def _enriched(self, fit: CellFit, parent: CellFit) -> CellFit:
        """Return a fit whose last effect is a ripple with its second harmonic, if that repeats.

        A ripple of two harmonics that is taken for one leaves what looks like a further cause. One
        that does not repeat is no ripple.
        """
        effect = fit.effects[-1]
        if not fx.EFFECTS[effect].ripple or self._fitter.misfit(fit) < WORTH_A_HARMONIC:
            return fit
        repeats = gain(self._fitter, fit, parent).present
        if not repeats or closed(self._fitter, fit, parent) < _WORTH_RICHER:
            return fit
        self._progress(f"{' + '.join(fit.effects)}, second harmonic")
        richer = with_second_harmonic(self._fitter, fit, parent)
        if richer is None or not gain(self._fitter, richer, fit).present:
            return fit
        # both by the weights of what they leave themselves
        richer, alone = self._fitter.further(richer), self._fitter.further(fit)
        return richer if gain(self._fitter, richer, alone).present else alone
