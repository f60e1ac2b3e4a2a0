"""`fjr paper`: its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .guard import guarded


@guarded(kept="what is finished is kept, and the same command goes on")
def paper(
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder of report, figures and results.")
    ] = Path("experiments/paper"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer realizations: a first look within minutes.")
    ] = False,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Run on the workers of this Dask scheduler, such as tcp://host:8786; they need "
            "this package installed.",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; default: one on each core.")
    ] = None,
) -> None:
    """Run every experiment of the paper again and set its statements beside what is measured."""
    from .paper.run import run_paper

    typer.echo(run_paper(out, quick=quick, scheduler=dask, workers=workers))


def add_to(app: typer.Typer) -> None:
    """Add the command to `fjr`."""
    app.command()(paper)
