"""`fjr amplitude`: the amplitude at which the BLA is nearest to the linear plant."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .campaign_options import Rig
from .cli_errors import reports_errors
from .option_groups import takes_groups
from .search_options import SearchOptions, tell

if TYPE_CHECKING:
    from fjr_bringup.design.amplitude import Search


@reports_errors(kept="bags that were recorded are kept, and the same command goes on")
@takes_groups
def amplitude(
    *,
    folder: Annotated[
        Path | None,
        typer.Argument(help="Bags of several levels, recorded on any rig; without it, measure."),
    ] = None,
    rig: Rig = None,
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Folder of the bags that --graph records.")
    ] = Path("experiments/amplitude"),
    lowest: Annotated[float, typer.Option(help="Lowest amplitude of a line in rad.")] = 1e-3,
    highest: Annotated[float, typer.Option(help="Highest amplitude of a line in rad.")] = 1e-1,
    options: SearchOptions,
) -> None:
    """Find the amplitude at which the BLA is nearest to the linear plant, from measured distortion.

    It measures upward until distortion rises again, or takes the levels that bags hold already, as
    those of a hardware rig.
    """
    from fjr_bringup.design.amplitude import (
        Limits,
        bag_levels,
        evaluate,
        most_levels,
        search,
        within,
    )
    from fjr_kit.folder_lock import locked_folder

    limits = Limits(options.torque_limit, options.position_limit)
    if folder is not None:
        levels = bag_levels(folder)
        usable = within(levels, limits)
        limited = len(usable) < len(levels)
        ended_by = "the torque or position limit" if limited else "the highest level of the bags"
        found = evaluate(usable, ended_by)
    else:
        campaign = options.campaign(rig)
        if options.dry_run:
            options.print_estimate(campaign, most_levels(lowest, highest))
            return
        with locked_folder(out) if options.graph else nullcontext():
            found = search(
                campaign,
                options.bench(out),
                lowest_rad=lowest,
                highest_rad=highest,
                limits=limits,
                say=tell,
            )
    for sentence in _sentences(found):
        typer.echo(sentence)


def _sentences(found: Search) -> Iterator[str]:
    """Return what a search found, line by line; the last one is the answer."""
    yield "amplitude (rad)  relative distortion"
    for amplitude, value in zip(found.amplitudes_rad, found.values, strict=True):
        yield f"{amplitude:15.4g}  {value:.4g}"
    for name, other in found.others_rad.items():
        if math.isfinite(other):
            yield f"By {name}: {other:.3g} rad."
    yield f"The measurement ended at {found.ended_by}."
    low, high = found.interval_rad
    answer = f"Best amplitude of a line: {found.best_rad:.3g} rad (95 %: {low:.3g} to {high:.3g})."
    if not found.bracketed:
        side = "falling" if found.values.argmin() > 0 else "rising"
        answer += f" Distortion is still {side} there: the true optimum lies beyond."
    yield answer
