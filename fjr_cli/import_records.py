"""`fjr import`: records of a rig without ROS become bags."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors
from .record_options import Periods, SamplesPerPeriod


@reports_errors(kept="nothing was written")
def import_records(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="MAT, CSV, text, NumPy, HDF5 or JSON files, one run each, level by level; text "
            "and JSON may be packed (.gz).",
        ),
    ],
    column_map: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="SIGNAL=[-]COLUMN[:UNIT]",
            help="Column of torque and position, perhaps of reference, link, known_torque (of "
            "gravity and other axes, by a robot model) and time (or torque_time, "
            "position_time, ... of signals with stamps of their own), separated by "
            "commas, by name or by number from 0: "
            "position=theta:deg,torque=iq:0.25,time=t:ms. The unit may be a factor or "
            "that of a speed; a minus turns the sign. Without it, what the first file "
            "holds is listed.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="New experiment folder; needed without --dry-run."),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show what is understood of the files; write nothing.")
    ] = False,
    controller: Annotated[
        list[Path] | None,
        typer.Option(
            help="File that describes the controller (YAML or JSON): one for all files, or one for "
            "each in their order. Gains may be unknown."
        ),
    ] = None,
    swings_free: Annotated[
        bool,
        typer.Option(
            "--swings-free",
            help="No torque acts, and none is mapped: a pendulum that is let go, a drive that is "
            "switched off.",
        ),
    ] = False,
    sample_rate_hz: Annotated[
        float | None,
        typer.Option(
            help="Sample rate; needed without a time column. With uneven stamps, the rate of the "
            "grid onto which the signals are brought."
        ),
    ] = None,
    samples_per_period: SamplesPerPeriod = None,
    transient_periods: Annotated[int, typer.Option(min=0, help="Leading periods to discard.")] = 1,
    periods: Periods = None,
    repeat_reference: Annotated[
        bool,
        typer.Option(
            "--repeat-reference", help="The reference column is one period, played repeatedly."
        ),
    ] = False,
    skip_samples: Annotated[
        int, typer.Option(min=0, help="Samples to leave out at the beginning.")
    ] = 0,
    keep_samples: Annotated[
        int | None, typer.Option(min=1, help="Samples to keep after those; default: all.")
    ] = None,
    excited_harmonics: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST:LAST:STEP,...",
            help="Excited lines as multiples of 1/period; found in the reference if not given.",
        ),
    ] = None,
    levels: Annotated[
        int, typer.Option(min=1, help="Number of amplitudes that the files hold, level by level.")
    ] = 1,
) -> None:
    """Turn records of a rig without ROS into bags that every command reads."""
    from fjr_kit.atomic import refuse_existing
    from fjr_kit.errors import InputError
    from fjr_records.importers.import_map import parse_harmonics, parse_map
    from fjr_records.importers.importer import read_files, write_bags
    from fjr_records.importers.record_file import ImportOptions

    from .import_summary import held_by, summary

    if column_map is None and out is not None:
        raise InputError(
            f"--map is missing: name the columns; `fjr import {files[0]}` lists what it holds."
        )
    if column_map is None:
        for line in held_by(files[0]):
            typer.echo(line)
        return
    if out is None and not dry_run:
        raise InputError("name the experiment folder with --out, or look first with --dry-run.")
    if out is not None:
        refuse_existing(out)
    options = ImportOptions(
        columns=parse_map(
            [part for spec in column_map for part in spec.split(",")],
            described=bool(controller),
            swings_free=swings_free,
        ),
        sample_rate_hz=sample_rate_hz,
        samples_per_period=samples_per_period,
        transient_periods=transient_periods,
        periods=periods,
        skip_samples=skip_samples,
        keep_samples=keep_samples,
        excited_harmonics=tuple(parse_harmonics(excited_harmonics)) if excited_harmonics else None,
        levels=levels,
        repeat_reference=repeat_reference,
        controllers=tuple(controller or ()),
        swings_free=swings_free,
    )
    understood = read_files(files, options)
    for line in summary(understood):
        typer.echo(line)
    for record in understood.records:
        for doubt in record.doubts:
            typer.echo(f"Warning: {record.path}: {doubt}.", err=True)
    if dry_run or out is None:
        typer.echo("Nothing was written. Next: the same command with --out FOLDER, no --dry-run.")
        return
    write_bags(understood, out)
    next_step = f"diagnose {out} --nominal DATASHEET" if swings_free else f"analyze {out}"
    typer.echo(f"Next: fjr {next_step}")
    typer.echo(out)
