"""`fjr blind run` and `fjr blind score`: the diagnosis put to cases whose answers are sealed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fjr_interface.errors import InputError

from .guard import guarded

blind = typer.Typer(
    no_args_is_help=True,
    help="Check the diagnosis on withheld cases made by a second, independent plant.",
)


@blind.command()
@guarded(kept="finished cases and verdicts are kept, and the same command goes on")
def run(
    cases: Annotated[int, typer.Option(min=1, max=1000, help="Number of cases.")] = 120,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Seed of the cases; default: one that nobody knows before the end."
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder of the check; taken up if it is there.")
    ] = Path("blind"),
    method: Annotated[
        list[str] | None,
        typer.Option(help="fjr, refit, bic or sparse; default: all. Repeatable."),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Dask scheduler whose workers see the same folder; default: all cores here.",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes here; default: one on each core.")
    ] = None,
    count_failures: Annotated[
        bool,
        typer.Option(help="Score even if a method failed on a case: that is a miss of it."),
    ] = False,
) -> None:
    """Make sealed cases, diagnose them, commit to the verdicts, unseal and score."""
    from gap_diagnosis.blind.methods import METHODS
    from gap_diagnosis.blind.report import score_check
    from gap_diagnosis.blind.run import BlindCheck

    check = BlindCheck.begin(out, cases, seed, method or tuple(METHODS))
    check.make_cases(_say)
    check.diagnose(dask, workers, _say)
    failures = check.failures()
    for sentence in failures:
        typer.echo(sentence, err=True)
    if failures and not (count_failures or check.unsealed):
        raise InputError(
            f"{len(failures)} diagnoses failed, so the answers stay sealed; run again to try those "
            "again, or with --count-failures to score them as misses."
        )
    typer.echo(score_check(check))


@blind.command()
@guarded(kept="the answers are as they were")
def score(
    out: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a finished check.")],
) -> None:
    """Score a check whose verdicts are all there, and write its report again."""
    from gap_diagnosis.blind.report import score_check
    from gap_diagnosis.blind.run import BlindCheck

    typer.echo(score_check(BlindCheck.open(out)))


def _say(done: int, total: int, what: str) -> None:
    typer.echo(f"{done}/{total} {what}", err=True)


def add_to(app: typer.Typer) -> None:
    """Add the commands to `fjr`."""
    app.add_typer(blind, name="blind")
