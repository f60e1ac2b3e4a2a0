"""`fjr pause`, `play`, `step`, `reset`, `speed`, `stop`, `status`, `estop`: a rig run by hand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from fjr_kit.errors import InputError, needing_ros

from .cli_errors import reports_errors
from .graph_options import RIG, Namespace

if TYPE_CHECKING:
    from fjr_bringup.graph.by_hand import Rig

_KEPT = "the rig does what it did"


def _rig(namespace: str) -> Rig:
    with needing_ros():
        from fjr_bringup.graph.by_hand import Rig
    return Rig(namespace)


def _trigger(service: str, namespace: str) -> None:
    with _rig(namespace) as rig:
        typer.echo(rig.trigger(service))


@reports_errors(kept=_KEPT)
def pause(namespace: Namespace = RIG) -> None:
    """Pause the simulation between two samples."""
    _trigger("simulator/pause", namespace)


@reports_errors(kept=_KEPT)
def play(namespace: Namespace = RIG) -> None:
    """Let a paused simulation go on; start a stopped one anew."""
    _trigger("simulator/play", namespace)


@reports_errors(kept=_KEPT)
def stop(namespace: Namespace = RIG) -> None:
    """Stop the simulation: the plant is at rest, and play starts the realization anew."""
    _trigger("simulator/stop", namespace)


@reports_errors(kept=_KEPT)
def reset(namespace: Namespace = RIG) -> None:
    """Play the realization from its beginning, plant at rest; a paused one stays paused."""
    _trigger("simulator/reset", namespace)


@reports_errors(kept="the steps go on")
def step(
    samples: Annotated[int, typer.Argument(metavar="[N]", min=1, help="How many samples.")] = 1,
    namespace: Namespace = RIG,
) -> None:
    """Play N samples of a paused simulation."""
    with _rig(namespace) as rig:
        typer.echo(rig.step(samples))


@reports_errors(kept=_KEPT)
def speed(
    times: Annotated[
        str | None,
        typer.Argument(metavar="[X]", help="Multiple of real time, or max: as fast as possible."),
    ] = None,
    namespace: Namespace = RIG,
) -> None:
    """Set the speed of the simulation, or show it."""
    value = None if times is None else _speed(times)
    with _rig(namespace) as rig:
        if value is not None:
            rig.set("simulator", "speed", value)
        typer.echo(rig.trigger("simulator/status"))


def _speed(text: str) -> float:
    try:
        return math.inf if text == "max" else float(text)
    except ValueError:
        raise InputError(f"The speed must be a number or max, not {text!r}.") from None


@reports_errors(kept=_KEPT)
def status(namespace: Namespace = RIG) -> None:
    """Show what every node of the rig does, whom it waits for, and which is missing."""
    with _rig(namespace) as rig:
        typer.echo(rig.status())


@reports_errors(kept=_KEPT)
def estop(
    release: Annotated[
        bool, typer.Option("--release", help="Release a trip: the torque rises again, softly.")
    ] = False,
    namespace: Namespace = RIG,
) -> None:
    """Press the emergency stop: zero torque until it is released."""
    _trigger("controller/release" if release else "controller/estop", namespace)
