"""`fjr diagnose`: from bags and a nominal model to the causes of the gap and its report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors
from .option_groups import takes_groups
from .record_options import MapSignals, PeriodOptions, Resample
from .result_options import datasheet_tolerance, effect_names, names_in, results_folder


@reports_errors(kept="nothing was written, and an earlier diagnosis in the folder is as it was")
@takes_groups
def diagnose(
    *,
    folder: Annotated[
        Path, typer.Argument(metavar="REAL_FOLDER", help="Experiment folder with the rig's bags.")
    ],
    nominal: Annotated[
        str,
        typer.Option(
            metavar="paper|FILE",
            help="Datasheet of the bare plant: a YAML file of its values, by themselves or below "
            "/rig/simulator as in a ROS parameter file, or paper for the paper's values.",
        ),
    ],
    out: Annotated[Path | None, results_folder("REAL_FOLDER/diagnosis")] = None,
    tolerance: Annotated[float, datasheet_tolerance()] = 0.1,
    effects: Annotated[
        list[str] | None, effect_names("Look for these effects only; default: the catalogue.")
    ] = None,
    budget: Annotated[
        float | None,
        typer.Option(
            min=1.0,
            metavar="SECONDS",
            help="About how long the diagnosis may take; what is found by then is judged.",
        ),
    ] = None,
    as_record: Annotated[
        bool,
        typer.Option(
            "--as-record",
            help="Treat a periodic experiment as records: from its first sample to its last.",
        ),
    ] = False,
    signal_map: MapSignals = None,
    resample: Resample = None,
    periods: PeriodOptions,
) -> None:
    """Tell why rig and simulation differ: where, by which effects, how far they close the gap."""
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from rich.console import Console

    from fjr_interface.bags.files import find_bags
    from fjr_interface.bags.signals import SignalMap
    from fjr_interface.resampling.accuracy import Resampling
    from fjr_kit.folder_lock import locked_folder
    from fjr_kit.invocation import call_date, command_line
    from fjr_records.periodic import RecordedExperiment
    from gap_diagnosis.any_record import investigate, read_any
    from gap_diagnosis.model.nominal import read_nominal, refuse_wrong_units
    from gap_diagnosis.report.gap_output import write_diagnosis
    from gap_diagnosis.report.updated_parameters import has_known_law

    from .diagnosis_summary import print_summary
    from .stage_progress import StageProgress

    resampling = Resampling.parse(resample) if resample else None
    values = read_nominal(nominal)
    sources = SignalMap.parse(signal_map or [])
    place = out or folder / "diagnosis"
    find_bags(folder)
    with locked_folder(place), StageProgress(transient=True) as progress:
        progress.describe("reading bags")
        recorded = read_any(
            folder, sources, override=periods.override(), resampling=resampling, as_record=as_record
        )
        if isinstance(recorded, RecordedExperiment):
            warning = refuse_wrong_units(recorded, values, nominal)
            if warning:
                progress.say(f"Warning: {warning}")
        found = investigate(
            recorded,
            values,
            tolerance=tolerance,
            effects=names_in(effects),
            budget_s=math.inf if budget is None else budget,
            progress=progress.describe,
        )
        report = write_diagnosis(
            found,
            place,
            progress=progress.describe,
            command=command_line(),
            date=call_date(),
        )
    runs = has_known_law(recorded)
    print_summary(found.diagnosis, Console(), report.parent, runs=runs)
    typer.echo(report)
