"""`fjr plan`: the quickest experiment that reaches a target error."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .cli_errors import reports_errors


@reports_errors(kept="nothing was written")
def plan(
    folder: Annotated[
        Path, typer.Argument(help="Pilot bags: a few realizations at one or several amplitudes.")
    ],
    target_db: Annotated[
        float,
        typer.Option(min=1e-3, help="Error of |G| in dB that 95 % of the lines keep at 95 %."),
    ],
    band: Annotated[tuple[float, float], typer.Option(metavar="LOW HIGH", help="Band in Hz.")] = (
        1.0,
        50.0,
    ),
    rig_time: Annotated[float, typer.Option(min=1.0, help="Time of the rig in s.")] = 3600.0,
    resolution: Annotated[
        float | None,
        typer.Option(help="Coarsest line spacing in Hz allowed; default: that of the pilot."),
    ] = None,
) -> None:
    """Say which M, P, amplitude and grid reach a target error, and what they cost."""
    from fjr_bringup.design.planner import propose, read_pilots

    found = propose(read_pilots(folder), target_db, band, rig_time, resolution_hz=resolution)
    typer.echo(
        f"amplitude of a line {found.amplitude_rad:.4g} rad, M {found.realizations}, P "
        f"{found.periods}, {found.transient_periods} discarded periods, line spacing "
        f"{found.base_frequency_hz:g} Hz: {found.time_s:.0f} s of rig time, error "
        f"{found.error_db:.3g} dB from {band[0]:g} to {band[1]:g} Hz."
    )
    if found.error_db > target_db:
        typer.echo(
            f"The target of {target_db:g} dB is out of reach within {rig_time:g} s; this is the "
            "best that fits."
        )
    typer.echo(
        f"fjr run --level {found.amplitude_rad:.5g} --realizations {found.realizations} --periods "
        f"{found.periods} --transient-periods {found.transient_periods} "
        f"--set excitation.base_frequency_hz={found.base_frequency_hz:g} "
        f"--set excitation.f_min_hz={found.base_frequency_hz:g}"
    )
