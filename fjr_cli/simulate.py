"""`fjr simulate`: a campaign, or records, through the batch simulation."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .campaign_options import CampaignOptions, DryRun, Out, Rig, print_estimate
from .cli_errors import reports_errors
from .described_runs import RunOptions
from .option_groups import takes_groups
from .worker_options import Workers

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign


@reports_errors(kept="nothing was recorded")
@takes_groups
def simulate(
    *,
    rig: Rig = None,
    out: Out = None,
    options: CampaignOptions,
    described: RunOptions,
    workers: Workers = None,
    dry_run: DryRun = False,
) -> None:
    """Simulate a campaign, without ROS and at full speed, into the bags that `fjr run` records.

    With --record the reference does not repeat; --set record.NAME=VALUE sets what a chirp or a move
    needs. With --controller any linear controller closes the loop; the controller node itself plays
    its PD law only.
    """
    from fjr_bringup.campaign.batch_run import simulate_campaign
    from fjr_kit.errors import InputError

    from .campaign_folder import fill_folder, new_folder

    folder = out or new_folder()
    own = described.own_settings(options)
    campaign = options.campaign(rig, folder, without=own)
    if dry_run:
        if described.given:
            raise InputError("--dry-run is for campaigns, without --record and --controller.")
        print_estimate(campaign, out, on_graph=False)
        return
    if described.given:
        _simulate_described(campaign, folder, described, own, workers)
    else:
        fill_folder("simulate", partial(simulate_campaign, workers=workers), campaign, folder)
    typer.echo(folder)


def _simulate_described(
    campaign: Campaign,
    folder: Path,
    described: RunOptions,
    settings: list[str],
    workers: int | None,
) -> None:
    from fjr_bringup.campaign.batch_run import simulate_runs
    from fjr_bringup.campaign.progress import CampaignProgress
    from fjr_kit.atomic import refuse_existing

    refuse_existing(folder)
    runs, reference = described.runs(campaign, settings)
    rate = campaign.values["excitation"]["sample_rate_hz"]
    with CampaignProgress() as progress:
        seconds = [(run.samples or 0) / rate for run in runs]
        progress.expect_s(sum(seconds))
        simulate_runs(
            campaign.values["simulator"],
            runs,
            folder,
            reference=reference,
            progress=progress,
            workers=workers,
        )
