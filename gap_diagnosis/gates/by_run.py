"""What each run by itself shows of its inertia and load, beside friction of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns
from ..starts.other_splits import YIELDS
from ..starts.seen_inertia import SeenInertia
from ..starts.seen_torques import SeenTorques

ERRORS = 5.0
"""Standard errors of the difference of two runs, from which they differ."""
LISTED = 8
"""Runs whose values are all told; of more, the least and the greatest."""


@dataclass(frozen=True)
class RunValue:
    """A value of a run by the name of the run, and its standard error."""

    name: str
    value: float
    error: float


Value = TypeVar("Value", bound=RunValue)


def ends(found: Sequence[Value]) -> tuple[Value, Value]:
    """Return the runs of the least and of the greatest value."""
    ordered = sorted(found, key=lambda run: run.value)
    return ordered[0], ordered[-1]


def seen_by_run(evidence: Evidence, model: Model) -> Mapping[str, SeenInertia]:
    """Return what each run shows, by its name; of runs that show too little, nothing.

    Nothing is seen of steady periods, which show too few lines; of slow motion, which shows no
    inertia; of what swings free, which shows ratios to it; nor of an axis that yields.

    Args:
        evidence: the runs.
        model: the best model.
    """
    records = evidence.records
    yields = not model.rigid or f"{YIELDS}.compliance_rad_nm" in model.effects
    if evidence.slow or records.swings_free or isinstance(records, SteadyRuns) or yields:
        return {}
    found = {}
    for index, record in enumerate(records.records):
        parts = [p for p, part in enumerate(evidence.parts) if part.record == index]
        own = SeenTorques(evidence, parts, model).inertia(not records.linear) if parts else None
        if own is not None:
            found[record.name] = own
    return found
