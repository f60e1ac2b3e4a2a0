"""`fjr fit`: a parametric model of the BLA."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from .analyze import MethodChoice
from .cli_errors import reports_errors
from .option_groups import takes_groups
from .record_options import MapSignals, PeriodOptions, Resample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bla_analyzer.results.result import Result
    from fjr_interface.resampling.accuracy import Resampling
    from fjr_kit.progress import ProgressLine
    from fjr_records.experiment_bag import Override


class ModelChoice(str, Enum):
    """What is fitted."""

    rational = "rational"
    rigid = "rigid"
    two_inertia = "two-inertia"
    extra_mode = "extra-mode"


class DomainChoice(str, Enum):
    """In which variable a rational model is."""

    s = "s"
    z = "z"


class HoldChoice(str, Enum):
    """What the torque does between samples."""

    zoh = "zoh"
    none = "none"


@reports_errors(kept="nothing was written, and an earlier fit in the folder is as it was")
@takes_groups
def fit(
    *,
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT_FOLDER_OR_BAGS",
            help="Folder of an analysis (or its result.json), or bags, which are analyzed first.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Folder of the fit; default: fit, in the given one."),
    ] = None,
    model: Annotated[
        ModelChoice,
        typer.Option(
            help="rational: transfer function; rigid: one inertia; two-inertia: motor, spring, "
            "link; extra-mode: a third mass on the link."
        ),
    ] = ModelChoice.rational,
    order: Annotated[
        str | None,
        typer.Option(
            metavar="NB/NA",
            help="Degrees of numerator and denominator, such as 2/4; default: searched.",
        ),
    ] = None,
    domain: Annotated[
        DomainChoice, typer.Option(help="s: continuous; z: discrete (rational models).")
    ] = DomainChoice.s,
    hold: Annotated[
        HoldChoice,
        typer.Option(
            help="zoh: the torque is held over each sample; none: it is known at all times, as a "
            "measured current is."
        ),
    ] = HoldChoice.zoh,
    delay: Annotated[
        str, typer.Option(metavar="free|SECONDS", help="Delay of the loop: fitted, or fixed.")
    ] = "0",
    level: Annotated[
        int | None, typer.Option(min=0, help="Number of the level to fit, from 0; default: all.")
    ] = None,
    link: Annotated[
        bool,
        typer.Option(
            "--link/--no-link",
            help="Fit the link position together with the motor's, where it was recorded.",
        ),
    ] = True,
    method: Annotated[
        MethodChoice | None,
        typer.Option(
            help="Method by which bags are analyzed, as in fjr analyze.", show_default=False
        ),
    ] = None,
    signal_map: MapSignals = None,
    periods: PeriodOptions,
    resample: Resample = None,
    write_report: Annotated[
        bool,
        typer.Option("--report/--no-report", help="Draw figures and write fit.html, or data only."),
    ] = True,
) -> None:
    """Fit a parametric model to the BLA: poles, zeros, inertias, stiffness, with 95 % intervals."""
    from fjr_interface.resampling.accuracy import Resampling
    from fjr_kit.errors import InputError
    from fjr_kit.installed import require_report_extra

    if write_report:
        require_report_extra()
    from rich.console import Console

    from bla_analyzer.fit.fit_output import write_fit
    from bla_analyzer.fit.fitting import fit_bla
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.invocation import call_date, command_line, provenance
    from fjr_kit.progress import ProgressLine

    from .fit_summary import print_fit

    orders, seconds = _order(order), _delay(delay)
    analyzed = _analyzed(source)
    if analyzed is not None and (method or signal_map or resample or periods != PeriodOptions()):
        raise InputError(
            f"{source}: is analyzed already; give the options on bags to fjr analyze, or name the "
            "bags."
        )
    folder = out or _default_out(source)
    with locked_folder(folder), ProgressLine(transient=True) as progress:
        result = analyzed or _analyze(
            source,
            method,
            signal_map or [],
            periods.override(),
            Resampling.parse(resample) if resample else None,
            progress,
        )
        found = fit_bla(
            result,
            model=model.value,
            order=orders,
            domain=domain.value,
            hold=hold.value,
            delay=seconds,
            level=level,
            link=link,
            progress=lambda what: progress.describe(f"fitting {what}"),
        )
        page = write_fit(
            found,
            folder,
            report=write_report,
            progress=lambda name: progress.describe(f"writing {name}"),
            provenance=provenance(command_line(), call_date()) if write_report else None,
        )
    print_fit(found, Console())
    typer.echo(page)


def _order(text: str | None) -> tuple[int, int] | None:
    """Return nb and na of an option such as 2/4."""
    from fjr_kit.errors import InputError

    if text is None:
        return None
    words = text.split("/")
    if len(words) != 2 or not all(word.strip().isdecimal() for word in words):
        raise InputError(
            f"--order {text} is not understood; write degrees of numerator and denominator, as 2/4."
        )
    return int(words[0]), int(words[1])


def _delay(text: str) -> float | Literal["free"]:
    from fjr_kit.errors import InputError

    if text == "free":
        return "free"
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not math.isfinite(seconds):
        raise InputError(f"--delay {text} is not understood; write free, or seconds such as 0.001.")
    return seconds


def _analyzed(source: Path) -> Result | None:
    """Return the result that a folder or file holds; None for bags."""
    from bla_analyzer.results.result import load_result

    if source.suffix == ".json":
        return load_result(source)
    file = source / "result.json"
    return load_result(file) if file.is_file() else None


def _default_out(source: Path) -> Path:
    from fjr_interface.bags.files import find_bags

    if source.suffix == ".json":
        return source.parent / "fit"
    if not (source / "result.json").is_file() and find_bags(source) == [source]:
        return source.with_name(f"{source.resolve().name}-fit")
    return source / "fit"


def _analyze(
    source: Path,
    method: MethodChoice | None,
    signal_map: Sequence[str],
    override: Override,
    resampling: Resampling | None,
    progress: ProgressLine,
) -> Result:
    from bla_analyzer.analysis import analyze
    from fjr_interface.bags.signals import SignalMap

    return analyze(
        source,
        method=method.value if method else None,
        signal_map=SignalMap.parse(signal_map),
        override=override,
        resampling=resampling,
        progress=lambda done, total, name: progress.count(done, total, f"read {name}"),
    )
