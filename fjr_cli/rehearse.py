"""`fjr rehearse`: an experiment on the wall clock, and whether it may go."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from fjr_kit.errors import needing_ros
from fjr_kit.invocation import command_line

from .campaign_options import Rig, Set
from .cli_errors import INTERRUPTED, reports_errors
from .graph_options import RIG, Namespace

NO_GO = 3
"""Exit status of a rehearsal that ends in NO-GO."""


class DriveChoice(str, Enum):
    """Who is the drive."""

    simulated = "simulated"
    external = "external"


@reports_errors(kept="nothing was measured")
def rehearse(
    rig: Rig = None,
    duration: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            metavar="S",
            help="Shortest duration in s; whole periods of the experiment are played.",
        ),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Sample rate of all nodes.")
    ] = None,
    limits: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="ROS parameter file with limits: below /rig/rehearsal those of measured values, "
            "below /rig/controller those of the controller. docs/rehearsal.md lists them.",
        ),
    ] = None,
    fault: Annotated[
        str,
        typer.Option(
            metavar="KIND[:NAME=VALUE,...]",
            help="Fault to rehearse, such as loss:share=0.02; an unknown KIND prints the list.",
        ),
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the fault.")] = 1,
    drive: Annotated[
        DriveChoice,
        typer.Option(help="external: wait for somebody else's drive instead of simulating one."),
    ] = DriveChoice.simulated,
    hardware: Annotated[
        bool | None,
        typer.Option(
            "--hardware/--no-hardware",
            help="Required with --drive external: whether that drive moves a real joint.",
        ),
    ] = None,
    confirm: Annotated[
        str | None,
        typer.Option(metavar="JOINT", help="With --hardware: the joint that is going to move."),
    ] = None,
    network: Annotated[
        bool,
        typer.Option(
            "--network",
            help="Let discovery leave this machine: drives and controllers on the network join.",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="New folder; default: one below ./rehearsals."),
    ] = None,
    namespace: Namespace = RIG,
    settings: Set = None,
) -> None:
    """Rehearse an experiment in real time and end in GO or NO-GO, with reasons.

    Exit status: 0 GO, 3 NO-GO, 130 Ctrl-C, 2 bad input, 1 an error of fjr.
    """
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_bringup.campaign.settings import parse_settings
    from fjr_bringup.rehearsal.loop_progress import RehearsalProgress

    with needing_ros():
        from fjr_bringup.rehearsal.rehearse import rehearse as run
        from fjr_bringup.rehearsal.request import Options

    options = Options(
        rig=rig,
        out=out,
        duration_s=duration,
        rate_hz=rate,
        limits=limits,
        fault=fault,
        seed=seed,
        drive=drive.value,
        hardware=hardware,
        confirm=confirm,
        network=network,
        namespace=namespace,
        overrides=parse_settings(settings or []),
        command=command_line(),
    )
    with RehearsalProgress() as progress:
        found, report, interrupted = run(options, progress)
    for line in [found.headline, *(f"  {reason}" for reason in found.reasons)]:
        typer.echo(line)
    if found.advice:
        typer.echo("What to do:")
    for line in found.advice:
        typer.echo(f"  {line}")
    typer.echo(report)
    if interrupted:
        raise typer.Exit(INTERRUPTED)
    if not found.go:
        raise typer.Exit(NO_GO)
