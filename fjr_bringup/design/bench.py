"""Where a search measures: the batch simulation in memory, or the ROS graph with bags."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from fjr_kit.errors import needing_ros

from ..campaign.plan import Campaign
from ..campaign.progress import CampaignProgress
from .measured import MeasuredLevel, read_levels, simulate_level

Bench = Callable[[Campaign, str], MeasuredLevel]
"""Measures the only level of a campaign under a name."""


def altered(campaign: Campaign, **excitation: Any) -> Campaign:
    """Return the campaign with other values of its excitation.

    Raises:
        InputError: the values don't fit together.
    """
    values: Mapping[str, Mapping[str, Any]] = {
        **campaign.values,
        "excitation": {**campaign.values["excitation"], **excitation},
    }
    return Campaign.create(None, values)


def batch_bench(campaign: Campaign, _name: str) -> MeasuredLevel:
    """Simulate all realizations in memory, on all cores (the physics holds no lock)."""
    count = campaign.values["excitation"]["realizations"]
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        parts = list(pool.map(lambda one: simulate_level(campaign, 0, [one]), range(count)))
    together = tuple(part.realizations[0] for part in parts)
    return dataclasses.replace(parts[0], realizations=together)


def graph_bench(out: Path) -> Bench:
    """Return a bench that runs the ROS graph and keeps its bags below `out`; it resumes.

    Raises:
        InputError: there is no ROS 2.
    """
    with needing_ros(", or leave --graph out"):
        from ..graph.graph_run import run_campaign

    def measure(campaign: Campaign, name: str) -> MeasuredLevel:
        folder = out / name
        with CampaignProgress() as progress:
            run_campaign(campaign, folder, progress=progress)
        return read_levels(folder)[0]

    return measure
