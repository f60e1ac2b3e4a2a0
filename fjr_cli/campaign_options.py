"""Options of the commands that play an experiment, and the campaign that they describe."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from fjr_bringup.campaign.plan import Campaign

Rig = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="ROS parameter file of rig and experiment; default: the paper's."
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Experiment folder; one that holds a campaign already is resumed. Default: a new one "
        "below ./experiments.",
    ),
]
Levels = Annotated[
    list[float] | None,
    typer.Option("--level", metavar="A", help="Amplitude of each line in rad. Repeatable."),
]
Realizations = Annotated[int | None, typer.Option(help="Phase realizations of each level (M).")]
Periods = Annotated[int | None, typer.Option(help="Periods to keep of each realization (P).")]
TransientPeriods = Annotated[int | None, typer.Option(help="Leading periods to discard.")]
Seed = Annotated[int | None, typer.Option(help="Seed of the grid and of all phases.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NODE.PARAMETER=VALUE",
        help="Any parameter of excitation, controller or simulator, such as simulator.k1=0.0. "
        "Repeatable.",
    ),
]


def described_campaign(
    rig: Path | None, settings: list[str] | None, out: Path | None = None, **excitation: Any
) -> Campaign:
    """Return the campaign that options describe.

    Args:
        rig: parameter file; None for that of a campaign in `out`, else the paper's.
        settings: `node.parameter=value` that win over the file.
        out: experiment folder.
        excitation: values of the excitation that win over the settings; None if not given.

    Raises:
        InputError: a bad file, setting or value, or values that don't fit together.
    """
    from fjr_bringup.campaign.plan import CAMPAIGN_FILE, Campaign
    from fjr_bringup.campaign.settings import parse_settings

    overrides = parse_settings(settings or [])
    given = {name: value for name, value in excitation.items() if value is not None}
    overrides["excitation"] = {**overrides.get("excitation", {}), **given}
    if rig is None and out is not None and (out / CAMPAIGN_FILE).exists():
        rig = out / CAMPAIGN_FILE
    return Campaign.create(rig, overrides)
