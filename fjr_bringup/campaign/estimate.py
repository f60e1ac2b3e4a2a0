"""What a campaign will take: `--dry-run`, from a piece of it that is simulated and written."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from fjr_interface.bags.writer import BagWriter
from fjr_sim_node.simulation.simulator import recorded_signals, run_realization

from .plan import Campaign

LOCKSTEP_S = 1e-3
"""Processor time of one sample on the ROS graph: `fjr demo`, nodes in processes of their own."""


@dataclass(frozen=True)
class Estimate:
    """What is still to do of a campaign.

    Attributes:
        bags: how many there are in all, one for each realization.
        pending: how many of them are missing.
        samples: samples of one bag.
        simulated_s: simulated time of the missing ones.
        disk_bytes: their size.
        batch_s: processor time of simulating and writing them.
        graph_s: processor time of playing them in lockstep, by `LOCKSTEP_S`.
    """

    bags: int
    pending: int
    samples: int
    simulated_s: float
    disk_bytes: float
    batch_s: float
    graph_s: float


def estimate(campaign: Campaign, folder: Path | None = None) -> Estimate:
    """Simulate and write one period of a campaign; return what all of it takes.

    Args:
        campaign: what is to be played.
        folder: its experiment folder, if it may hold a part of the bags.
    """
    whole = campaign.experiment(campaign.levels - 1, 0)
    piece = whole.model_copy(update={"periods": 1, "transient_periods": 0})
    values = campaign.values["simulator"]
    signals = recorded_signals(values)
    run_realization(values, piece)  # compiles
    with tempfile.TemporaryDirectory(prefix="fjr-estimate-") as scratch:
        begun = time.perf_counter()
        motion = run_realization(values, piece)
        with BagWriter(Path(scratch) / "bag", piece, signals=signals) as bag:
            bag.write_arrays(**motion.recorded(signals))
        seconds = time.perf_counter() - begun
        size = sum(file.stat().st_size for file in bag.folder.iterdir())
    there = campaign.recorded(folder) if folder is not None else 0
    pending = len(campaign.runs) - there
    samples = pending * whole.samples
    return Estimate(
        bags=len(campaign.runs),
        pending=pending,
        samples=whole.samples,
        simulated_s=samples / whole.sample_rate_hz,
        disk_bytes=samples * size / piece.samples,
        batch_s=samples * seconds / piece.samples,
        graph_s=samples * LOCKSTEP_S,
    )
