"""`fjr paper`: every experiment of the paper, run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors
from .worker_options import Dask, Workers


@reports_errors(kept="what is finished is kept, and the same command goes on")
def paper(
    out: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER",
            help="Folder of report, figures and results; one that holds results is resumed.",
        ),
    ] = Path("experiments/paper"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer realizations: a first look within minutes.")
    ] = False,
    dask: Dask = None,
    workers: Workers = None,
) -> None:
    """Run every experiment of the paper again and set its statements beside what is measured."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_validation.paper.reproduction import run_paper

    typer.echo(run_paper(out, quick=quick, scheduler=dask, workers=workers))
