"""`fjr simulate`: a campaign through the batch simulation."""

from __future__ import annotations

from functools import partial

import typer

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
from .worker_options import Workers


@reports_errors(kept="nothing was recorded")
def simulate(
    rig: Rig = None,
    out: Out = None,
    level: Levels = None,
    realizations: Realizations = None,
    periods: Periods = None,
    transient_periods: TransientPeriods = None,
    seed: Seed = None,
    settings: Set = None,
    workers: Workers = None,
) -> None:
    """Make the same campaign, with the same bags, without ROS and as fast as the machine can."""
    from fjr_bringup.campaign.batch_run import simulate_campaign

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
    fill_folder("simulate", partial(simulate_campaign, workers=workers), campaign, folder)
    typer.echo(folder)
