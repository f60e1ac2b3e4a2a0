"""`fjr plan`: its options and what it prints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .guard import guarded


@guarded(kept="nothing was written")
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
    from .measured import read_levels
    from .planner import pilot_of, propose

    usable = [level for level in read_levels(folder) if level.is_periodic]
    pilots = [pilot_of(level) for level in usable]
    if not pilots:
        from fjr_interface.errors import InputError

        raise InputError(f"{folder}: the response is periodic at no level; record lower ones.")
    found = propose(pilots, target_db, band, rig_time, resolution_hz=resolution)
    reaches = found.error_db <= target_db
    typer.echo(
        f"amplitude of a line {found.amplitude_rad:.4g} rad, M {found.realizations}, P "
        f"{found.periods}, {found.transient_periods} discarded periods, line spacing "
        f"{found.base_frequency_hz:g} Hz: {found.time_s:.0f} s of rig time, error "
        f"{found.error_db:.3g} dB from {band[0]:g} to {band[1]:g} Hz."
    )
    if not reaches:
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


def add_to(app: typer.Typer) -> None:
    """Add the command to `fjr`."""
    app.command()(plan)
