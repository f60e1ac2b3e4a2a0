"""Runs a campaign through the batch simulation, without ROS, on all cores, into the same bags."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_interface.parameter_file import save_parameter_file
from fjr_kit.atomic import new_folder
from fjr_kit.worker_pool import worker_count, worker_pool
from fjr_sim_node.simulation.simulator import (
    SIMULATOR,
    Run,
    recorded_signals,
    run_realization,
)

from .plan import Campaign
from .progress import CampaignProgress

RIG_FILE = "rig.yaml"
"""The simulated rig's parameters in a folder of `simulate_runs`."""


def simulate_campaign(
    campaign: Campaign,
    folder: Path | str,
    *,
    progress: CampaignProgress | None = None,
    workers: int | None = None,
) -> list[Path]:
    """Simulate the realizations of a campaign that a folder has no whole bag of yet.

    Several workers are started as new processes, which import the script that calls this: such a
    script calls it below `if __name__ == "__main__":`.

    Args:
        campaign: what to run.
        folder: experiment folder; an interrupted campaign in it is resumed.
        progress: where progress is shown; None shows none.
        workers: processes; None for one on each core, 1 for this process alone.

    Returns:
        The bags that were written, in the order in which they were finished.

    Raises:
        InputError: the folder can't be used, or a motion diverges; finished bags are kept.
    """
    folder = Path(folder)
    progress = progress or CampaignProgress(Console(quiet=True))
    pending = campaign.open_folder(folder)
    progress.expect(campaign, pending)
    count = worker_count(workers, len(pending))
    if count <= 1:
        return [_finish(progress, *_simulate(campaign, folder, *run)) for run in pending]
    with worker_pool(count) as pool:
        futures = [pool.submit(_simulate, campaign, folder, *run) for run in pending]
        return [_finish(progress, *future.result()) for future in as_completed(futures)]


def simulate_runs(
    values: Mapping[str, Any],
    runs: Sequence[Run],
    folder: Path | str,
    *,
    reference: np.ndarray | None = None,
    progress: CampaignProgress | None = None,
    workers: int | None = None,
) -> list[Path]:
    """Simulate described runs of any kind, with any controller, into a new folder, all or none.

    Args:
        values: checked SIMULATOR values; they come into the folder as `rig.yaml`.
        runs: descriptions with a controller whose gains are known; see `run_realization`.
        folder: experiment folder, which must not exist.
        reference: samples of the reference of all runs (rad); None makes them.
        progress: where progress is shown; None shows none.
        workers: see `simulate_campaign`.

    Returns:
        The bags in the order of the runs.

    Raises:
        InputError: the folder exists, a description is incomplete, or a motion diverges.
    """
    folder = Path(folder)
    progress = progress or CampaignProgress(Console(quiet=True))
    count = worker_count(workers, len(runs))
    with new_folder(folder) as hidden:
        save_parameter_file(hidden / RIG_FILE, {"simulator": values}, {"simulator": SIMULATOR})
        if count <= 1:
            for run in runs:
                _finish(progress, *_write(values, run, reference, hidden))
        else:
            with worker_pool(count) as pool:
                futures = [pool.submit(_write, values, run, reference, hidden) for run in runs]
                for future in as_completed(futures):
                    _finish(progress, *future.result())
    return [bag_folder(folder, run.level, run.realization) for run in runs]


def _simulate(campaign: Campaign, folder: Path, level: int, realization: int) -> tuple[Path, float]:
    """Simulate and write one realization; return its bag and its length in seconds."""
    experiment = campaign.experiment(level, realization)
    return _write(campaign.values["simulator"], experiment, None, folder)


def _write(
    values: Mapping[str, Any], run: Run, reference: np.ndarray | None, folder: Path
) -> tuple[Path, float]:
    trajectory = run_realization(values, run, reference)
    bag = bag_folder(folder, run.level, run.realization)
    signals = recorded_signals(values)
    with BagWriter(bag, run, signals=signals) as writer:
        writer.write_arrays(**trajectory.recorded(signals))
    return bag, trajectory.reference.size / run.sample_rate_hz


def _finish(progress: CampaignProgress, bag: Path, seconds: float) -> Path:
    progress.finish_run(f"{bag.name} simulated", seconds)
    return bag
