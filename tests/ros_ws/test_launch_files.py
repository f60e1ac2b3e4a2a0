"""Launch files, read with a stand-in for launch and launch_ros, for which there are no wheels.

They have not run: that every node, executable, parameter, command and file that they name exists is
checked here, `colcon test` loads them with the real launch where ROS 2 is installed.
"""

from __future__ import annotations

import importlib
import runpy
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import pytest
import typer
from workspace import PACKAGES, ROOT, folder, manifest, setup_arguments

from fjr_bringup.campaign.plan import Campaign
from fjr_cli.app import app
from fjr_interface import topics
from fjr_interface.parameter_file import NODES, load_parameter_file
from fjr_interface.ros import runtime
from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT

FILES = sorted(folder("fjr_bringup").parent.glob("*/launch/*.launch.py"))


@dataclass
class LaunchDescription:
    entities: list[Any]


@dataclass
class DeclareLaunchArgument:
    name: str
    default_value: Any = None
    description: str = ""


@dataclass
class LaunchConfiguration:
    variable_name: str

    def perform(self, context: Launch) -> str:
        return context.text(self)


@dataclass
class OpaqueFunction:
    function: Callable[[Launch], list[Any]]


@dataclass
class Shutdown:
    reason: str


@dataclass
class ParameterValue:
    value: str
    value_type: type


@dataclass
class PathJoinSubstitution:
    substitutions: list[Any]

    def perform(self, context: Launch) -> str:
        return context.text(self)


@dataclass
class FindPackageShare:
    package: str


@dataclass
class ExecutableInPackage:
    executable: str
    package: str


@dataclass(kw_only=True)
class ExecuteProcess:
    cmd: list[Any]
    output: str
    sigterm_timeout: str = "5"
    on_exit: list[Any] = field(default_factory=list)


@dataclass(kw_only=True)
class Node:
    package: str
    executable: str
    output: str
    namespace: str = ""
    parameters: list[Any] = field(default_factory=list)
    remappings: list[Any] = field(default_factory=list)
    on_exit: list[Any] = field(default_factory=list)


class LaunchContext:
    """What a launch file's functions are given; here the `Launch` itself."""


STAND_IN = {
    "launch": (LaunchDescription, LaunchContext),
    "launch.actions": (DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown),
    "launch.substitutions": (LaunchConfiguration, PathJoinSubstitution),
    "launch_ros": (),
    "launch_ros.actions": (Node,),
    "launch_ros.parameter_descriptions": (ParameterValue,),
    "launch_ros.substitutions": (ExecutableInPackage, FindPackageShare),
}


class Launch:
    """One launch file, resolved with the default or a stand-in for every argument."""

    def __init__(
        self, file: Path, monkeypatch: pytest.MonkeyPatch, given: Mapping[str, str] | None = None
    ) -> None:
        self.given = given or {}
        for name, classes in STAND_IN.items():
            module = ModuleType(name)
            vars(module).update({each.__name__: each for each in classes})
            monkeypatch.setitem(sys.modules, name, module)
        self.entities = runpy.run_path(str(file))["generate_launch_description"]().entities
        self.arguments = {each.name: each for each in self.of(DeclareLaunchArgument)}
        assert set(self.given) <= set(self.arguments)
        for each in self.of(OpaqueFunction):
            self.entities = [*self.entities, *each.function(self)]

    def of(self, kind: type) -> list[Any]:
        return [entity for entity in self.entities if isinstance(entity, kind)]

    def text(self, value: Any) -> str:
        """Return a substitution's text; the share folder of a package is its source folder."""
        if isinstance(value, LaunchConfiguration):
            argument = self.arguments[value.variable_name]
            if argument.name in self.given:
                return self.given[argument.name]
            absent = argument.default_value is None
            return self.text(f"given {argument.name}" if absent else argument.default_value)
        if isinstance(value, PathJoinSubstitution):
            return "/".join(map(self.text, value.substitutions))
        if isinstance(value, FindPackageShare):
            return str(folder(value.package))
        return str(value)


@pytest.fixture(params=FILES, ids=lambda file: file.name)
def launch(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Launch:
    return Launch(request.param, monkeypatch)


def executables(package: str, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    scripts = setup_arguments(package, monkeypatch)["entry_points"]["console_scripts"]
    return [script.partition(" = ")[0] for script in scripts]


def test_all_five_are_there() -> None:
    names = {file.name.removesuffix(".launch.py") for file in FILES}
    assert names == {"rig", "record", "rosbag2", "replay", "rehearsal"}


def test_something_is_started_and_every_argument_explained(launch: Launch) -> None:
    assert launch.of(Node) + launch.of(ExecuteProcess)
    assert all(argument.description for argument in launch.arguments.values())


def test_nodes_and_their_parameters_exist(launch: Launch, monkeypatch: pytest.MonkeyPatch) -> None:
    for node in launch.of(Node):
        if node.package == "robot_state_publisher":
            continue
        assert node.package in PACKAGES
        assert node.executable in executables(node.package, monkeypatch)
        group = importlib.import_module(f"{node.package}.node").PARAMETERS
        for parameters in node.parameters:
            if isinstance(parameters, dict):
                group.check(parameters)
            else:
                Campaign.create(Path(launch.text(parameters)))


def test_commands_and_their_options_exist(launch: Launch, monkeypatch: pytest.MonkeyPatch) -> None:
    for process in launch.of(ExecuteProcess):
        program, *words = process.cmd
        if not isinstance(program, ExecutableInPackage):
            assert program == "ros2" and "ros2bag" in {
                dependency.name for dependency in manifest("fjr_bringup")[0].exec_depends
            }
            continue
        assert program.executable in executables(program.package, monkeypatch)
        name, *arguments = map(launch.text, words)
        commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
        commands[name].make_context(name, arguments)  # parses, does not run


def test_rosbag2_records_losslessly_what_the_nodes_publish(monkeypatch: pytest.MonkeyPatch) -> None:
    launch = Launch(folder("fjr_bringup") / "launch/rosbag2.launch.py", monkeypatch)
    (record,) = launch.of(ExecuteProcess)
    words = list(map(launch.text, record.cmd))
    recorded = set(words[words.index("--topics") + 1 :])
    signals = {signal.absolute_topic for signal in (*topics.SIGNALS, topics.LINK_POSITION)}
    experiment = f"{topics.NAMESPACE}/{topics.EXPERIMENT_TOPIC}"
    assert recorded == signals | {experiment, "/clock"}

    from ruamel.yaml import YAML

    overrides = YAML(typ="safe").load(Path(words[words.index("--qos-profile-overrides-path") + 1]))
    offered = {
        **dict.fromkeys(signals, runtime.SIGNAL_QOS),
        experiment: runtime.EXPERIMENT_QOS,
    }
    clock = overrides.pop("/clock")  # offered best effort, of depth 1: too little for a recorder
    assert (clock["reliability"], clock["depth"]) == ("best_effort", topics.SIGNAL_DEPTH)
    assert runtime.CLOCK_QOS.reliability.name == "BEST_EFFORT"
    assert overrides == {
        topic: {
            "history": qos.history.name.lower(),
            "depth": qos.depth,
            "reliability": qos.reliability.name.lower(),
            "durability": qos.durability.name.lower(),
        }
        for topic, qos in offered.items()
    }
    for node in launch.of(Node):
        awaited = node.parameters[1]["readers"].split(",")
        assert awaited[0] in NODES and awaited[1:] == ["rosbag2_recorder"]
        assert (
            awaited[0]
            == importlib.import_module(f"{node.package}.node").PARAMETERS["readers"].default
        )


def test_a_file_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("rig", "rosbag2"):
        file = folder("fjr_bringup") / f"launch/{name}.launch.py"
        with pytest.raises(InputError, match=r"no_such\.yaml: cannot be read"):
            Launch(file, monkeypatch, {"rig": "no_such.yaml"})
        with pytest.raises(InputError, match="'/my-cell' is no ROS namespace"):
            Launch(file, monkeypatch, {"namespace": "/my-cell"})


def test_whatever_ends_ends_all(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("rig", "rosbag2"):
        launch = Launch(folder("fjr_bringup") / f"launch/{name}.launch.py", monkeypatch)
        for started in launch.of(Node) + launch.of(ExecuteProcess):
            assert [type(each) for each in started.on_exit] == [Shutdown]


def test_nodes_of_another_namespace_get_the_same_parameters(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = folder("fjr_bringup") / "launch/rig.launch.py"
    given = {"namespace": "/cell/left", "joint_states": "/joint_states"}
    launch = Launch(file, monkeypatch, given)
    original = load_parameter_file(Launch(file, monkeypatch).of(Node)[0].parameters[0])
    for node in launch.of(Node):
        assert node.namespace == "/cell/left"
        assert load_parameter_file(node.parameters[0], namespace="/cell/left") == original
        assert node.remappings == [("link_position", "/joint_states")]


def test_rosbag2_records_the_topics_of_another_namespace(monkeypatch: pytest.MonkeyPatch) -> None:
    launch = Launch(
        folder("fjr_bringup") / "launch/rosbag2.launch.py", monkeypatch, {"namespace": "/cell"}
    )
    (record,) = launch.of(ExecuteProcess)
    words = list(map(launch.text, record.cmd))
    topics_recorded = words[words.index("--topics") + 1 :]
    from ruamel.yaml import YAML

    qos = YAML(typ="safe").load(Path(words[words.index("--qos-profile-overrides-path") + 1]))
    assert set(qos) == set(topics_recorded) and "/cell/reference" in qos
    assert len([topic for topic in topics_recorded if topic.startswith("/cell/")]) == 5
    for node in launch.of(Node):
        assert node.namespace == "/cell"
        assert load_parameter_file(node.parameters[0], namespace="/cell")


def test_options_that_were_given_reach_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    share = folder("fjr_cli") / "launch"
    given = {"out": "report", "rate": "500", "duration": "5", "namespace": "/cell"}
    (rehearse,) = Launch(share / "rehearsal.launch.py", monkeypatch, given).of(ExecuteProcess)
    words = ["--out", "report", "--rate", "500", "--duration", "5", "--namespace", "/cell"]
    assert rehearse.cmd[4:] == words
    given = {"rate": "2", "namespace": "/cell", "follow_clock": "true"}
    (replay,) = Launch(share / "replay.launch.py", monkeypatch, given).of(ExecuteProcess)
    assert replay.cmd[3:] == ["--rate", "2", "--namespace", "/cell", "--follow-clock"]


def test_the_description_of_the_rig_has_the_values_of_the_plant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    urdf = folder("fjr_bringup") / "urdf/rig.urdf"
    root = ElementTree.parse(urdf).getroot()
    (joint,) = root.findall("joint")
    assert joint.get("name") == topics.JOINT
    values, inertial = PLANT.defaults(), root.find("link[@name='link']/inertial")
    mass, offset = (
        float(inertial.find("mass").get("value")),
        float(inertial.find("origin").get("xyz").split()[0]),
    )
    about_middle = float(inertial.find("inertia").get("izz"))
    assert about_middle + mass * offset**2 == pytest.approx(values["j"])
    dynamics = joint.find("dynamics")
    assert (float(dynamics.get("friction")), float(dynamics.get("damping"))) == (
        values["fs"],
        values["fv"],
    )
    named = {each.get("name") for each in root.findall("ros2_control/joint/*")}
    assert named == {"position", "velocity", "effort"}
    page = (ROOT / "docs/ros2_control.md").read_text(encoding="utf-8")
    assert root.findtext("ros2_control/hardware/plugin") in page
    file = folder("fjr_bringup") / "launch/rig.launch.py"
    nodes = Launch(file, monkeypatch, {"description": str(urdf)}).of(Node)
    assert nodes[-1].package == "robot_state_publisher"
    assert nodes[-1].parameters[0]["robot_description"].value == urdf.read_text(encoding="utf-8")
