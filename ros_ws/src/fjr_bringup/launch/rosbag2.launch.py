"""The rig with `ros2 bag record`: one realization into one bag.

The nodes wait for the recorder before the first sample. It does not hold the lockstep back, as the
rig's own recorder does, so a slow disk can lose samples: the analysis finds and names them.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

RECORDER = "rosbag2_recorder"
READERS = {
    "excitation_node": "controller",
    "controller_node": "simulator",
    "fjr_sim_node": "controller",
}
TOPICS = ("reference", "motor_position", "motor_torque", "link_position", "experiment")


def start(context: LaunchContext) -> list[Node]:
    """Check the parameter file, then return the nodes; the first that ends ends them all."""
    from fjr_bringup.graph.launching import checked_rig

    rig = checked_rig(LaunchConfiguration("rig").perform(context))
    return [
        Node(
            package=package,
            executable=package,
            parameters=[rig, {"readers": f"{reader},{RECORDER}"}],
            output="screen",
            on_exit=[Shutdown(reason=f"{package} has ended")],
        )
        for package, reader in READERS.items()
    ]


def generate_launch_description() -> LaunchDescription:
    """Start excitation, controller, simulated drive and `ros2 bag record`."""
    config = PathJoinSubstitution([FindPackageShare("fjr_bringup"), "config"])
    rig = DeclareLaunchArgument(
        "rig",
        default_value=PathJoinSubstitution([config, "paper", "optimum.yaml"]),
        description="Parameter file of rig and experiment",
    )
    out = DeclareLaunchArgument("out", description="Folder of the bag; it may not exist yet")
    record = ExecuteProcess(
        cmd=[
            *("ros2", "bag", "record", "--storage", "mcap", "--output", LaunchConfiguration("out")),
            "--qos-profile-overrides-path",
            PathJoinSubstitution([config, "rosbag2_qos.yaml"]),
            *("--topics", "/clock", *(f"/rig/{topic}" for topic in TOPICS)),
        ],
        output="screen",
        sigterm_timeout="30",  # time to close the bag after Ctrl-C
        on_exit=[Shutdown(reason="the recorder has ended")],
    )
    return LaunchDescription([rig, out, record, OpaqueFunction(function=start)])
