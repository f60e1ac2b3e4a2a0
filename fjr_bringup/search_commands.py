"""`fjr amplitude` and `fjr shape`: their options and what they print and write."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from .guard import guarded
from .run_commands import Realizations, Rig, Seed, Set

TorqueLimit = Annotated[
    float, typer.Option(min=0.0, help="Peak torque in N m that the rig may not exceed.")
]
PositionLimit = Annotated[
    float, typer.Option(min=0.0, help="Peak motor position in rad that the rig may not exceed.")
]
Graph = Annotated[
    bool, typer.Option("--graph", help="Measure on the ROS graph instead of in batch.")
]


def _campaign(rig: Path | None, settings: list[str] | None, **excitation: Any) -> Any:
    from .campaign import Campaign
    from .execute import overridden

    return Campaign.create(rig, overridden(settings, **excitation))


def _bench(graph: bool, out: Path) -> Any:
    from .bench import batch_bench, graph_bench

    return graph_bench(out) if graph else batch_bench


@guarded(kept="bags that were recorded are kept, and the same command goes on")
def amplitude(
    folder: Annotated[
        Path | None,
        typer.Argument(help="Bags of several levels, recorded on any rig; without it, measure."),
    ] = None,
    rig: Rig = None,
    out: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Where --graph keeps its bags.")
    ] = Path("experiments/amplitude"),
    lowest: Annotated[float, typer.Option(help="Lowest amplitude of a line in rad.")] = 1e-3,
    highest: Annotated[float, typer.Option(help="Highest amplitude of a line in rad.")] = 1e-1,
    torque_limit: TorqueLimit = math.inf,
    position_limit: PositionLimit = math.inf,
    realizations: Realizations = None,
    seed: Seed = None,
    settings: Set = None,
    graph: Graph = False,
) -> None:
    """Find the amplitude at which the BLA is nearest to the linear plant, from measured distortion.

    It measures upward until distortion rises again, or takes the levels that bags hold already, as
    those of a hardware rig.
    """
    from .amplitude import Limits, evaluate, search
    from .search_report import amplitude_sentences, bag_levels, within

    limits = Limits(torque_limit, position_limit)
    if folder is not None:
        levels = bag_levels(folder)
        usable = within(levels, limits)
        limited = len(usable) < len(levels)
        ended_by = "the torque or position limit" if limited else "the highest level of the bags"
        found = evaluate(usable, ended_by)
    else:
        campaign = _campaign(rig, settings, realizations=realizations, seed=seed)
        found = search(
            campaign,
            _bench(graph, out),
            lowest_rad=lowest,
            highest_rad=highest,
            limits=limits,
            say=lambda sentence: typer.echo(sentence, err=True),
        )
    for sentence in amplitude_sentences(found):
        typer.echo(sentence)


@guarded(kept="bags that were recorded are kept, and the same command goes on")
def shape(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the results.")] = Path(
        "experiments/shaped"
    ),
    rig: Rig = None,
    level: Annotated[
        float | None, typer.Option(metavar="A", help="Amplitude of each line of the first pass.")
    ] = None,
    torque_rms: Annotated[
        float | None, typer.Option(help="Torque rms in N m; default: that of the first pass.")
    ] = None,
    tolerance: Annotated[
        float, typer.Option(help="Distance of the torque spectrum from flat in dB, rms over lines.")
    ] = 0.5,
    damping: Annotated[
        float, typer.Option(min=0.05, max=1.0, help="Exponent of the step; 1 is the paper's.")
    ] = 0.8,
    iterations: Annotated[int, typer.Option(min=1, help="Most iterations.")] = 10,
    torque_limit: TorqueLimit = math.inf,
    position_limit: PositionLimit = math.inf,
    realizations: Realizations = None,
    seed: Seed = None,
    settings: Set = None,
    graph: Graph = False,
) -> None:
    """Shape the excitation until the torque spectrum is flat (algorithm 1 of the paper).

    Writes excitation.yaml, which `fjr run --rig` and `fjr simulate --rig` take, and a figure of the
    spectra before and after.
    """
    from excitation_node.shaping import ShapingGoal

    from .search_report import write_shaping
    from .shape import shape as shape_spectrum

    levels = None if level is None else (level,)
    campaign = _campaign(rig, settings, amplitudes_rad=levels, realizations=realizations, seed=seed)
    given: dict[str, Any] = {
        "tolerance_db": tolerance,
        "damping": damping,
        "torque_limit_nm": torque_limit,
        "position_limit_rad": position_limit,
    }
    passes = shape_spectrum(
        campaign,
        _bench(graph, out),
        None if torque_rms is None else ShapingGoal(torque_rms),
        iterations=iterations,
        say=lambda sentence: typer.echo(sentence, err=True),
        **given,
    )
    typer.echo(write_shaping(passes, out))


def add_to(app: typer.Typer) -> None:
    """Add the commands to `fjr`."""
    for command in (amplitude, shape):
        app.command()(command)
