"""`fjr replay`: its options; what it does is in `replay`."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from ..guard import guarded

_PUBLISH, _INTO = "Publishing", "Into the graph"


class Into(str, Enum):
    """What the bag's signals are replayed into."""

    closed_loop = "closed-loop"
    plant = "plant"
    controller = "controller"


@guarded(kept="nothing is left of the replay")
def replay(
    bag: Annotated[Path, typer.Argument(help="Bag, or a folder with one bag.")],
    into: Annotated[
        Into | None,
        typer.Option(
            help="closed-loop: reference into controller and simulated plant; plant: torque into "
            "the simulated plant; controller: reference and position into the controller. All in "
            "lockstep, recorded and compared with the bag. Default: only publish the bag.",
            rich_help_panel=_INTO,
        ),
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            metavar="paper|FILE",
            help="Simulated rig: a ROS parameter file, or the paper's. Default: the campaign.yaml "
            "beside the bag.",
            rich_help_panel=_INTO,
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NODE.PARAMETER=VALUE",
            help="Any parameter of controller or simulator, such as controller.p=150.0. "
            "Repeatable.",
            rich_help_panel=_INTO,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Folder of replay.json and the recorded bag. Default: a folder replay beside the "
            "bag, and the recorded bag is not kept.",
            rich_help_panel=_INTO,
        ),
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option(
            metavar="FACTOR|max",
            help="Times real time, or as fast as the readers take it. Default: 1.",
            rich_help_panel=_PUBLISH,
        ),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(
            "--topic",
            metavar="TOPIC",
            help="Publish only this topic, beside the experiment description and /clock; its last "
            "words are enough: reference. Repeatable.",
            rich_help_panel=_PUBLISH,
        ),
    ] = None,
    start_offset_s: Annotated[
        float | None,
        typer.Option(
            "--start-offset",
            min=0.0,
            metavar="S",
            help="Begin so many seconds into the bag.",
            rich_help_panel=_PUBLISH,
        ),
    ] = None,
    loop: Annotated[
        bool,
        typer.Option(
            "--loop", help="Begin again at the end, until Ctrl-C.", rich_help_panel=_PUBLISH
        ),
    ] = False,
    wait_for: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NODE",
            help="Begin when this node reads one of the topics. Repeatable.",
            rich_help_panel=_PUBLISH,
        ),
    ] = None,
) -> None:
    """Publish a bag with its clock, or play it into controller and simulated plant."""
    from .options import IntoGraph, Publishing
    from .replay import replay_bag

    graph = IntoGraph(into.value if into else None, rig, tuple(settings or ()), out)
    replay_bag(bag, graph, Publishing.of(rate, topics, start_offset_s, loop, wait_for))


def add_to(app: typer.Typer) -> None:
    """Add the command to `fjr`."""
    app.command()(replay)
