"""The three nodes in lockstep; they play the first realization of the experiment in `rig`."""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

NODES = ("excitation_node", "controller_node", "fjr_sim_node")


def start(context: LaunchContext) -> list[Node]:
    """Check the parameter file, then return the nodes; the first that ends ends them all."""
    from fjr_bringup.graph.launching import checked_rig

    def given(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    rig = checked_rig(given("rig"), given("namespace"))
    nodes = [
        Node(
            package=package,
            executable=package,
            namespace=given("namespace"),
            parameters=[rig],
            remappings=[("link_position", given("joint_states"))],
            output="screen",
            on_exit=[Shutdown(reason=f"{package} has ended")],
        )
        for package in NODES
    ]
    if given("description") != "none":
        text = Path(given("description")).read_text(encoding="utf-8")
        publisher = Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=given("namespace"),
            parameters=[{"robot_description": ParameterValue(text, value_type=str)}],
            remappings=[("joint_states", given("joint_states"))],
            output="screen",
        )
        nodes.append(publisher)
    return nodes


def generate_launch_description() -> LaunchDescription:
    """Start excitation, controller and simulated drive, with robot_description if asked."""
    share = FindPackageShare("fjr_bringup")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "rig",
                default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
                description="Parameter file of rig and experiment",
            ),
            DeclareLaunchArgument(
                "namespace", default_value="/rig", description="Namespace of nodes and topics"
            ),
            DeclareLaunchArgument(
                "joint_states",
                default_value="link_position",
                description="Topic of the link's position, such as /joint_states",
            ),
            DeclareLaunchArgument(
                "description",
                default_value="none",
                description="URDF to publish as robot_description, such as rig.urdf of this "
                "package; needs robot_state_publisher",
            ),
            OpaqueFunction(function=start),
        ]
    )
