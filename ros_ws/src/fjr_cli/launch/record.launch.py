"""The rig with its own recorder: the whole campaign in `rig`, one audited bag per realization."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Start `fjr run`, which starts, watches and ends the nodes itself."""
    share = FindPackageShare("fjr_bringup")
    rig = DeclareLaunchArgument(
        "rig",
        default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
        description="Parameter file of rig and experiment",
    )
    out = DeclareLaunchArgument("out", description="Experiment folder; one begun is taken up")
    fjr = ExecutableInPackage("fjr", "fjr_cli")
    run = ExecuteProcess(
        cmd=[fjr, "run", "--rig", LaunchConfiguration("rig"), "--out", LaunchConfiguration("out")],
        output="screen",
        sigterm_timeout="30",  # time to close the bag after Ctrl-C
    )
    return LaunchDescription([rig, out, run])
