"""`fjr shape`: an excitation whose torque spectrum is flat."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from .campaign_options import Rig
from .cli_errors import reports_errors
from .option_groups import takes_groups
from .search_options import SearchOptions, tell


@reports_errors(kept="bags that were recorded are kept, and the same command goes on")
@takes_groups
def shape(
    *,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the results.")] = Path(
        "experiments/shaped"
    ),
    rig: Rig = None,
    level: Annotated[
        float | None,
        typer.Option(metavar="A", help="Amplitude of each line in the first pass, in rad."),
    ] = None,
    torque_rms: Annotated[
        float | None, typer.Option(help="Torque rms in N m; default: that of the first pass.")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="Distance of the torque spectrum from flat in dB, rms over lines.")
    ] = 0.5,
    damping: Annotated[
        float,
        typer.Option(
            min=0.05, max=1.0, help="Exponent of the step of an iteration; 1 is the paper's."
        ),
    ] = 0.8,
    iterations: Annotated[int, typer.Option(min=1, help="Greatest number of iterations.")] = 10,
    options: SearchOptions,
) -> None:
    """Shape the excitation until the torque spectrum is flat (algorithm 1 of the paper).

    Writes excitation.yaml, which `fjr run --rig` and `fjr simulate --rig` take, and a figure of the
    spectra before and after.
    """
    from fjr_kit.installed import require_report_extra

    require_report_extra()
    from excitation_node.shaping import ShapingGoal
    from fjr_bringup.design.shape import shape as shape_spectrum
    from fjr_bringup.design.shaping_output import write_shaping
    from fjr_kit.folder_lock import locked_folder

    campaign = options.campaign(rig, level)
    if options.dry_run:
        options.print_estimate(campaign, iterations + 1)
        return
    given: dict[str, Any] = {
        "tolerance_db": tolerance,
        "damping": damping,
        "torque_limit_nm": options.torque_limit,
        "position_limit_rad": options.position_limit,
    }
    with locked_folder(out):
        passes = shape_spectrum(
            campaign,
            options.bench(out),
            None if torque_rms is None else ShapingGoal(torque_rms),
            iterations=iterations,
            say=tell,
            **given,
        )
        typer.echo(write_shaping(passes, out))
