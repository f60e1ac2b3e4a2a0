"""`fjr export`: the joint of a parameter file in another tool, and how far it is from the rig."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .cli_errors import reports_errors
from .record_options import MapSignals
from .result_options import effect_names, names_in, results_folder

if TYPE_CHECKING:
    from fjr_export.result import Export


class TargetChoice(str, Enum):
    """What the joint is exported to."""

    mjcf = "mjcf"
    urdf = "urdf"
    control = "control"
    simscape_m = "simscape-m"


@reports_errors(kept="nothing was written, and an earlier export in the folder is as it was")
def export(
    parameters: Annotated[
        Path,
        typer.Argument(
            metavar="PARAMETERS", help="updated.yaml of a diagnosis, or any rig parameter file."
        ),
    ],
    to: Annotated[
        TargetChoice,
        typer.Option(
            help="mjcf: MuJoCo; urdf: one rigid joint with its ros2_control tag; control: "
            "python-control, linear; simscape-m: Simscape component and MATLAB script.",
        ),
    ],
    out: Annotated[Path | None, results_folder("TARGET beside PARAMETERS")] = None,
    replay: Annotated[
        Path | None,
        typer.Option(
            metavar="DIAGNOSIS|BAGS",
            help="Play the held-out runs of these bags, or of those around a diagnosis, and state "
            "the error.",
        ),
    ] = None,
    without: Annotated[list[str] | None, effect_names("Effects to leave out.")] = None,
    linear: Annotated[
        bool,
        typer.Option(
            "--linear",
            help="The axis is linear: write a joint that slides, with m, N and kg. "
            "Bags of --replay say so themselves.",
        ),
    ] = False,
    signal_map: MapSignals = None,
) -> None:
    """Export the joint to a simulator or control tool, and replay recorded runs in it."""
    from fjr_export.exporting import RESULT_FILE
    from fjr_export.exporting import export as export_joint
    from fjr_interface.bags.signals import SignalMap
    from fjr_kit.folder_lock import locked_folder

    from .stage_progress import StageProgress

    place = out or parameters.parent / to.value
    sources = SignalMap.parse(signal_map or [])
    with locked_folder(place), StageProgress(transient=True) as progress:
        made = export_joint(
            parameters,
            to.value,  # type: ignore[arg-type]
            place,
            without=[name for name in names_in(without) or [] if name],
            linear=linear,
            replay=replay,
            signal_map=sources,
            progress=progress.describe,
        )
    _print(made)
    typer.echo(place / RESULT_FILE)
    typer.echo(place / made.file)


def _print(made: Export) -> None:
    for part in made.effects:
        typer.echo(f"{part.effect}: {part.kind.replace('_', ' ')} ({part.how})")
    for run in made.replays:
        loop = "recorded loop" if run.loop == "closed" else "recorded torque and an observer"
        typer.echo(
            f"{run.record}, {run.seconds:.0f} s, {loop}: {_percent(run.nrms_record)} from the "
            f"record (our simulation {_percent(run.simulation_nrms_record)}), "
            f"{_percent(run.nrms_simulation)} from our simulation"
        )
    for note in made.notes:
        typer.echo(f"Note: {note}")


def _percent(value: float | None) -> str:
    return "diverged" if value is None else f"{100.0 * value:.2g} %"
