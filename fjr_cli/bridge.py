"""`fjr bridge`: the rig's topics joined with those of ros2_control."""

from __future__ import annotations

import os
import sys
from enum import Enum
from typing import Annotated

import typer

from .cli_errors import reports_errors


class Direction(str, Enum):
    """Which way the bridge is crossed."""

    serve = "serve"
    observe = "observe"


@reports_errors(kept="the bridge has left")
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
