"""`fjr replay`: a bag published with its clock, or played into controller and plant."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fjr_kit.errors import InputError, needing_ros

from .cli_errors import reports_errors
from .graph_options import RIG, Namespace

if TYPE_CHECKING:
    from fjr_bringup.replay.publishing import Publishing

_PUBLISH, _INTO = "Publishing", "Into the graph"


class Into(str, Enum):
    """What the bag's signals are replayed into."""

    closed_loop = "closed-loop"
    plant = "plant"
    controller = "controller"


@reports_errors(kept="nothing is left of the replay")
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
            help="Multiple of real time, or max: as fast as the readers take it. Default: 1.",
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
    follow_clock: Annotated[
        bool,
        typer.Option(
            "--follow-clock",
            help="Let another program's /clock keep the time, and publish none.",
            rich_help_panel=_PUBLISH,
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
    namespace: Namespace = RIG,
) -> None:
    """Publish a bag with its clock, or play it into controller and simulated plant.

    With --into the nodes have a ROS domain of their own, and --namespace changes nothing.
    """
    publishing = (rate, topics, start_offset_s, loop or None, follow_clock or None, wait_for)
    if into is None:
        if any(option is not None for option in (rig, settings, out)):
            raise InputError("--rig, --set and --out need --into; without it nothing is simulated.")
        from fjr_bringup.replay.publishing import Publishing

        if follow_clock and rate == "max":
            raise InputError("--rate max does not go with --follow-clock: the clock has its speed.")
        how = Publishing(
            _factor("1" if rate is None else rate),
            tuple(topics or ()),
            start_offset_s or 0.0,
            loop,
            tuple(wait_for or ()),
            follow_clock,
            namespace,
        )
        _publish(bag, how)
        return
    if any(option is not None for option in publishing):
        raise InputError(
            "--rate, --topic, --start-offset, --loop, --follow-clock and --wait-for are for "
            "publishing; --into plays the whole bag in lockstep."
        )
    from fjr_bringup.replay.lockstep_plan import plan_replay

    plan = plan_replay(bag, into.value, rig, settings or ())
    with needing_ros():
        from fjr_bringup.replay.lockstep import replay_into

    from .replay_summary import print_differences

    path, differences = replay_into(plan, out)
    print_differences(differences)
    typer.echo(path)


def _publish(bag: Path, publishing: Publishing) -> None:
    from fjr_bringup.replay.bag import the_bag

    from .replay_summary import print_published

    with needing_ros():
        from fjr_bringup.replay.player import publish_bag
    publish_bag(the_bag(bag), publishing, print_published)


def _factor(text: str) -> float:
    """Return the times of real time that a text asks for; `max` is infinite."""
    if text == "max":
        return math.inf
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 0.0 < factor < math.inf:
        raise InputError(f"--rate {text}: give a factor greater than zero, or max.")
    return factor
