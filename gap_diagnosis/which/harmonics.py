"""Second harmonics of ripples: where a fit with one ripple per turn is not enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from fjr_sim_node import effects as fx

from .cell_fits import CellFit, CellFitter
from .fits import NO_PROMISE, RIPPLES_TRIED, Fit, Fitter
from .reduced_fits import without
from .ripples_passed import LEAST_PASSED, ripples_passed
from .screening import Screening
from .search_space import Space

_WORTH_A_HARMONIC = 0.9

_Start = tuple[Space, np.ndarray, np.ndarray | None]
"""A space, a point in it, and what is known of the Jacobian there."""


def with_second_harmonics(fitter: Fitter, fit: Fit) -> Fit:
    """Return a fit with a second harmonic of its ripples, or the fit itself if none helps.

    One ripple fitted to two lies between them, so that both are looked for anew as well.
    """
    for effect in fit.effects:
        if not fx.EFFECTS[effect].ripple or f"{effect}.second_ratio" in fit.space.effects:
            continue
        found = [*_second_harmonics(fitter, fit, effect), *_two_harmonics(fitter, fit, effect)]
        for space, point, known in found:
            worth = _WORTH_A_HARMONIC * fit.train_chi2
            richer = fitter.solve(fit.effects, space, point, worth, known=known)
            better = richer.converged and richer.train_chi2 < worth
            if better and ripples_passed(richer.model, effect, fitter.scales) >= LEAST_PASSED:
                fit = richer
    return fit


def with_second_harmonic(fitter: CellFitter, fit: CellFit, ripple: str) -> CellFit | None:
    """Return a fit of records with a second harmonic of a ripple; None if none promises any.

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


def _second_harmonics(fitter: Fitter, fit: Fit, effect: str) -> list[_Start]:
    """Return where to start with a second harmonic of a ripple; nothing if none gains."""
    found = Screening(
        fit.solution,
        fit.model,
        _seeds(effect),
        partial(fitter.space, fit),
        fitter.errors,
    ).proposals()
    if not found or found[0][0] > NO_PROMISE * fit.train_chi2:
        return []
    return [(found[0][1], found[0][2], fit.solution.jacobian)]


def _two_harmonics(fitter: Fitter, fit: Fit, effect: str) -> list[_Start]:
    """Return where to start with a ripple and its second harmonic in place of a ripple."""
    if not fitter.recorded.repeatable:
        return []
    rest = without(fitter, fit, effect)
    size, *shape = (name for name in fit.space.effects if name.startswith(f"{effect}."))
    names = (size, *shape, f"{effect}.second_ratio", f"{effect}.second_phase_rad")
    found = []
    for values in fitter.ripples(effect, rest).harmonics(RIPPLES_TRIED):
        for share in (1.0, 0.4):
            seed = dict(zip(names, (share * values[0], *values[1:]), strict=True))
            space = fitter.space(rest, seed)
            point = np.clip(space.point(rest.model.with_effects(seed)), *space.bounds())
            found.append((space, point, None))
    errors = fitter.errors([space.model(point) for space, point, _ in found])
    return [found[int(np.argmin(np.einsum("ij,ij->i", errors, errors)))]]
