"""Short campaigns, played by the graph or in batch, and the bytes of their bags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fjr_bringup.campaign.batch_run import simulate_campaign
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.campaign.progress import CampaignProgress
from fjr_bringup.graph.graph_run import run_campaign


def campaign(
    rate: float = 1000.0, base: float = 1.0, *, m: int = 1, **given: dict[str, Any]
) -> Campaign:
    """Return a short campaign: one kept period of 1/base seconds."""
    excitation = {
        "base_frequency_hz": base,
        "f_min_hz": base,
        "f_max_hz": min(40.0 * base, 0.4 * rate),
        "realizations": m,
        "periods": 1,
        **given.pop("excitation", {}),
    }
    overrides = {"excitation": excitation, "controller": {}, "simulator": {}, **given}
    for values in overrides.values():
        values["sample_rate_hz"] = rate
    return Campaign.create(None, overrides)


def in_graph(campaign: Campaign, folder: Path, **options: Any) -> Path:
    with CampaignProgress() as progress:
        run_campaign(campaign, folder, progress=progress, **options)
    return folder


def in_batch(campaign: Campaign, folder: Path) -> Path:
    with CampaignProgress() as progress:
        simulate_campaign(campaign, folder, progress=progress, workers=1)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    """Return the bytes of all files of all bags."""
    files = sorted(folder.glob("level_*/*"))
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}
