"""Second harmonics of ripples: where a fit with one ripple per turn is not enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .cell_fits import CellFit, CellFitter
from .ripples_passed import LEAST_PASSED, ripples_passed


def with_second_harmonic(fitter: CellFitter, fit: CellFit, ripple: str) -> CellFit | None:
    """Return a fit with a second harmonic of a ripple; None if none promises any.

    Args:
        fitter: that made the fit.
        fit: an explanation.
        ripple: identifier of an angle-periodic effect of it, of one harmonic so far.
    """
    proposals = fitter.screening_of(fit, _seeds(ripple)).proposals()
    found = fitter.add(fit, ripple, proposals, 1)
    if found is None or ripples_passed(found.model, ripple, fitter.scales) < LEAST_PASSED:
        return None
    return replace(found, effects=fit.effects)


def _seeds(effect: str) -> list[Mapping[str, float]]:
    ratio, phase = f"{effect}.second_ratio", f"{effect}.second_phase_rad"
    return [{ratio: 0.2, phase: angle} for angle in (0.0, 0.5 * np.pi)]
