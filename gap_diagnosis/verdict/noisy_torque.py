"""What noise of a recorded torque does to a diagnosis, where it explains most of what is left.

See `which.unfelt_noise` for how it is told from what causes leave.
"""

from __future__ import annotations

import math

import numpy as np

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..how_far.ledger import Ledger
from ..outcome.diagnosis import Diagnosis
from ..outcome.gap_size import Estimate
from ..which.unfelt_noise import TorqueNoise, driven, torque_noise

_NEAR = 4.0
"""Misfit beside the noise above which more than noise is left: that hides how strong noise is."""
_NOT_NEEDED = 0.75
"""How sure a cause is, of what it was, where noise explains what is left without any."""
_REPEATED = 2  # fits with as much noise again


def unfelt_noise(fitter: CellFitter, best: CellFit) -> TorqueNoise | None:
    """Return the noise of the torque that a fit shows; None where it is not most of the rest.

    Fits are not weighed by it: it is alike on all lines, of which the highest bands hold most, and
    these are where a model of a driven rig is least exact.

    Args:
        fitter: that made the fit.
        best: the refit of the base parameters, or that with all causes.
    """
    evidence = fitter.evidence
    if not driven(evidence) or fitter.left_in_a_band(best) < NOTHING_LEFT:
        return None
    noise = torque_noise(evidence, best.model)
    if noise is None:
        return None
    left = Ledger(noise.counted(evidence), fitter.select_parts).step(best.model, None, "refit")
    return noise if (left.chi2_per_dof or math.inf) < _NEAR else None


def beside_the_noise(
    diagnosis: Diagnosis, fitter: CellFitter, fit: CellFit, noise: TorqueNoise
) -> Diagnosis:
    """Return a diagnosis whose intervals reach to where sizes would be without the noise.

    Where noise explains what the refit leaves, no cause is needed, and each is less sure. Noise of
    what drives a model biases its fit (errors in variables). As much noise again moves the fit by
    as much again, to first order (simulation extrapolation: Cook, Stefanski 1994, JASA 89).

    Args:
        diagnosis: of the fit.
        fitter: that made the fit.
        fit: the best one.
        noise: of the torque.
    """
    moved = np.zeros(fit.solution.x.size)
    for seed in range(_REPEATED):
        records = noise.beside(fitter.evidence.records, seed)
        twice = fitter.with_runs(records).taken_over(fit)
        moved += (twice.solution.x - fit.solution.x) / _REPEATED
    space = fit.space
    without = space.model(np.clip(fit.solution.x - moved, *space.bounds()))
    values = {**without.plant, **without.effects}
    parameters = {n: _reaching(e, values.get(n)) for n, e in diagnosis.parameters.items()}
    reaching = diagnosis.with_parameters(parameters)
    left = diagnosis.steps[1].chi2_per_dof
    sure = _NOT_NEEDED if left is not None and left < NOTHING_LEFT else 1.0
    causes = [
        cause.model_copy(update={"present": sure * cause.present}) for cause in reaching.causes
    ]
    confidence = min((c.present for c in causes), default=diagnosis.confidence)
    return reaching.model_copy(update={"causes": causes, "confidence": confidence})


def _reaching(found: Estimate, without: float | None) -> Estimate:
    """Return an interval that reaches as much further as its value would be moved."""
    if without is None or found.value is None or found.low is None or found.high is None:
        return found
    by = without - found.value
    return found.model_copy(
        update={"low": found.low + min(by, 0.0), "high": found.high + max(by, 0.0)}
    )
