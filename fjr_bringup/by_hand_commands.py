"""`fjr pause`, `play`, `step`, `reset`, `speed`, `stop`, `status`, `estop`: a rig run by hand."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from fjr_interface.errors import InputError

from .guard import guarded

_KEPT = "the rig does what it did"


def _trigger(service: str) -> None:
    from .by_hand import Rig

    with Rig() as rig:
        typer.echo(rig.trigger(service))


@guarded(kept=_KEPT)
def pause() -> None:
    """Pause the simulation between two samples."""
    _trigger("simulator/pause")


@guarded(kept=_KEPT)
def play() -> None:
    """Let a paused simulation go on; start a stopped one anew."""
    _trigger("simulator/play")


@guarded(kept=_KEPT)
def stop() -> None:
    """Stop the simulation: the plant is at rest, and play starts the realization anew."""
    _trigger("simulator/stop")


@guarded(kept=_KEPT)
def reset() -> None:
    """Play the realization from its beginning, plant at rest; a paused one stays paused."""
    _trigger("simulator/reset")


@guarded(kept="the steps go on")
def step(
    samples: Annotated[int, typer.Argument(metavar="[N]", min=1, help="How many samples.")] = 1,
) -> None:
    """Play N samples of a paused simulation."""
    from .by_hand import Rig

    with Rig() as rig:
        typer.echo(rig.step(samples))


@guarded(kept=_KEPT)
def speed(
    times: Annotated[
        str | None,
        typer.Argument(metavar="[X]", help="Times real time, or max: as fast as possible."),
    ] = None,
) -> None:
    """Set the speed of the simulation, or show it."""
    from .by_hand import Rig

    value = None if times is None else _speed(times)
    with Rig() as rig:
        if value is not None:
            rig.set("simulator", "speed", value)
        typer.echo(rig.trigger("simulator/status"))


def _speed(text: str) -> float:
    try:
        return math.inf if text == "max" else float(text)
    except ValueError:
        raise InputError(f"The speed must be a number or max, not {text!r}.") from None


@guarded(kept=_KEPT)
def status() -> None:
    """Show what every node of the rig is doing."""
    from .by_hand import Rig, describe

    with Rig() as rig:
        typer.echo(describe(rig.diagnostics()))


@guarded(kept=_KEPT)
def estop(
    release: Annotated[
        bool, typer.Option("--release", help="Release a trip: the torque rises again, softly.")
    ] = False,
) -> None:
    """Press the emergency stop: zero torque until it is released."""
    _trigger("controller/release" if release else "controller/estop")


def add_to(app: typer.Typer) -> None:
    """Add the commands to `fjr`."""
    for command in (status, pause, play, step, reset, speed, stop, estop):
        app.command(rich_help_panel="A rig started by hand")(command)
