"""`fjr run`: a campaign through the ROS graph."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fjr_kit.errors import needing_ros

from .campaign_options import CampaignOptions, DryRun, Out, Rig, print_estimate
from .cli_errors import reports_errors
from .option_groups import takes_groups

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign
    from fjr_bringup.campaign.progress import CampaignProgress

Composed = Annotated[
    bool,
    typer.Option("--composed", help="Run all nodes in one process, which is faster than one each."),
]
Live = Annotated[
    bool, typer.Option("--live", help="Draw the BLA estimated so far after each realization.")
]
UntilDb = Annotated[
    float | None,
    typer.Option(
        min=1e-6,
        metavar="DB",
        help="Stop recording a level once the standard deviation of its BLA (the median over the "
        "lines) is at most this, after four realizations at the earliest.",
    ),
]


@reports_errors(kept="nothing was recorded")
@takes_groups
def run(
    *,
    rig: Rig = None,
    out: Out = None,
    options: CampaignOptions,
    composed: Composed = False,
    live: Live = False,
    until_db: UntilDb = None,
    dry_run: DryRun = False,
) -> None:
    """Run a campaign through the ROS graph and record one bag per realization."""
    from .campaign_folder import fill_folder, new_folder

    folder = out or new_folder()
    campaign = options.campaign(rig, folder)
    if dry_run:
        print_estimate(campaign, out, on_graph=True)
        return
    with needing_ros(", or use fjr simulate"):
        from fjr_bringup.graph.graph_run import run_campaign
    if not live and until_db is None:
        fill_folder("run", partial(run_campaign, composed=composed), campaign, folder)
        typer.echo(folder)
        return
    from fjr_bringup.campaign.live import LiveBla

    def watched(campaign: Campaign, folder: Path, *, progress: CampaignProgress) -> list[Path]:
        bla = LiveBla(campaign, progress.say, until_db, draw=live)
        return run_campaign(campaign, folder, composed=composed, live=bla, progress=progress)

    fill_folder("run", watched, campaign, folder)
    typer.echo(folder)
