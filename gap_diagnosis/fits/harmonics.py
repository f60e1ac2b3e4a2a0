"""Second harmonics of ripples: where a fit with one ripple per turn is not enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..starts.ripples_passed import LEAST_PASSED, ripples_passed
from .cell_fits import CellFitter
from .comparison import CellFit

WORTH_A_HARMONIC = 1.3
"""Misfit from which a second harmonic is looked for: what noise leaves is none."""


def with_second_harmonic(fitter: CellFitter, fit: CellFit, parent: CellFit) -> CellFit | None:
    """Return a fit with a second harmonic of its last effect; None if none promises any.

    One ripple fitted to two may lie between them: where a second one beside it leaves more than
    noise, both are looked for anew.

    Args:
        fitter: that made the fit.
        fit: an explanation whose last effect is a ripple of one harmonic.
        parent: the fit that it extends.
    """
    ripple = fit.effects[-1]
    more = fitter.add(fit, ripple, fitter.screening_of(fit, _seeds(ripple)).proposals(), 1)
    if more is not None and fitter.misfit(more) < WORTH_A_HARMONIC:
        return _passed(fitter, more, fit)
    both = fitter.two_harmonics(parent, ripple)
    anew = None
    if both:
        anew = fitter.add(parent, ripple, fitter.screening_of(parent, both).proposals())
        anew = None if anew is None else fitter.further(anew)  # it begins far from where it ends
    found = [one for each in (more, anew) if (one := _passed(fitter, each, fit)) is not None]
    if len(found) == 2 and fitter.gains(found[1], found[0]).sum() > 0.0:
        return found[1]
    return found[0] if found else None


def _passed(fitter: CellFitter, found: CellFit | None, fit: CellFit) -> CellFit | None:
    """Return what was found, its effects in order, if the motion passes enough of its ripples."""
    if found is None or ripples_passed(found.model, fit.effects[-1], fitter.scales) < LEAST_PASSED:
        return None
    return replace(found, effects=fit.effects)


def _seeds(effect: str) -> list[Mapping[str, float]]:
    ratio, phase = f"{effect}.second_ratio", f"{effect}.second_phase_rad"
    return [{ratio: 0.2, phase: angle} for angle in (0.0, 0.5 * np.pi)]
