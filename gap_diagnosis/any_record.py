"""Diagnosis of whatever a folder holds: steady periods, or records as they came."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.resampling.accuracy import Resampling
from fjr_kit.telling import Progress
from fjr_records.any_folder import open_folder
from fjr_records.experiment_bag import Override
from fjr_records.periodic import RecordedExperiment, whole
from fjr_records.records import RecordSet, reference_optional

from . import further_looks
from .investigation import Investigation, Order, investigate_runs
from .model.nominal import datasheet
from .model.quasi_static import stations
from .model.rig_model import Model
from .outcome.diagnosis import Diagnosis
from .outcome.linear_words import in_linear_units
from .starts.search_space import TOLERANCE
from .steady_periods import investigate_periods

UNKNOWN_GAINS = (
    "The periodic runs are compared as whole records, since gains of their controller are unknown"
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
        The diagnosis; `investigate` returns its evidence as well, for `write_diagnosis`.

    Raises:
        InputError: damaged bags, bags of different rigs, a controller of an unknown kind, an effect
            of an unknown name, or a parameter that is missing or out of range.
    """
    sheet = datasheet(nominal, "nominal")
    return investigate(
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
    Steady periods of a controller with unknown gains are taken as records as well, with a note.

    Args:
        folder: experiment folder.
        signal_map: which topics and fields are the signals.
        override: period, transient and number of periods, instead of what the bags say.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.
        as_record: whether to take steady periods as records, too.

    Raises:
        InputError: see `open_folder` and `whole`.
    """
    optional = reference_optional(signal_map)
    opened = open_folder(
        folder, optional, override=override, resampling=resampling, as_records=as_record
    )
    return opened if isinstance(opened, RecordSet) else _with_known_law(whole(opened))


def _with_known_law(recorded: RecordedExperiment) -> RecordedExperiment | RecordSet:
    """Return steady periods of a law that can be simulated, else whole runs, which give its gains.

    A mean period is that of a closed loop, which no law without its gains repeats.
    """
    laws = [r.experiment.controller or {} for r in recorded.realizations]
    unknown = dict.fromkeys(name for law in laws for name in law.get("unknown", []))
    if not unknown:
        return recorded
    records = recorded.as_records()
    note = f"{UNKNOWN_GAINS} ({', '.join(unknown)})."
    return replace(records, notes=(note, *records.notes))


def investigate(
    recorded: RecordedExperiment | RecordSet,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    effects: Sequence[str] | None = None,
    budget_s: float = math.inf,
    progress: Progress = lambda _: None,
) -> Investigation:
    """Diagnose what `read_any` has read and keep all the evidence; arguments as of `diagnose`.

    Of an experiment of steady periods the mean periods are compared, once the gates have passed;
    periods that do not repeat are compared as whole runs. Records of which nothing is named are
    compared by torque alone where they are slow enough for that. Where fits end as far from the
    datasheet as they may go, further looks take it for further off, and for right.
    """
    begun = time.monotonic()

    def look(tolerance: float, budget_s: float) -> Investigation:
        order = Order(nominal, tolerance, effects, budget_s, progress)
        if isinstance(recorded, RecordedExperiment):
            return investigate_periods(recorded, order)
        return _of_records(recorded, order)

    found = look(tolerance, budget_s)
    took = time.monotonic() - begun
    bare = Model.nominal(nominal).plant
    for times, supposed in further_looks.called_for(found, bare).items():
        left = begun + budget_s - time.monotonic()
        if left < took:  # another look takes about as long
            break
        progress(f"once more, for a datasheet that {supposed}")
        other = look(times * tolerance, left)
        if further_looks.says_more(other, found, bare, times):
            said = further_looks.said(other.diagnosis, bare, tolerance, times)
            notes = [said, *other.diagnosis.notes]
            found = replace(other, diagnosis=other.diagnosis.model_copy(update={"notes": notes}))
            break
    return replace(found, diagnosis=in_linear_units(found.diagnosis))


def _of_records(records: RecordSet, order: Order) -> Investigation:
    """Diagnose records as they came, slow ones by their torque alone.

    A loop that is known is played all the same, and first: it shows more than torques do.
    """
    slow = stations(records, order.nominal)
    known = any(r.controller and r.reference is not None for r in records.records)
    if slow is not None and not known:
        return investigate_runs(records, order, slow)
    played = investigate_runs(records, order)
    if slow is None or played.diagnosis.causes:
        return played
    still = investigate_runs(records, order, slow)
    return still if still.diagnosis.causes else played
