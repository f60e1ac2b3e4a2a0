"""Does the inertia differ from run to run, by a payload or by the pose of other joints?

One model cannot hold two inertias: its fit lies between them, and what it leaves would be told as
friction that scatters. So each run is asked for its own, with friction and load of its own. Laws
that the model lacks bend that, too; but only another inertia makes one inertia for all runs so much
worse than one for each, if no mass behind a spring does as well, which is another inertia at each
frequency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..model.evidence import Evidence
from ..starts.seen_inertia import SeenInertia
from ..starts.seen_resonance import masses
from .by_run import ERRORS, LISTED, RunValue, ends

_DIFFERS = 0.1  # of the greatest inertia, between two runs
_LAW = 0.02  # of each inertia: what no law of a catalogue is right about
_SHARE = 0.25  # of a run's torque, rms, that accelerates: less of it shows no inertia
_WORSE = 2.0
"""Squares that one inertia for all runs leaves over those of one for each. Of 36 random rigs of one
inertia, whose friction scattered by 2 to 5 %, none whose runs all accelerate enough left more than
1.4 times as much. Of 20 others, of which half of the runs carry a payload, 19 are told at 20 % more
inertia, and all at 40 %."""


def different_inertias(evidence: Evidence, seen: Mapping[str, SeenInertia]) -> list[RunValue]:
    """Return the inertia of each run that clearly shows one, kg m2; none where one may be of all.

    Args:
        evidence: the runs.
        seen: what each run shows, from `seen_by_run`.
    """
    shown = {n: own for n, own in seen.items() if own.value > 0.0 and own.share >= _SHARE}
    found = [RunValue(name, own.value, own.error) for name, own in shown.items()]
    if len(found) < 2 or not _apart(found):
        return []
    records = evidence.records
    shortest_s = min(r.samples for r in records.records) / records.sample_rate_hz
    tried = masses(shortest_s, evidence.simulator.crossover_hz)
    return found if tried and _worse_as_one(list(shown.values()), tried) else []


def _apart(found: Sequence[RunValue]) -> bool:
    """Tell whether the least and the greatest differ beyond their errors, and enough to matter."""
    least, most = ends(found)
    errors = [np.hypot(run.error, _LAW * run.value) for run in (least, most)]
    needed = max(_DIFFERS * most.value, ERRORS * float(np.hypot(*errors)))
    return most.value - least.value > needed


def _worse_as_one(seen: Sequence[SeenInertia], tried: Sequence[tuple[float, float]]) -> bool:
    """Tell whether one inertia for all runs leaves much more, beside any mass behind a spring."""
    least = _WORSE * sum(run.missing.size for run in seen)
    products = (np.sum([run.against(*mass) for run in seen], axis=0) for mass in tried)
    return all(_left(each) > least for each in products)


def _left(products: np.ndarray) -> float:
    """Return the squares that one inertia and one mass leave, from `SeenInertia.against`."""
    sizes = np.linalg.lstsq(products[:2, :2], products[:2, 2], rcond=None)[0]
    return float(products[2, 2] - products[:2, 2] @ sizes)


def inertias_differ(found: Sequence[RunValue], linear: bool) -> str:
    """Return what to say of runs of different inertia.

    Args:
        found: from `different_inertias`, not empty.
        linear: whether the axis is linear, its inertia a mass.
    """
    unit, what = ("kg", "mass") if linear else ("kg m2", "inertia")
    told = found if len(found) <= LISTED else ends(found)
    each = ", ".join(f"{run.value:.3g} in {run.name}" for run in told)
    only = "" if told is found else f"; the least and the greatest of {len(found)} runs"
    return (
        f"The {what} differs from run to run, as with a payload or another pose: {each} ({unit}, "
        f"by regression of each run that shows it clearly{only}). One model cannot hold them all: "
        f"its {what} lies between, and what it leaves may be named as something else. Diagnose the "
        f"runs of each {what} apart, and note with each run what the axis carried."
    )
