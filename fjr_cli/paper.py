"""`fjr paper`: every experiment of the paper, run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .campaign_options import DryRun, duration, size
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
    dry_run: DryRun = False,
) -> None:
    """Run every experiment of the paper again and set its statements beside what is measured."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    if dry_run:
        _print_estimate(out, quick, workers)
        return
    from fjr_validation.paper.reproduction import run_paper

    typer.echo(run_paper(out, quick=quick, scheduler=dask, workers=workers))


def _print_estimate(out: Path, quick: bool, workers: int | None) -> None:
    from fjr_kit.worker_pool import worker_count
    from fjr_validation.paper.paper_cost import estimate
    from fjr_validation.paper.reproduction import CACHE
    from fjr_validation.paper.settings import FULL, QUICK

    found = estimate(QUICK if quick else FULL, out / CACHE)
    levels, pending = found.sweep
    typer.echo(f"Amplitude sweep (Fig. 4): {pending} of {levels} levels to measure.")
    if found.others is None:
        typer.echo("All other experiments: to do, once the sweep has found the best amplitude.")
    else:
        typer.echo(f"All other experiments: {found.others[1]} of {found.others[0]} tasks to do.")
    typer.echo(f"Disk: about {size(found.disk_bytes)} in {out} in all.")
    count = worker_count(workers, levels)
    typer.echo(
        f"Time: about {duration(found.processor_s)} of processor time, "
        f"{duration(found.processor_s / count)} with {count} processes, from four of the levels on "
        "this machine."
    )
