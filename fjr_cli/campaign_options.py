"""Options of the commands that play an experiment, and the campaign that they describe."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
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
DryRun = Annotated[
    bool,
    typer.Option(
        "--dry-run",
        help="Check everything and print the time and disk space that it takes; do no more.",
    ),
]


@dataclass(frozen=True)
class CampaignOptions:
    """Options of `plan`, `run` and `simulate`: what is played."""

    level: Levels = None
    realizations: Realizations = None
    periods: Periods = None
    transient_periods: TransientPeriods = None
    seed: Seed = None
    settings: Set = None

    def campaign(
        self, rig: Path | None, out: Path | None = None, without: Collection[str] = ()
    ) -> Campaign:
        """Return the campaign, see `described_campaign`; `without`: settings that are not its."""
        return described_campaign(
            rig,
            [setting for setting in self.settings or [] if setting not in without],
            out,
            amplitudes_rad=tuple(self.level) if self.level else None,
            realizations=self.realizations,
            periods=self.periods,
            transient_periods=self.transient_periods,
            seed=self.seed,
        )


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


def print_estimate(
    campaign: Campaign, folder: Path | None, *, on_graph: bool, bags: bool = True
) -> None:
    """Print what a campaign will take.

    Args:
        campaign: what is to be played.
        folder: its experiment folder; None for a new one.
        on_graph: whether it is played on the ROS graph, or simulated in batch.
        bags: whether they are written.
    """
    from fjr_bringup.campaign.estimate import estimate
    from fjr_kit.worker_pool import worker_count

    found = estimate(campaign, folder)
    typer.echo(
        f"{campaign.levels} level{'s' * (campaign.levels > 1)}, {found.bags} bags of "
        f"{found.samples} samples; {found.pending} to record, {duration(found.simulated_s)} of "
        "simulated time."
    )
    if bags:
        typer.echo(f"Disk: {size(found.disk_bytes)}, measured on one period.")
    if on_graph:
        typer.echo(
            f"Time: about {duration(found.graph_s)} of processor time, at 1 ms a sample, which "
            "two or more cores share."
        )
        return
    workers = worker_count(None, found.pending)
    typer.echo(
        f"Time: about {duration(found.batch_s / max(workers, 1))} with {workers} processes, from "
        "one period on this machine."
    )


def duration(seconds: float) -> str:
    """Return a time as a person reads it."""
    if seconds < 120.0:
        return f"{max(seconds, 1.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def size(count: float) -> str:
    """Return a size in bytes as a person reads it."""
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"
