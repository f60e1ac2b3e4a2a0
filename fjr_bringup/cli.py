"""The `fjr` command.

Commands are thin: they import what they need only when called, so that `fjr --help` is quick, hand
over to a function of another module, and are guarded so that errors are one sentence.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from . import (
    blind_commands,
    by_hand_commands,
    diagnose_commands,
    paper_commands,
    plan_commands,
    run_commands,
    search_commands,
)
from .bridge import commands as bridge
from .guard import guarded
from .rehearsal import commands as rehearsal
from .replay import commands as replay

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Run, rehearse and analyze identification experiments on a flexible-joint rig.",
)


class MethodChoice(str, Enum):
    """How the BLA is estimated."""

    robust = "robust"
    fast = "fast"


MapOption = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="SIGNAL=TOPIC:FIELD[JOINT]",
        help="Where reference, torque or position stands in foreign bags, such as "
        "position=/joint_states:position[elbow]; reference=none if there is none. Repeatable.",
    ),
]
SamplesPerPeriod = Annotated[
    int | None,
    typer.Option(
        "--samples-per-period",
        "--period-samples",
        min=2,
        help="Samples of one period; found in the reference if not given.",
    ),
]
Resample = Annotated[
    str | None,
    typer.Option(
        metavar="auto|HZ",
        help="Bring bags with jittered stamps, clocks of their own or lost samples onto one even "
        "grid, at the rate of the reference or at HZ; the error is stated.",
    ),
]
Periods = Annotated[
    int | None, typer.Option(min=1, help="Periods to keep after the transient; default: all.")
]


@app.command()
@guarded(kept="nothing was written")
def analyze(
    folder: Annotated[Path, typer.Argument(help="Experiment folder with bags, or one bag.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; default: FOLDER/analysis.")
    ] = None,
    method: Annotated[
        MethodChoice,
        typer.Option(help="robust: over realizations; fast: one realization, by detection lines."),
    ] = MethodChoice.robust,
    signal_map: MapOption = None,
    nominal: Annotated[
        str | None,
        typer.Option(
            metavar="paper|none|FILE",
            help="Model to compare with: the paper's values, none, or a parameter file. Default: "
            "paper for bags that describe a campaign of this rig, else none.",
        ),
    ] = None,
    samples_per_period: SamplesPerPeriod = None,
    transient_periods: Annotated[
        int | None,
        typer.Option(min=0, help="Periods to discard; default: as described, or found."),
    ] = None,
    periods: Periods = None,
    resample: Resample = None,
) -> None:
    """Estimate BLA, noise and nonlinear distortion from bags, and write a report."""
    from bla_analyzer.plan import Override
    from fjr_interface.resampling import Resampling

    from .analyze import analyze_folder

    override = Override(samples_per_period, transient_periods, periods)
    resampling = Resampling.parse(resample) if resample else None
    report = analyze_folder(
        folder, out, method.value, signal_map or [], nominal, override, resampling
    )
    typer.echo(report)


@app.command("import")
@guarded(kept="nothing was written")
def import_records(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...", help="MAT, CSV or NPZ files, one realization each, level by level."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Experiment folder to make.")],
    column_map: Annotated[
        list[str],
        typer.Option(
            "--map",
            metavar="SIGNAL=[-]COLUMN[:UNIT]",
            help="Column of reference, torque and position, perhaps of link and time, separated by "
            "commas: position=theta:deg,torque=iq:0.25,time=t:ms. The unit may be a factor; a "
            "minus turns the sign.",
        ),
    ],
    sample_rate_hz: Annotated[
        float | None, typer.Option(help="Sample rate; needed without a time column.")
    ] = None,
    samples_per_period: SamplesPerPeriod = None,
    transient_periods: Annotated[
        int, typer.Option(min=0, help="Leading periods that are transient.")
    ] = 1,
    periods: Periods = None,
    skip_samples: Annotated[
        int, typer.Option(min=0, help="Samples to leave out at the beginning.")
    ] = 0,
    excited_harmonics: Annotated[
        str | None,
        typer.Option(
            metavar="FIRST:LAST:STEP,...",
            help="Excited lines as multiples of 1/period; found in the reference if not given.",
        ),
    ] = None,
    levels: Annotated[int, typer.Option(min=1, help="Amplitudes that the files hold.")] = 1,
) -> None:
    """Turn records of a rig without ROS into bags that every command reads."""
    from .import_map import parse_harmonics, parse_map
    from .importer import ImportOptions, import_files

    options = ImportOptions(
        columns=parse_map([part for spec in column_map for part in spec.split(",")]),
        sample_rate_hz=sample_rate_hz,
        samples_per_period=samples_per_period,
        transient_periods=transient_periods,
        periods=periods,
        skip_samples=skip_samples,
        excited_harmonics=tuple(parse_harmonics(excited_harmonics)) if excited_harmonics else None,
        levels=levels,
    )
    for experiment, bag in import_files(files, out, options):
        typer.echo(
            f"{bag.name}: {experiment.transient_periods} + {experiment.periods} periods of "
            f"{experiment.samples_per_period} samples at {experiment.sample_rate_hz:g} Hz, "
            f"{len(experiment.excited_harmonics)} excited lines from "
            f"{experiment.excited_harmonics[0] * experiment.base_frequency_hz:g} to "
            f"{experiment.excited_harmonics[-1] * experiment.base_frequency_hz:g} Hz"
        )
    typer.echo(out)


run_commands.add_to(app)
rehearsal.add_to(app)
search_commands.add_to(app)
plan_commands.add_to(app)
paper_commands.add_to(app)
blind_commands.add_to(app)
diagnose_commands.add_to(app)
bridge.add_to(app)
replay.add_to(app)
by_hand_commands.add_to(app)


def main() -> None:
    """Run the command line."""
    app(prog_name="fjr")
