"""What `fjr replay` does: it publishes a bag, or plays it into the graph."""

from __future__ import annotations

from pathlib import Path

import typer

from fjr_interface.errors import InputError

from ..guard import needing_ros
from .bag import the_bag
from .options import IntoGraph, Publishing


def replay_bag(bag: Path, graph: IntoGraph, publishing: Publishing) -> None:
    """Publish a bag, or play it into the graph; print what came of it.

    Raises:
        InputError: options that exclude each other, no ROS 2, or a bad bag, rig or folder.
        KeyboardInterrupt: Ctrl-C.
    """
    if graph.into is None:
        if graph != IntoGraph():
            raise InputError("--rig, --set and --out need --into; without it nothing is simulated.")
        _publish(bag, publishing)
        return
    if publishing != Publishing():
        raise InputError(
            "--rate, --topic, --start-offset, --loop and --wait-for are for publishing; --into "
            "plays the whole bag in lockstep."
        )
    from .plan import plan_replay

    plan = plan_replay(bag, graph.into, graph.rig, graph.settings)
    with needing_ros():
        from .graph import replay_into
    typer.echo(replay_into(plan, graph.out))


def _publish(bag: Path, publishing: Publishing) -> None:
    with needing_ros():
        from .player import publish_bag
    publish_bag(the_bag(bag), publishing)
