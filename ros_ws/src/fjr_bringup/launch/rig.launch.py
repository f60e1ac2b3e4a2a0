"""The three nodes in lockstep; they play the first realization of the experiment in `rig`."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Start excitation, controller and simulated drive."""
    share = FindPackageShare("fjr_bringup")
    rig = DeclareLaunchArgument(
        "rig",
        default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
        description="Parameter file of rig and experiment",
    )
    nodes = [
        Node(
            package=package,
            executable=package,
            parameters=[LaunchConfiguration("rig")],
            output="screen",
        )
        for package in ("excitation_node", "controller_node", "fjr_sim_node")
    ]
    return LaunchDescription([rig, *nodes])
