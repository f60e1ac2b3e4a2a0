"""Plays recorded runs in what was exported, in the loop in which they were recorded."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from controller_node import transfer_function
from fjr_interface.bags.files import find_bags
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError
from fjr_records.records import Record, RecordSet, read_records, reference_optional
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation.closed_loop import Trajectory
from gap_diagnosis.model.drive import Drive
from gap_diagnosis.model.evidence import Evidence

from .joint import Joint
from .result import RecordReplay

DIAGNOSIS_FILE = "diagnosis.json"


class Stepped(Protocol):
    """A simulated joint that is commanded sample by sample."""

    def begin(self, position: float, speed: float) -> None:
        """Set position (rad) and velocity (rad/s) of all bodies."""

    def position(self) -> float:
        """Return the motor position (rad)."""

    def hold(self, torque: float) -> None:
        """Advance by one sample under a torque (N m)."""


@dataclass(frozen=True)
class Run:
    """One recorded run, and how the joint's own simulation plays it.

    Attributes:
        record: the run.
        held_out: whether the fit of a diagnosis does not see it.
        drive: what drives simulations of it.
        simulation: of the joint with all its effects; None where the motion diverges.
    """

    record: Record
    held_out: bool
    drive: Drive
    simulation: Trajectory | None


def record_folder(place: Path) -> Path:
    """Return the folder of bags that a place stands for: itself, or that around a diagnosis.

    Raises:
        InputError: there are no bags.
    """
    if (place / DIAGNOSIS_FILE).is_file() or place.name == DIAGNOSIS_FILE:
        folder = place.resolve()
        around = folder.parents[1] if place.name == DIAGNOSIS_FILE else folder.parent
        try:
            find_bags(around)
        except InputError:
            raise InputError(
                f"{place}: no bags stand around this diagnosis; give --replay the folder of the "
                "bags themselves."
            ) from None
        return around
    find_bags(place)
    return place


def read_runs(place: Path, signal_map: SignalMap = DEFAULT) -> RecordSet:
    """Read the bags of a folder, or those around a diagnosis, as records."""
    folder = record_folder(place)
    return read_records(folder, reference_optional(signal_map))


def runs_of(joint: Joint, records: RecordSet) -> list[Run]:
    """Return the held-out runs of records; all, where none is held out.

    Raises:
        InputError: the records are too short, a controller is described badly, or the simulated
            motion diverges in all of them.
    """
    evidence = Evidence(records, joint.bare)
    held = _held_out(evidence)
    e = effects.coefficients(joint.values)
    p = plant.coefficients(joint.values)
    runs = []
    for index in held or range(len(records.records)):
        drive = evidence.player.drive(index)
        if drive.law.steps > 1:  # a target takes one torque in each sample
            drive = evidence.player.observed(index)
        if isinstance(records.records[index].description, Experiment) and not drive.observed:
            drive = replace(drive, start=(0.0, 0.0), entry=None)  # periods begin at rest
        try:
            simulation = drive.simulated(joint.sample_rate_hz, p, e)
        except InputError:
            simulation = None
        runs.append(Run(records.records[index], bool(held), drive, simulation))
    if all(run.simulation is None for run in runs):
        raise InputError(
            f"{joint.source}: its simulation diverges in every run of {records.source}; check that "
            "the bags are of this joint."
        )
    return runs


def _held_out(evidence: Evidence) -> tuple[int, ...]:
    """Return the runs that no fit of a diagnosis sees, by its own rules."""
    fitted = {evidence.parts[part].record for part in evidence.parts_for("fit")}
    return tuple(sorted({part.record for part in evidence.parts} - fitted))


def motions(runs: Collection[Run]) -> list[Trajectory]:
    """Return the simulated motions that do not diverge."""
    return [run.simulation for run in runs if run.simulation is not None]


def compared(
    joint: Joint, runs: Collection[Run], target: Stepped, progress: Callable[[str], None]
) -> Iterator[RecordReplay]:
    """Yield how far the target is from each run and from the joint's own simulation of it."""
    for run in runs:
        progress(f"replaying {run.record.name}")
        played = _played(run.drive, target)
        own = None if run.simulation is None else run.simulation.position
        yield RecordReplay(
            record=run.record.name,
            held_out=run.held_out,
            loop="observed" if run.drive.observed else "closed",
            nrms_record=_nrms(played, run.record.position),
            nrms_simulation=_nrms(played, own),
            simulation_nrms_record=_nrms(own, run.record.position),
            seconds=run.record.samples / joint.sample_rate_hz,
        )


def _played(drive: Drive, target: Stepped) -> np.ndarray:
    """Return the motor position of the target at each sample (rad); NaN from where it diverges."""
    law = drive.law
    b, forward, a, limit = law.coefficients
    state = np.zeros(law.states + 1)
    if drive.entry is not None:
        state[:-1] = drive.entry
    added = np.zeros(drive.reference.size) if drive.command is None else drive.command
    position = np.full(drive.reference.size, np.nan)
    target.begin(*drive.start)
    for k, reference in enumerate(drive.reference.tolist()):
        y = target.position()
        if not abs(y) < _DIVERGED:
            break
        position[k] = y
        u = transfer_function.step(state, reference, y, b, forward, a, limit)
        target.hold(added[k] + u)
    return position


_DIVERGED = 1e6  # rad


def _nrms(signal: np.ndarray | None, truth: np.ndarray | None) -> float | None:
    """Return the rms error over the rms about the mean; None where either diverges."""
    if signal is None or truth is None or not np.isfinite(signal).all():
        return None
    return float(np.sqrt(np.mean((signal - truth) ** 2)) / max(float(np.std(truth)), 1e-300))
