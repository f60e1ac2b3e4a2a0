"""`fjr compare`: campaigns or diagnoses side by side, and what changed beyond chance."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors

CHANGED = 3
"""Exit status of a comparison that finds a change, with --fail-on-change."""


@reports_errors(kept="nothing was written, and an earlier comparison in the folder is as it was")
def compare(
    places: Annotated[
        list[Path],
        typer.Argument(
            metavar="FIRST OTHER...",
            help="Campaigns (folders of bags or of an analysis) or diagnoses; each further one is "
            "held against the first.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write compare.json and compare.html there."),
    ] = None,
    false_alarm: Annotated[
        float,
        typer.Option(
            min=1e-6,
            max=0.5,
            help="Probability that a comparison reports a change where there is none.",
        ),
    ] = 0.05,
    fail_on_change: Annotated[
        bool,
        typer.Option("--fail-on-change", help=f"End with status {CHANGED} if anything changed."),
    ] = False,
    write_report: Annotated[
        bool,
        typer.Option("--report/--no-report", help="Write compare.html too, or only the data."),
    ] = True,
) -> None:
    """Tell what changed between campaigns or diagnoses, beyond chance.

    Exit status: 0; 3 if something changed and --fail-on-change is given; 2 bad input; 1 an error
    of fjr.
    """
    from contextlib import nullcontext

    from fjr_kit.installed import require_report_extra

    if out is not None and write_report:
        require_report_extra()
    from rich.console import Console

    from fjr_compare.comparing import compare as compared
    from fjr_compare.output import write_comparison
    from fjr_compare.words import judged
    from fjr_kit.errors import InputError
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.invocation import call_date, command_line

    from .compare_summary import print_comparison
    from .stage_progress import StageProgress

    with nullcontext() if out is None else locked_folder(out):
        with StageProgress(transient=True) as progress:
            found = compared(places, false_alarm=false_alarm, progress=progress.describe)
        report = None
        if out is not None:
            report = write_comparison(
                found, out, report=write_report, command=command_line(), date=call_date()
            )
    print_comparison(found, Console())
    if report is not None:
        typer.echo(report)
    if fail_on_change and found.changed:
        raise typer.Exit(CHANGED)
    if fail_on_change and not judged(found):
        raise InputError(
            "--fail-on-change has nothing to go by: neither a BLA nor a parameter could be judged."
        )
