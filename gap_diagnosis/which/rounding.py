"""An encoder that counts in coarse steps: seen in the record itself, and judged as noise.

All recorded positions are then multiples of one step, which no fit has to find. In the loop the
rounding decides chaotically which count comes next: it repeats with the periods, so that their
scatter does not show it, but no simulation meets it sample by sample. So it widens the variance of
the lines, step^2/12 a sample, and is named where the refit leaves nothing but that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model.misfit import Misfit
from ..outcome.verdict_words import ROUNDING
from .attribution import CERTAIN, SMALL_GAIN, Attribution
from .fits import Fit


def widened(noise_std: np.ndarray, step: float, samples: int) -> np.ndarray:
    """Return the noise of the lines of y with that of rounding, as `NoiseLevels.of_outputs`."""
    out = noise_std.copy()
    rounding = np.full(noise_std.shape[-1], step / np.sqrt(3.0 * samples))
    rounding[0] *= 0.5
    out[:, 0] = np.hypot(out[:, 0], rounding)
    return out


def with_rounding(
    attribution: Attribution, plain: tuple[Misfit, Misfit], step: float
) -> Attribution:
    """Return an attribution that names the rounding, if it is what the refit leaves.

    Args:
        attribution: from misfits whose variance is widened by the rounding.
        plain: misfits of the training and of the held-out data whose variance is not.
        step: of the encoder, rad.
    """
    refit = attribution.refit
    if attribution.best.effects or not attribution.explained:
        return attribution
    train, held = (misfit.chi2(refit.model) * misfit.size for misfit in plain)
    more = held - refit.held_chi2
    if more < CERTAIN or held < SMALL_GAIN * refit.held_chi2:
        return attribution
    found = _rounded(refit, step)
    others = [replace(f, held_chi2=f.held_chi2 + more) for f in attribution.candidates]
    rest = [fit for fit in others if fit.effects != (ROUNDING,)]
    return Attribution(
        replace(refit, train_chi2=train, held_chi2=held), (found, *rest), found, (), True,
        attribution.complete,
    )  # fmt: skip


def _rounded(refit: Fit, step: float) -> Fit:
    """Return the refit with the encoder's step, which is known and not fitted."""
    name = f"{ROUNDING}.resolution_rad"
    space, solution = refit.space, refit.solution
    return replace(
        refit,
        effects=(ROUNDING,),
        model=refit.model.with_effects({name: step}),
        space=replace(space, effects=(name,), units=(step,)),
        solution=replace(
            solution,
            x=np.append(solution.x, 1.0),
            jacobian=np.hstack([solution.jacobian, np.zeros((solution.residuals.size, 1))]),
        ),
    )
