"""Replay of a bag with its clock: `fjr replay`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from launch_ros.substitutions import ExecutableInPackage


def generate_launch_description() -> LaunchDescription:
    """Start `fjr replay`."""
    bag = DeclareLaunchArgument("bag", description="Bag to replay")
    replay = ExecuteProcess(
        cmd=[ExecutableInPackage("fjr", "fjr_cli"), "replay", LaunchConfiguration("bag")],
        output="screen",
    )
    return LaunchDescription([bag, replay])
