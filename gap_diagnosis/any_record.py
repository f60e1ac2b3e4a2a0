"""Diagnosis of whatever a folder holds: steady periods, or records as they came."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fjr_interface.bags.reader import DEFAULT, BagReader, SignalMap, find_bags
from fjr_interface.experiment import RecordDescription
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.errors import InputError
from fjr_records.experiment_folder import Override
from fjr_records.periodic import RecordedExperiment, read_experiment
from fjr_records.records import RecordSet, read_records, reference_optional

from . import further_looks
from .drift_gate import drift_gate
from .gates.gate_checks import DISCRETISATION_LIMIT
from .investigation import Investigation, investigate
from .judgement import stopped
from .model.discretisation import discretisation_error
from .model.nominal import datasheet
from .model.quasi_static import Stations, stations
from .model.rig_model import Model
from .notes import NOT_HELD_OUT
from .outcome.diagnosis import Diagnosis
from .record_investigation import RecordInvestigation, investigate_records
from .which.search_space import TOLERANCE

Progress = Callable[[str], None]

STEADY_SHARE = 0.5
"""Of the budget for explanations of steady periods that leave noise alone."""
BESIDE = (
    "No explanation of the steady periods leaves noise alone, so the whole runs were searched for "
    "causes beside a remainder."
)
UNTESTED = (
    "Each level has a single run, so no run could be held out of a comparison by steady periods. "
    "The whole runs were searched instead, block by block, some of which no fit has seen."
)
UNSTEADY = (
    "The periods do not repeat as steady ones do, so the whole runs were searched for causes "
    "beside a remainder, which a change within a run is a part of."
)


def diagnose(
    folder: Path | str,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    effects: Sequence[str] | None = None,
    budget_s: float = math.inf,
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Diagnose the gap between the rig that recorded a folder of bags and its nominal simulation.

    Args:
        folder: experiment folder of bags, periodic or not.
        nominal: datasheet values of the bare plant's parameters in SI units, by the names of
            `fjr_sim_node.plant.PLANT`; friction and k1 may be left out, j and k0 of a rigid axis.
            `read_nominal` reads them from a parameter file.
        tolerance: how far a datasheet value may be off, relative.
        effects: identifiers to look for; None for all.
        budget_s: time after which nothing new is tried.
        progress: told which stage begins.

    Returns:
        The diagnosis; `investigate_any` returns its evidence as well, for `write_diagnosis`.

    Raises:
        InputError: damaged bags, bags of different rigs, a controller of an unknown kind, an effect
            of an unknown name, or a parameter that is missing or out of range.
    """
    sheet = datasheet(nominal, "nominal")
    return investigate_any(
        read_any(folder), sheet, tolerance=tolerance, effects=effects, budget_s=budget_s,
        progress=progress,
    ).diagnosis  # fmt: skip


def read_any(
    folder: Path | str,
    signal_map: SignalMap = DEFAULT,
    *,
    override: Override | None = None,
    resampling: Resampling | None = None,
    as_record: bool = False,
) -> RecordedExperiment | RecordSet:
    """Read a folder as steady periods where it has them, else as records.

    Bags say by their description which they are. Of bags without one the period is looked for.

    Args:
        folder: experiment folder.
        signal_map: which topics and fields are the signals.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.
        as_record: whether to take steady periods as records, too.

    Raises:
        InputError: see `read_experiment` and `read_records`; or periods that are set for records.
    """
    periods = override if override not in (None, Override()) else None
    optional = reference_optional(signal_map)
    kinds = [BagReader(bag, optional).experiment for bag in find_bags(folder)]
    if as_record or any(isinstance(kind, RecordDescription) for kind in kinds):
        if periods is not None:
            raise InputError(
                f"{folder}: records are not cut into periods; leave out the number of periods, of "
                "transient periods and of samples per period."
            )
        return read_records(folder, signal_map, resampling=resampling)
    try:
        return read_experiment(folder, signal_map, override=override, resampling=resampling)
    except InputError as error:
        if periods is not None or any(kind is not None for kind in kinds):
            raise
        records = read_records(folder, signal_map, resampling=resampling)
        why = str(error).split(";")[0].rstrip(".")
        note = f"Diagnosed as records, since no steady periods were found ({why})."
        return replace(records, notes=(note, *records.notes))


def investigate_any(
    recorded: RecordedExperiment | RecordSet,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    effects: Sequence[str] | None = None,
    budget_s: float = math.inf,
    progress: Progress = lambda _: None,
) -> Investigation | RecordInvestigation:
    """Diagnose what `read_any` has read and keep all the evidence; arguments as of `diagnose`.

    Steady periods are compared period by period, which shows the least effects. Where no
    explanation leaves noise alone, their runs are searched as records for causes beside a
    remainder; so are those of periods that do not repeat, whose verdict stays where nothing is
    found. An effect that steady periods would name is looked for in whole runs, too, where no run
    was held out: nothing is named that nothing has tested. Records of which nothing is named are
    compared by torque alone where they are slow enough for that. Where fits end as far from the
    datasheet as they may go, further looks take it for further off, and for right.
    """
    begun = time.monotonic()

    def look(tolerance: float, budget_s: float) -> Investigation | RecordInvestigation:
        return _look(recorded, nominal, tolerance, effects, budget_s, progress)

    found = look(tolerance, budget_s)
    took = time.monotonic() - begun
    bare = Model.nominal(nominal).plant
    for times, supposed in further_looks.called_for(found).items():
        left = begun + budget_s - time.monotonic()
        if left < took:  # another look takes about as long
            break
        progress(f"once more, for a datasheet that {supposed}")
        other = look(times * tolerance, left)
        if further_looks.says_more(other.diagnosis, found.diagnosis, bare):
            said = further_looks.said(other.diagnosis, bare, tolerance, times)
            notes = [said, *other.diagnosis.notes]
            found = replace(other, diagnosis=other.diagnosis.model_copy(update={"notes": notes}))
            break
    return found


def _look(
    recorded: RecordedExperiment | RecordSet,
    nominal: Mapping[str, float],
    tolerance: float,
    effects: Sequence[str] | None,
    budget_s: float,
    progress: Progress,
) -> Investigation | RecordInvestigation:
    """Diagnose with fits that look so far from the datasheet; arguments as of `diagnose`."""
    begun = time.monotonic()
    if isinstance(recorded, RecordedExperiment):
        steady = investigate(
            recorded, nominal, tolerance=tolerance, effects=effects,
            budget_s=STEADY_SHARE * budget_s, progress=progress,
        )  # fmt: skip
        if steady.gates.only_by_nominal:
            left = max(budget_s - (time.monotonic() - begun), 0.0)
            return _swinging(recorded, nominal, tolerance, effects, left, progress) or steady
        unsteady = steady.gates.only_unsteady
        untested = bool(steady.diagnosis.effects) and steady.diagnosis.reported_on == "none"
        if steady.diagnosis.verdict != "unexplained" and not unsteady and not untested:
            return steady
        left = max(budget_s - (time.monotonic() - begun), 0.0)
        whole = investigate_records(
            recorded.as_records(), nominal, tolerance=tolerance, effects=effects, budget_s=left,
            progress=progress,
        )  # fmt: skip
        if unsteady and not whole.diagnosis.causes:
            progress("drift within runs")
            return _drifting(steady, whole)
        return _beside(whole, steady, UNSTEADY if unsteady else UNTESTED if untested else BESIDE)
    return _of_records(recorded, nominal, tolerance, effects, budget_s, progress)


def _swinging(
    recorded: RecordedExperiment,
    nominal: Mapping[str, float],
    tolerance: float,
    effects: Sequence[str] | None,
    budget_s: float,
    progress: Progress,
) -> RecordInvestigation | None:
    """Diagnose whole runs whose loop, by the datasheet alone, cannot be simulated well.

    A loop that is damped by a friction which the datasheet lacks is one: it rings, or swings so
    that the recorded torque must drive the model. None where nothing is found, or where the loop
    with what was found cannot be simulated any better.
    """
    whole = investigate_records(
        recorded.as_records(), nominal, tolerance=tolerance, effects=effects, budget_s=budget_s,
        progress=progress,
    )  # fmt: skip
    if not whole.diagnosis.causes:
        return None
    error = discretisation_error(recorded, whole.found.best.model)
    return whole if np.max(error) <= DISCRETISATION_LIMIT else None


def _of_records(
    records: RecordSet,
    nominal: Mapping[str, float],
    tolerance: float,
    effects: Sequence[str] | None,
    budget_s: float,
    progress: Progress,
) -> RecordInvestigation:
    """Diagnose records as they came, slow ones by their torque alone.

    A loop that is known is played all the same, and first: it shows more than torques do.
    """
    begun = time.monotonic()

    def look(slow: Stations | None) -> RecordInvestigation:
        return investigate_records(
            records, nominal, tolerance=tolerance, effects=effects, progress=progress, slow=slow,
            budget_s=max(budget_s - (time.monotonic() - begun), 0.0),
        )  # fmt: skip

    slow = stations(records, nominal)
    known = any(r.controller and r.reference is not None for r in records.records)
    if slow is not None and not known:
        return look(slow)
    played = look(None)
    if slow is None or played.diagnosis.causes:
        return played
    still = look(slow)
    return still if still.diagnosis.causes else played


def _drifting(steady: Investigation, whole: RecordInvestigation) -> Investigation:
    """Return what gates said of unsteady periods, with whether friction drifts within runs."""
    gate = drift_gate(whole.fitter, whole.found.steps[0])
    gates = replace(steady.gates, gates=(*steady.gates.gates, gate))
    if gate.passed:
        return replace(steady, gates=gates)
    steadier = [g for g in gates.gates if g.passed or g.hint != "bad_data" or not g.of_periods]
    told = stopped("nonstationary", replace(gates, gates=tuple(steadier)))
    seen = {name: getattr(whole.diagnosis, name) for name in ("gap", "steps", "evidence")}
    return replace(steady, gates=gates, diagnosis=told.model_copy(update=seen))


def _beside(whole: RecordInvestigation, steady: Investigation, why: str) -> RecordInvestigation:
    """Return what was found beside a remainder, with what only steady periods tell."""
    known = steady.diagnosis
    notes = [note for note in known.notes if note != NOT_HELD_OUT]
    told = whole.diagnosis.model_copy(
        update={
            "bags": known.bags or whole.diagnosis.bags,
            "notes": [why, *_once(notes, whole.diagnosis.notes)],
        }
    )
    return replace(whole, diagnosis=told)


def _once(*notes: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(note for some in notes for note in some))
