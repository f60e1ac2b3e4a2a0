"""`fjr analyze`: from bags to the BLA and its report."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .cli_errors import reports_errors
from .option_groups import takes_groups
from .record_options import MapSignals, PeriodOptions, Resample
from .result_options import results_folder

if TYPE_CHECKING:
    from fjr_interface.resampling.accuracy import Resampling
    from fjr_records.experiment_bag import Override


class MethodChoice(str, Enum):
    """How the BLA is estimated."""

    robust = "robust"
    fast = "fast"
    local = "local"


@reports_errors(kept="nothing was written")
@takes_groups
def analyze(
    *,
    folder: Annotated[Path, typer.Argument(help="Experiment folder with bags, or one bag.")],
    out: Annotated[Path | None, results_folder("FOLDER/analysis")] = None,
    method: Annotated[
        MethodChoice | None,
        typer.Option(
            help="robust: over realizations; fast: one realization, by detection lines; local: "
            "local polynomials, any excitation. Default: what the excitation allows.",
            show_default=False,
        ),
    ] = None,
    signal_map: MapSignals = None,
    nominal: Annotated[
        str | None,
        typer.Option(
            metavar="paper|none|FILE",
            help="Model to compare with: the paper's values, none, or a parameter file. Default: "
            "paper for bags that describe a campaign of this rig, else none.",
        ),
    ] = None,
    periods: PeriodOptions,
    resample: Resample = None,
    write_report: Annotated[
        bool,
        typer.Option(
            "--report/--no-report", help="Draw figures and write report.html, or only the data."
        ),
    ] = True,
) -> None:
    """Estimate BLA, noise and nonlinear distortion from bags of any excitation."""
    from fjr_interface.resampling.accuracy import Resampling

    resampling = Resampling.parse(resample) if resample else None
    report = analyze_folder(
        folder,
        out,
        method,
        signal_map or [],
        nominal,
        periods.override(),
        resampling,
        write_report=write_report,
    )
    typer.echo(report)


def analyze_folder(
    folder: Path,
    out: Path | None = None,
    method: MethodChoice | None = None,
    signal_map: Sequence[str] = (),
    nominal: str | None = None,
    override: Override | None = None,
    resampling: Resampling | None = None,
    *,
    write_report: bool = True,
) -> Path:
    """Analyze bags, write the results and print a summary.

    Args:
        folder: experiment folder or bag.
        out: folder of the results; None for `analysis` in the experiment folder.
        method: robust, fast or local; None for what the excitation allows.
        signal_map: `signal=/topic:field[joint]` each.
        nominal: as `reference_models` takes it.
        override: what to take instead of the description.
        resampling: how to bring unevenly sampled bags onto an even grid.
        write_report: whether to draw figures and write report.html, beside the data.

    Returns:
        The path of report.html, or of result.json without a report.

    Raises:
        InputError: bad bags or options, or a folder that cannot be written.
    """
    from fjr_kit.installed import require_report_extra

    if write_report:
        require_report_extra()
    from rich.console import Console

    from bla_analyzer.analysis import analyze
    from bla_analyzer.compare.reference_models import reference_models
    from bla_analyzer.output import write_result
    from fjr_interface.bags.files import find_bags
    from fjr_interface.bags.reader import BagReader
    from fjr_interface.bags.signals import SignalMap
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.invocation import call_date, command_line
    from fjr_kit.progress import ProgressLine

    from .analysis_summary import print_summary

    sources = SignalMap.parse(signal_map)
    bags = find_bags(folder)
    if out is None:
        is_bag = bags == [folder]
        out = (
            folder.with_name(f"{folder.resolve().name}-analysis") if is_bag else folder / "analysis"
        )
    models = reference_models(nominal, BagReader(bags[0], sources).experiment)
    with locked_folder(out), ProgressLine(total=len(bags), transient=True) as progress:
        progress.describe("reading bags")
        result = analyze(
            folder,
            method=method.value if method else None,
            signal_map=sources,
            models=models,
            override=override,
            resampling=resampling,
            progress=lambda done, total, name: progress.count(done, total, f"read {name}"),
        )
        report = write_result(
            result,
            out,
            figures=write_report,
            report=write_report,
            progress=lambda name: progress.describe(f"writing {name}"),
            command=command_line(),
            date=call_date(),
        )
    print_summary(result, Console())
    return report
