"""Rehearsal on the wall clock, with a verdict: `fjr rehearse`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Start `fjr rehearse`."""
    share = FindPackageShare("fjr_bringup")
    rig = DeclareLaunchArgument(
        "rig",
        default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
        description="Parameter file of rig and experiment",
    )
    fjr = ExecutableInPackage("fjr", "fjr_cli")
    rehearse = ExecuteProcess(
        cmd=[fjr, "rehearse", "--rig", LaunchConfiguration("rig")],
        output="screen",
        sigterm_timeout="30",  # time to bring the torque to zero after Ctrl-C
    )
    return LaunchDescription([rig, rehearse])
