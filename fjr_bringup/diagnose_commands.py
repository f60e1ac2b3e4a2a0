"""`fjr diagnose`: its options; what it does is in `diagnose`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .guard import guarded


@guarded(kept="nothing was written, and an earlier diagnosis in the folder is as it was")
def diagnose(
    folder: Annotated[
        Path, typer.Argument(metavar="REAL_FOLDER", help="Experiment folder with the rig's bags.")
    ],
    nominal: Annotated[
        str,
        typer.Option(
            metavar="paper|FILE",
            help="Datasheet of the bare plant: a ROS parameter file with all values below "
            "/rig/simulator, or paper for the paper's values.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; default: REAL_FOLDER/diagnosis.")
    ] = None,
    tolerance: Annotated[
        float,
        typer.Option(min=0.001, max=0.5, help="How far a datasheet value may be off, relative."),
    ] = 0.1,
    signal_map: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="SIGNAL=TOPIC:FIELD[JOINT]",
            help="Where reference, torque or position stands in foreign bags, as for analyze. "
            "Repeatable.",
        ),
    ] = None,
    resample: Annotated[
        str | None,
        typer.Option(
            metavar="auto|HZ", help="Bring unevenly sampled bags onto one even grid, as analyze."
        ),
    ] = None,
) -> None:
    """Tell why rig and simulation differ: where, by which effect, how far it closes the gap."""
    from fjr_interface.resampling import Resampling

    from .diagnose import diagnose_folder

    resampling = Resampling.parse(resample) if resample else None
    typer.echo(diagnose_folder(folder, nominal, out, tolerance, signal_map or [], resampling))


def add_to(app: typer.Typer) -> None:
    """Add the command to `fjr`."""
    app.command()(diagnose)
