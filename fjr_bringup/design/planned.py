"""What a planned campaign is expected to record, simulated in memory: a few runs for all."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fjr_interface.experiment import Experiment
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_records.records import Record, RecordSet
from fjr_sim_node.simulation.closed_loop import Trajectory
from fjr_sim_node.simulation.simulator import Run, run_realization

from ..campaign.plan import Campaign

ENOUGH = 3
"""Realizations of each level that are simulated at the most."""


def planned_record(
    campaign: Campaign, runs: Sequence[Run] | None = None, reference: np.ndarray | None = None
) -> RecordedExperiment | RecordSet:
    """Return what a campaign is expected to record, its first three realizations at the most.

    Args:
        campaign: the plan; its simulator parameters play the rig, noise included.
        runs: descriptions instead of the campaign's multisines, such as of
            `excitation_node.record_experiment.describe_record`.
        reference: samples of the reference of all runs (rad); None makes them.

    Returns:
        Steady periods, or records if the runs are not periodic; for `gap_diagnosis.foresee`, which
        is told the number of realizations.

    Raises:
        InputError: a description is incomplete, or the motion diverges.
    """
    if runs is None:
        runs = [campaign.experiment(*run) for run in campaign.runs]
    few = sorted(
        (run for run in runs if run.realization < ENOUGH),
        key=lambda run: (run.level, run.realization),
    )
    rig = campaign.values["simulator"]
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        played = list(pool.map(lambda run: run_realization(rig, run, reference), few))
    name = "the planned experiment"
    if all(isinstance(run, Experiment) for run in few):
        periods = tuple(_periods(run, each) for run, each in zip(few, played, strict=True))
        return RecordedExperiment(name, periods)
    records = tuple(
        Record(_name(run), run, each.reference, each.torque, each.position, None)
        for run, each in zip(few, played, strict=True)
    )
    return RecordSet(name, few[0].sample_rate_hz, records)


def _periods(run: Run, played: Trajectory) -> RecordedRealization:
    assert isinstance(run, Experiment)
    signals = (played.reference, played.torque, played.position)
    r, u, y = (signal.reshape(-1, run.samples_per_period) for signal in signals)
    return RecordedRealization(_name(run), run, r, u, y, None)


def _name(run: Run) -> str:
    return f"level {run.level}, realization {run.realization}"
