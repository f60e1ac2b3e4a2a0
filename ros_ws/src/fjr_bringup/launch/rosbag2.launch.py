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


def start(context: LaunchContext) -> list[Node | ExecuteProcess]:
    """Check the parameter file, then return nodes and recorder; the first that ends ends all."""
    from fjr_bringup.graph.launching import checked_rig, recorder_qos

    def given(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    rig = checked_rig(given("rig"), given("namespace"))
    namespace = f"/{given('namespace').strip('/')}"
    nodes = [
        Node(
            package=package,
            executable=package,
            namespace=namespace,
            parameters=[rig, {"readers": f"{reader},{RECORDER}"}],
            output="screen",
            on_exit=[Shutdown(reason=f"{package} has ended")],
        )
        for package, reader in READERS.items()
    ]
    qos = PathJoinSubstitution([FindPackageShare("fjr_bringup"), "config", "rosbag2_qos.yaml"])
    record = ExecuteProcess(
        cmd=[
            *("ros2", "bag", "record", "--storage", "mcap", "--output", given("out")),
            *("--qos-profile-overrides-path", recorder_qos(qos.perform(context), namespace)),
            *("--topics", "/clock", *(f"{namespace}/{topic}" for topic in TOPICS)),
        ],
        output="screen",
        sigterm_timeout="30",  # time to close the bag after Ctrl-C
        on_exit=[Shutdown(reason="the recorder has ended")],
    )
    return [record, *nodes]


def generate_launch_description() -> LaunchDescription:
    """Start excitation, controller, simulated drive and `ros2 bag record`."""
    share = FindPackageShare("fjr_bringup")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "rig",
                default_value=PathJoinSubstitution([share, "config", "paper", "optimum.yaml"]),
                description="Parameter file of rig and experiment",
            ),
            DeclareLaunchArgument("out", description="Folder of the bag; it may not exist yet"),
            DeclareLaunchArgument(
                "namespace", default_value="/rig", description="Namespace of nodes and topics"
            ),
            OpaqueFunction(function=start),
        ]
    )
