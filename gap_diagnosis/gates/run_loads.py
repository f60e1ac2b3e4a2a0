"""Does a constant torque differ from run to run, by a payload that weighs or another mounting?

One model cannot hold two loads: its own lies between, and what it leaves looks like friction, or
pulls the inertia away from the datasheet. So each run is asked for the constant torque that it
needs beyond the model, beside friction, inertia and loads over the angle of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns
from ..starts.seen_torques import SeenTorques

_DIFFERS = 0.1  # of the rms torque of all runs, between two of them
_ERRORS = 5.0  # standard errors of the difference of two runs
_LISTED = 8  # runs whose values are all told


@dataclass(frozen=True)
class RunLoad:
    """What a run needs beyond the model, by the name of the run; see `SeenInertia.load`, N m."""

    name: str
    value: float
    error: float
    doubles: float


def different_loads(evidence: Evidence, model: Model) -> list[RunLoad]:
    """Return the load of each run that clearly shows one; empty where it may be one of all.

    One load for all must leave twice the squares of one for each. Nothing is said of steady
    periods, of slow motion, of what swings free, nor of an axis that yields.

    Args:
        evidence: the runs.
        model: the best model.
    """
    records = evidence.records
    beyond = records.swings_free or isinstance(records, SteadyRuns) or not model.rigid
    if evidence.slow or beyond:
        return []
    found = []
    for index, record in enumerate(records.records):
        parts = [p for p, part in enumerate(evidence.parts) if part.record == index]
        own = SeenTorques(evidence, parts, model).inertia(not records.linear) if parts else None
        load = RunLoad(record.name, *own.load) if own is not None else None
        if load is not None and np.isfinite([load.value, load.error, load.doubles]).all():
            found.append(load)
    if len(found) < 2:
        return []
    least, most = _ends(found)
    rms = np.sqrt(np.mean([np.mean(record.torque**2) for record in records.records]))
    needed = max(_DIFFERS * rms, _ERRORS * float(np.hypot(least.error, most.error)))
    return found if most.value - least.value > needed and _worse_as_one(found) else []


def _ends(found: Sequence[RunLoad]) -> tuple[RunLoad, RunLoad]:
    """Return the runs of the least and of the greatest load."""
    ordered = sorted(found, key=lambda run: run.value)
    return ordered[0], ordered[-1]


def _worse_as_one(found: Sequence[RunLoad]) -> bool:
    """Tell whether one load for all leaves twice the squares of one for each, in units of these."""
    weights = np.array([1.0 / max(run.doubles, 1e-300) ** 2 for run in found])
    values = np.array([run.value for run in found])
    one = np.average(values, weights=weights)
    return float(np.sum(weights * (values - one) ** 2)) > len(found)


def loads_differ(found: Sequence[RunLoad], linear: bool) -> str:
    """Return what to say of runs of different load.

    Args:
        found: from `different_loads`, not empty.
        linear: whether the axis is linear, its torque a force.
    """
    unit, what = ("N", "force") if linear else ("N m", "torque")
    least, most = _ends(found)
    told = found if len(found) <= _LISTED else [least, most]
    more = [f"{run.name} {run.value - least.value:.3g}" for run in told if run is not least]
    return (
        f"A constant {what} differs from run to run, as with a payload that weighs: beyond "
        f"{least.name} need {', '.join(more)} {unit} (by regression of each run). One model cannot "
        "hold them all: what it leaves may be named as something else, or pull the inertia away. "
        "Diagnose runs of one load apart, and note with each run what the axis carried."
    )
