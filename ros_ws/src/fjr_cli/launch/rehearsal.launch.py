"""Rehearsal on the wall clock, with a verdict: `fjr rehearse`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

GIVEN = ("rig", "out", "rate", "duration", "namespace")


def start(context: LaunchContext) -> list[ExecuteProcess]:
    """Return `fjr rehearse` with the options that were given."""
    options = []
    for name in GIVEN:
        if value := LaunchConfiguration(name).perform(context):
            options += [f"--{name}", value]
    rehearse = ExecuteProcess(
        cmd=[ExecutableInPackage("fjr", "fjr_cli"), "rehearse", *options],
        output="screen",
        sigterm_timeout="30",  # time to bring the torque to zero after Ctrl-C
    )
    return [rehearse]


def generate_launch_description() -> LaunchDescription:
    """Start `fjr rehearse`."""
    share = FindPackageShare("fjr_bringup")
    rig = DeclareLaunchArgument(
        "rig",
        default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
        description="Parameter file of rig and experiment",
    )
    others = [
        DeclareLaunchArgument("out", default_value="", description="New folder of the report"),
        DeclareLaunchArgument("rate", default_value="", description="Samples per second"),
        DeclareLaunchArgument("duration", default_value="", description="Seconds to play"),
        DeclareLaunchArgument(
            "namespace", default_value="/rig", description="Namespace of nodes and topics"
        ),
    ]
    return LaunchDescription([rig, *others, OpaqueFunction(function=start)])
