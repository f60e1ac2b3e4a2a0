"""How far sizes move when torques are compared and not motions.

A model that the recorded torque drives is fitted to the motion. Torque that only the record holds
(noise of its sensor), or that only the rig felt and a controller answered (what no cause explains),
counts less in a more sluggish model, so that its inertia comes out too great. Compared by torque,
as in inverse dynamics, it does not; but then the motion which such torques made stands for one that
was asked for, and the inertia comes out too small. The truth lies between the two regressions
(Frisch 1934, Statistical Confluence Analysis; Soderstrom 2018, Errors-in-Variables Methods).
"""

from __future__ import annotations

import copy

import numpy as np

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns
from ..model.torque_errors import TorqueErrors
from ..outcome.diagnosis import Diagnosis
from ..outcome.gap_size import Estimate

_TOLD = 1.0  # of an interval: what a parameter moves by from which on it is told


def reaching_to_torques(diagnosis: Diagnosis, fitter: CellFitter, fit: CellFit) -> Diagnosis:
    """Return a diagnosis whose intervals reach to where the fit goes if torques are compared.

    Of rigid axes whose loop nobody knows; others stay as they are. No interval reaches across
    zero: whether a cause is there is for the tests of presence.

    Args:
        diagnosis: of the fit.
        fitter: that made the fit.
        fit: the best one.
    """
    evidence = fitter.evidence
    if evidence.slow or evidence.records.swings_free or evidence.twist is not None:
        return diagnosis
    if any(evidence.player.loop.laws) or not fit.model.rigid:
        return diagnosis
    if isinstance(evidence.records, SteadyRuns):
        return diagnosis
    by_torque = copy.copy(fitter)
    by_torque.evidence = TorqueErrors(evidence, Model(fitter.nominal, {}).whole_plant)
    other = by_torque.taken_over(fit)
    if not np.isfinite(other.solution.residuals).all():
        return diagnosis
    values = {**other.model.plant, **other.model.effects}
    known = diagnosis.parameters
    reaching = {name: _reaching(found, values.get(name)) for name, found in known.items()}
    told = [
        f"{name} would be {values[name]:.3g}"
        for name, found in known.items()
        if name in values and _further(found, reaching[name]) > _TOLD
    ]
    notes = [*diagnosis.notes, _note(told)] if told else diagnosis.notes
    return diagnosis.with_parameters(reaching).model_copy(update={"notes": notes})


def _note(told: list[str]) -> str:
    return (
        "Compared by torque, as in inverse dynamics, and not by the motion that the recorded "
        f"torque makes, {', '.join(told)}: noise of the torque, or what no cause explains, moves "
        "the two apart, and the intervals reach from one to the other."
    )


def _reaching(found: Estimate, other: float | None) -> Estimate:
    """Return an interval that reaches to another value, of the same sign."""
    if other is None or found.value is None or found.low is None or found.high is None:
        return found
    if other * found.value < 0.0:
        other = 0.0
    changes = {"low": min(found.low, other), "high": max(found.high, other)}
    return found.model_copy(update=changes)


def _further(found: Estimate, reaching: Estimate) -> float:
    """Return by how much of itself an interval grows; 0 for one that was not known."""
    if found.value is None or found.low is None or found.high is None:
        return 0.0
    wide = found.high - found.low
    return (reaching.high - reaching.low - wide) / wide if wide > 0.0 else 0.0
