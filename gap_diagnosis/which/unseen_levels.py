"""How well an explanation of steady periods predicts an amplitude that its fit has not seen."""

from __future__ import annotations

import numpy as np

from .fits import Fit, Fitter

_STEPS = 3  # in which a fit is continued without a level


def across_levels(fitter: Fitter, fit: Fit) -> float | None:
    """Return how well an explanation predicts an amplitude that it has not seen.

    For each level the fit is continued on the training data of the other levels, and judged on
    all realizations of that one.

    Returns:
        chi-square per degree of freedom, geometric mean over levels; None with one level.
    """
    levels = sorted(set(fitter.levels))
    if len(levels) < 2:
        return None
    values = []
    for level in levels:
        others = [i for i in fitter.train.which if fitter.levels[i] != level]
        unseen = fitter.misfit_of([i for i, at in enumerate(fitter.levels) if at == level])
        seen, known = fitter.misfit_of(others), fitter.rows(fit, others)
        reached = fitter.reached(fit.space, fit.solution.x, seen, _STEPS, known)
        values.append(unseen.chi2(fit.space.model(reached.x)))
    return float(np.exp(np.mean(np.log(np.maximum(values, 1e-3)))))
