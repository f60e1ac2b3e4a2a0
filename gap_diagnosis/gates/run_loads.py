"""Does a constant torque differ from run to run, by a payload that weighs or another mounting?

One model cannot hold two loads: its own lies between, and what it leaves looks like friction, or
pulls the inertia away from the datasheet. So each run is asked for the constant torque that it
needs beyond the model, beside friction, inertia and loads over the angle of its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..model.evidence import Evidence
from ..starts.seen_inertia import SeenInertia
from .by_run import ERRORS, LISTED, RunValue, ends

_DIFFERS = 0.1  # of the rms torque of all runs, between two of them


@dataclass(frozen=True)
class RunLoad(RunValue):
    """What a run needs beyond the model, N m.

    Attributes:
        doubles: how far it must be off to double the squares that are left with it, N m.
    """

    doubles: float


def different_loads(evidence: Evidence, seen: Mapping[str, SeenInertia]) -> list[RunLoad]:
    """Return the load of each run that clearly shows one; none where it may be one of all.

    One load for all must leave twice the squares of one for each.

    Args:
        evidence: the runs.
        seen: what each run shows, from `seen_by_run`.
    """
    every = [RunLoad(name, *own.load) for name, own in seen.items()]
    found = [run for run in every if np.isfinite([run.value, run.error, run.doubles]).all()]
    if len(found) < 2:
        return []
    least, most = ends(found)
    rms = np.sqrt(np.mean([np.mean(record.torque**2) for record in evidence.records.records]))
    needed = max(_DIFFERS * rms, ERRORS * float(np.hypot(least.error, most.error)))
    return found if most.value - least.value > needed and _worse_as_one(found) else []


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
    least, most = ends(found)
    told = found if len(found) <= LISTED else [least, most]
    more = [f"{run.name} {run.value - least.value:.3g}" for run in told if run is not least]
    return (
        f"A constant {what} differs from run to run, as with a payload that weighs: beyond "
        f"{least.name} need {', '.join(more)} {unit} (by regression of each run). One model cannot "
        "hold them all: what it leaves may be named as something else, or pull the inertia away. "
        "Diagnose runs of one load apart, and note with each run what the axis carried."
    )
