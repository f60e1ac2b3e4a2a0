"""`fjr bridge`: its options; what it does is in `bridge`."""

from __future__ import annotations

import os
import sys
from enum import Enum
from typing import Annotated

import typer

from ..guard import guarded


class Direction(str, Enum):
    """Which way the bridge is crossed."""

    serve = "serve"
    observe = "observe"


@guarded(kept="the bridge has left")
def bridge(
    direction: Annotated[
        Direction,
        typer.Argument(
            help="serve: a controller manager commands the simulated drive in lockstep; observe: "
            "a rig under ros2_control is published as reference, motor_position and motor_torque."
        ),
    ],
    joint: Annotated[str, typer.Option(help="Joint of the ros2_control tag.")],
    states: Annotated[
        str, typer.Option(metavar="TOPIC", help="Topic of the joint states.")
    ] = "/robot_joint_states",
    commands: Annotated[
        str, typer.Option(metavar="TOPIC", help="Topic of the joint commands.")
    ] = "/robot_joint_commands",
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="PARAMETER=VALUE",
            help="Any other parameter of the bridge, such as echo_joint=sample. Repeatable.",
        ),
    ] = None,
) -> None:
    """Join the rig's topics and those of ros2_control's joint_state_topic_hardware_interface."""
    given = [
        f"joint:={joint}",
        f"joint_states_topic:={states}",
        f"joint_commands_topic:={commands}",
    ]
    given += [setting.replace("=", ":=", 1) for setting in settings or []]
    arguments = [part for each in given for part in ("-p", each)]
    command = [sys.executable, "-m", "fjr_bringup.bridge", direction.value, "--ros-args"]
    os.execv(sys.executable, [*command, *arguments])


def add_to(app: typer.Typer) -> None:
    """Add the command to `fjr`."""
    app.command()(bridge)
