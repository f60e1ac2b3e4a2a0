"""What `fjr replay` does: it publishes a bag, or plays it into the graph."""

from __future__ import annotations

from pathlib import Path

import typer

from fjr_interface.errors import InputError

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
    try:
        from .graph import replay_into
    except ImportError as error:
        raise _no_ros(error) from None
    typer.echo(replay_into(plan, graph.out))


def _publish(bag: Path, publishing: Publishing) -> None:
    try:
        from .player import publish_bag
    except ImportError as error:
        raise _no_ros(error) from None
    publish_bag(the_bag(bag), publishing)


def _no_ros(error: ImportError) -> InputError:
    return InputError(f"ROS 2 is not there ({error}); install fjr-rig[ros] or source ROS 2 Jazzy.")
