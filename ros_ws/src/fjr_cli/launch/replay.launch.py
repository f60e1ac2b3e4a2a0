"""Replay of a bag with its clock, or into the lockstep: `fjr replay`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import ExecutableInPackage

GIVEN = ("rate", "into", "out", "namespace")


def start(context: LaunchContext) -> list[ExecuteProcess]:
    """Return `fjr replay` with the options that were given."""
    options = []
    for name in GIVEN:
        if value := LaunchConfiguration(name).perform(context):
            options += [f"--{name}", value]
    if LaunchConfiguration("follow_clock").perform(context) == "true":
        options.append("--follow-clock")
    fjr = ExecutableInPackage("fjr", "fjr_cli")
    bag = LaunchConfiguration("bag")
    return [ExecuteProcess(cmd=[fjr, "replay", bag, *options], output="screen")]


def generate_launch_description() -> LaunchDescription:
    """Start `fjr replay`."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="Bag to replay"),
            DeclareLaunchArgument("rate", default_value="", description="Times real time, or max"),
            DeclareLaunchArgument(
                "into", default_value="", description="closed-loop, plant or controller"
            ),
            DeclareLaunchArgument("out", default_value="", description="With into: new folder"),
            DeclareLaunchArgument(
                "namespace",
                default_value="/rig",
                description="Namespace of the topics that the bag has in /rig",
            ),
            DeclareLaunchArgument(
                "follow_clock",
                default_value="false",
                description="true: another program's /clock keeps the time",
            ),
            OpaqueFunction(function=start),
        ]
    )
