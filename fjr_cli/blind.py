"""`fjr blind run` and `fjr blind score`: the diagnosis put to cases whose answers are sealed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fjr_kit.errors import InputError

from .cli_errors import reports_errors
from .worker_options import Dask, Workers

blind = typer.Typer(
    no_args_is_help=True,
    help="Check the diagnosis on withheld cases made by a second, independent plant.",
)


@blind.command()
@reports_errors(kept="finished cases and verdicts are kept, and the same command goes on")
def run(
    cases: Annotated[int, typer.Option(min=1, max=1000, help="Number of cases.")] = 120,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0, help="Seed of the cases; default: one that nobody knows before the end."
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(
            metavar="FOLDER", help="Folder of the check; one that holds a check is resumed."
        ),
    ] = Path("blind"),
    method: Annotated[
        list[str] | None,
        typer.Option(help="fjr, refit, bic or sparse; default: all. Repeatable."),
    ] = None,
    dask: Dask = None,
    workers: Workers = None,
    count_failures: Annotated[
        bool,
        typer.Option(help="Score even if a method failed on a case: that is a miss of it."),
    ] = False,
) -> None:
    """Make sealed cases, diagnose them, commit to the verdicts, unseal and score."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.progress import ProgressLine
    from fjr_validation.blind.check import BlindCheck
    from fjr_validation.blind.methods import METHODS
    from fjr_validation.blind.report import rehearse_report, score_check

    with locked_folder(out), ProgressLine() as progress:
        check = BlindCheck.begin(out, cases, seed, method or tuple(METHODS))
        check.check_seals()
        rehearse_report(check)
        check.make_cases(progress.report)
        check.diagnose(dask, workers, progress.report)
        failures = check.failures()
        for sentence in failures:
            progress.say(sentence)
        if failures and not (count_failures or check.unsealed):
            raise InputError(
                f"{len(failures)} diagnoses failed, so the answers stay sealed; run again to try "
                "those again, or with --count-failures to score them as misses."
            )
        report = score_check(check)
    typer.echo(report)


@blind.command()
@reports_errors(kept="the answers are as they were")
def score(
    out: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of a finished check.")],
) -> None:
    """Score a check whose verdicts are all there, and write its report again."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_kit.folder_lock import locked_folder
    from fjr_validation.blind.check import BlindCheck
    from fjr_validation.blind.report import score_check

    check = BlindCheck.open(out)
    with locked_folder(out):
        typer.echo(score_check(check))
