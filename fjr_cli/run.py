"""`fjr run`: a campaign through the ROS graph."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from fjr_kit.errors import needing_ros

from .campaign_options import (
    Levels,
    Out,
    Periods,
    Realizations,
    Rig,
    Seed,
    Set,
    TransientPeriods,
    described_campaign,
)
from .cli_errors import reports_errors

Composed = Annotated[
    bool, typer.Option("--composed", help="All nodes in one process instead of one each: faster.")
]


@reports_errors(kept="nothing was recorded")
def run(
    rig: Rig = None,
    out: Out = None,
    level: Levels = None,
    realizations: Realizations = None,
    periods: Periods = None,
    transient_periods: TransientPeriods = None,
    seed: Seed = None,
    settings: Set = None,
    composed: Composed = False,
) -> None:
    """Run a campaign through the ROS graph and record one bag per realization."""
    with needing_ros(", or use fjr simulate"):
        from fjr_bringup.graph.graph_run import run_campaign

    from .campaign_folder import fill_folder, new_folder

    folder = out or new_folder()
    campaign = described_campaign(
        rig,
        settings,
        folder,
        amplitudes_rad=tuple(level) if level else None,
        realizations=realizations,
        periods=periods,
        transient_periods=transient_periods,
        seed=seed,
    )
    fill_folder("run", partial(run_campaign, composed=composed), campaign, folder)
    typer.echo(folder)
