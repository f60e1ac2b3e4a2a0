"""`fjr demo`: the paper's experiment through the ROS graph, and its analysis."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fjr_kit.errors import needing_ros

from .analyze import analyze_folder
from .cli_errors import reports_errors

DEMO: dict[str, dict[str, Any]] = {
    "excitation": {
        "amplitudes_rad": (7e-3,),
        "realizations": 7,
        "periods": 2,
        "transient_periods": 1,
    },
    "simulator": {"noise_std_rad": 2e-5},
}
"""The paper's rig near its best amplitude, with the noise of an encoder of about 16 bits."""


@reports_errors(kept="what was recorded is kept, and the same command goes on")
def demo(
    out: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER", help="Experiment folder; one that holds the demo already is resumed."
        ),
    ] = Path("experiments/demo"),
) -> None:
    """Run the paper's experiment through the ROS graph, analyze it and write a report.

    Seven realizations at the paper's best amplitude, with a little encoder noise. Run again, it
    keeps the bags that are there and only analyzes them anew.
    """
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    with needing_ros(", or use fjr simulate"):
        from fjr_bringup.graph.graph_run import run_campaign
    from fjr_bringup.campaign.plan import Campaign

    from .campaign_folder import fill_folder

    fill_folder("demo", run_campaign, Campaign.create(None, DEMO), out)
    typer.echo(analyze_folder(out))
