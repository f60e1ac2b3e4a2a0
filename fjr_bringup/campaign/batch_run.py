"""Runs a campaign through the batch simulation, without ROS, on all cores, into the same bags."""

from __future__ import annotations

from concurrent.futures import as_completed
from pathlib import Path

from rich.console import Console

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_kit.worker_pool import worker_count, worker_pool
from fjr_sim_node.simulation.simulator import run_realization

from .plan import Campaign
from .progress import CampaignProgress


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


def _simulate(campaign: Campaign, folder: Path, level: int, realization: int) -> tuple[Path, float]:
    """Simulate and write one realization; return its bag and its length in seconds."""
    experiment = campaign.experiment(level, realization)
    trajectory = run_realization(campaign.values["simulator"], experiment)
    bag = bag_folder(folder, level, realization)
    with BagWriter(bag, experiment) as writer:
        writer.write_arrays(r=trajectory.reference, y=trajectory.position, u=trajectory.torque)
    return bag, experiment.samples / experiment.sample_rate_hz


def _finish(progress: CampaignProgress, bag: Path, seconds: float) -> Path:
    progress.finish_run(f"{bag.name} simulated", seconds)
    return bag
