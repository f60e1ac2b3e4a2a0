"""Second harmonics of ripples: where a fit with one ripple per turn is not enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .cell_fits import CellFit, CellFitter
from .ripples_passed import LEAST_PASSED, ripples_passed


def with_second_harmonic(fitter: CellFitter, fit: CellFit, parent: CellFit) -> CellFit | None:
    """Return a fit with a second harmonic of its last effect; None if none promises any.

    One ripple fitted to two lies between them, so that both are looked for anew as well.

    Args:
        fitter: that made the fit.
        fit: an explanation whose last effect is a ripple of one harmonic.
        parent: the fit that it extends.
    """
    ripple = fit.effects[-1]
    more = fitter.add(fit, ripple, fitter.screening_of(fit, _seeds(ripple)).proposals(), 1)
    both = fitter.two_harmonics(parent, ripple)
    anew = None
    if both:
        anew = fitter.add(parent, ripple, fitter.screening_of(parent, both).proposals())
        anew = None if anew is None else fitter.further(anew)  # it begins far from where it ends
    found = [
        replace(one, effects=fit.effects)
        for one in (more, anew)
        if one is not None and ripples_passed(one.model, ripple, fitter.scales) >= LEAST_PASSED
    ]
    best = found[0] if found else None
    for one in found[1:]:
        if best is not None and fitter.gains(one, best).sum() > 0.0:
            best = one
    return best


def _seeds(effect: str) -> list[Mapping[str, float]]:
    ratio, phase = f"{effect}.second_ratio", f"{effect}.second_phase_rad"
    return [{ratio: 0.2, phase: angle} for angle in (0.0, 0.5 * np.pi)]
