"""`fjr blind run` and `fjr blind score`: the diagnosis put to cases whose answers are sealed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from .campaign_options import DryRun, duration, size
from .cli_errors import reports_errors
from .worker_options import Dask, Workers

blind = typer.Typer(
    no_args_is_help=True,
    help="Check the diagnosis on withheld cases made by a second, independent plant.",
)


class WorldName(str, Enum):
    """Worlds of cases."""

    closed = "closed"
    open = "open"
    records = "records"


@blind.command()
@reports_errors(kept="finished cases are kept, and the same command goes on")
def run(
    cases: Annotated[
        int, typer.Option(min=1, max=10_000, help="Number of cases, split among the worlds.")
    ] = 120,
    world: Annotated[
        list[WorldName] | None,
        typer.Option(
            help="closed (only effects of the catalogue), open (with a remainder), records "
            "(not periodic); default: all. Repeatable."
        ),
    ] = None,
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
        typer.Option(
            help="fjr, refit, bic, sparse, bam, pace or mujoco; default: fjr. Repeatable. The last "
            "three need the extra rivals."
        ),
    ] = None,
    dask: Dask = None,
    workers: Workers = None,
    keep_bags: Annotated[
        bool, typer.Option(help="Keep the bags of finished cases (2 to 50 MB each).")
    ] = False,
    dry_run: DryRun = False,
) -> None:
    """Make cases with sealed answers, diagnose them, commit to the verdicts, unseal, score."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.progress import ProgressLine
    from fjr_validation.blind.answers import WORLDS
    from fjr_validation.blind.check import BlindCheck, split
    from fjr_validation.blind.methods import OURS
    from fjr_validation.blind.report import rehearse_report, score_check

    worlds = [each for each in WORLDS if not world or WorldName(each) in world]
    if dry_run:
        _print_estimate(out, split(cases, worlds), seed, method or (OURS,), workers, keep_bags)
        return
    with locked_folder(out), ProgressLine() as progress:
        check = BlindCheck.begin(out, split(cases, worlds), seed, method or (OURS,))
        check.check_seals()
        rehearse_report(check)
        check.run(dask, workers, progress.report, keep_bags=keep_bags)
        report = score_check(check)
    typer.echo(report)


def _print_estimate(
    out: Path,
    cases: Mapping[str, int],
    seed: int | None,
    methods: Sequence[str],
    workers: int | None,
    keep_bags: bool,
) -> None:
    from fjr_kit.worker_pool import worker_count
    from fjr_validation.blind.check_cost import CASE_BYTES, estimate

    found = estimate(out, cases, seed, methods)
    worlds = ", ".join(f"{count} {world}" for world, count in cases.items())
    typer.echo(f"{found.cases} cases ({worlds}) by {', '.join(methods)}; {found.missing} to do.")
    count = worker_count(workers, max(found.missing, 1))
    kept = found.cases if keep_bags else min(2 * count, found.missing)
    why = "which are kept" if keep_bags else "of cases under way"
    typer.echo(f"Disk: about {size(kept * CASE_BYTES)} of bags, {why}.")
    source = "its own verdicts" if found.measured else "training cases; your machine may differ"
    typer.echo(
        f"Time: about {duration(found.processor_s)} of processor time, "
        f"{duration(found.processor_s / count)} with {count} processes, from {source}."
    )


@blind.command()
@reports_errors(kept="the answers are as they were")
def score(
    folders: Annotated[
        list[Path],
        typer.Argument(metavar="FOLDER...", help="Folder of a check, or several of one report."),
    ],
    unfinished: Annotated[
        bool,
        typer.Option(
            help="End a check although some of its cases have no verdict, and score the rest."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Where the report of several checks goes."),
    ] = None,
) -> None:
    """Unseal and score a check whose verdicts are all there, or write its report again.

    Of several folders, whose checks have been scored, one report is made.
    """
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from fjr_kit.errors import InputError
    from fjr_kit.folder_lock import locked_folder
    from fjr_validation.blind.check import BlindCheck
    from fjr_validation.blind.report import score_check, score_together

    checks = [BlindCheck.open(folder) for folder in folders]
    if len(checks) > 1 and unfinished:
        raise InputError("--unfinished ends one check; give each folder by itself first.")
    if (out is not None) != (len(checks) > 1):
        raise InputError(
            "--out is where the report of several checks goes, and only theirs: a single check has "
            "its own in its folder; give --out with two folders or more."
        )
    if out is not None:
        with locked_folder(out):
            typer.echo(score_together(checks, out))
        return
    with locked_folder(folders[0]):
        typer.echo(score_check(checks[0], unfinished=unfinished))
