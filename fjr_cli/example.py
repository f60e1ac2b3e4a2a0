"""`fjr example`: files to try every import and every --map of the documents on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors

TO_TRY = (
    "fjr check recorded",
    "fjr analyze recorded --map torque=/joint_states:effort[elbow] "
    "--map position=/joint_states:position[elbow] --map reference=/command:position",
    "fjr import log.mat --out imported --sample-rate-hz 2500 "
    "--map reference=r,torque=iq:0.25,position=theta:deg",
    "fjr import run1.csv run2.csv --out rig "
    "--map reference=cmd:deg,torque=iq:0.25,position=enc:deg,time=t:ms",
    "fjr simulate --out chirp --record chirp --controller cascade.yaml",
)
"""Commands for the files, to be given in their folder."""


@reports_errors(kept="nothing was written")
def example(
    folder: Annotated[Path, typer.Argument(help="Folder to write, a new one.")],
) -> None:
    """Write a foreign bag, a MATLAB and two CSV logs, a rig and a controller file to try things on.

    They are of a simulated rig with backlash, as other recorders would have kept them: currents in
    A, angles in degrees, one joint of two, stamps since the epoch. The commands to try are printed.
    """
    from fjr_bringup.campaign.example_files import write_example

    write_example(folder)
    typer.echo(f"cd {folder}")
    for line in TO_TRY:
        typer.echo(line)
