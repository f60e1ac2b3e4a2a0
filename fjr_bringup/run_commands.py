"""`fjr run`, `fjr simulate` and `fjr demo`: their options; what they do is in `execute`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .guard import guarded

Rig = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE", help="ROS parameter file of rig and experiment; default: the paper's."
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        help="Experiment folder; one that holds a campaign already is resumed. Default: a new one "
        "below ./experiments.",
    ),
]
Levels = Annotated[
    list[float] | None,
    typer.Option("--level", metavar="A", help="Amplitude of each line in rad. Repeatable."),
]
Realizations = Annotated[int | None, typer.Option(help="Phase realizations of each level (M).")]
Periods = Annotated[int | None, typer.Option(help="Periods kept of each realization (P).")]
TransientPeriods = Annotated[int | None, typer.Option(help="Periods discarded before those.")]
Seed = Annotated[int | None, typer.Option(help="Seed of the grid and of all phases.")]
Set = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NODE.PARAMETER=VALUE",
        help="Any parameter of excitation, controller or simulator, such as simulator.k1=0.0. "
        "Repeatable.",
    ),
]
Composed = Annotated[
    bool, typer.Option("--composed", help="All nodes in one process instead of one each: faster.")
]


def _overrides(
    levels: list[float] | None,
    realizations: int | None,
    periods: int | None,
    transient_periods: int | None,
    seed: int | None,
    settings: list[str] | None,
) -> dict[str, dict[str, object]]:
    from .execute import overridden

    return overridden(
        settings,
        amplitudes_rad=tuple(levels) if levels else None,
        realizations=realizations,
        periods=periods,
        transient_periods=transient_periods,
        seed=seed,
    )


@guarded(kept="nothing was recorded")
def run(
    rig: Rig = None,
    out: Out = None,
    level: Levels = None,
    realizations: Realizations = None,
    periods: Periods = None,
    transient_periods: TransientPeriods = None,
    seed: Seed = None,
    settings: Set = None,
    composed: Composed = False,
) -> None:
    """Run a campaign through the ROS graph and record one bag per realization."""
    from .execute import run_in_graph

    overrides = _overrides(level, realizations, periods, transient_periods, seed, settings)
    typer.echo(run_in_graph(rig, out, overrides, composed=composed))


@guarded(kept="nothing was recorded")
def simulate(
    rig: Rig = None,
    out: Out = None,
    level: Levels = None,
    realizations: Realizations = None,
    periods: Periods = None,
    transient_periods: TransientPeriods = None,
    seed: Seed = None,
    settings: Set = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; default: one on each core.")
    ] = None,
) -> None:
    """Make the same campaign, with the same bags, without ROS and as fast as the machine can."""
    from .execute import simulate_in_batch

    overrides = _overrides(level, realizations, periods, transient_periods, seed, settings)
    typer.echo(simulate_in_batch(rig, out, overrides, workers=workers))


@guarded(kept="what was recorded is kept, and the same command goes on")
def demo(
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Experiment folder; kept and taken up again.")
    ] = Path("experiments/demo"),
) -> None:
    """Run the paper's experiment through the ROS graph, analyze it and write a report.

    Seven realizations at the paper's best amplitude, with a little encoder noise. Run again, it
    keeps the bags that are there and only analyzes them anew.
    """
    from .execute import run_demo

    typer.echo(run_demo(out))


def add_to(app: typer.Typer) -> None:
    """Add the commands to `fjr`."""
    for command in (run, simulate, demo):
        app.command()(command)
