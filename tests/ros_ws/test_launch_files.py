"""Launch files, read with a stand-in for launch and launch_ros, for which there are no wheels.

They have not run: that every node, executable, parameter, command and file that they name exists is
checked here, `colcon test` loads them with the real launch where ROS 2 is installed.
"""

from __future__ import annotations

import importlib
import runpy
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import typer
from workspace import PACKAGES, folder, manifest, setup_arguments

from fjr_bringup.campaign.plan import Campaign
from fjr_cli.app import app
from fjr_interface import topics
from fjr_interface.parameter_file import NODES
from fjr_interface.ros import runtime

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


@dataclass
class PathJoinSubstitution:
    substitutions: list[Any]


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


@dataclass(kw_only=True)
class Node:
    package: str
    executable: str
    output: str
    parameters: list[Any] = field(default_factory=list)


STAND_IN = {
    "launch": (LaunchDescription,),
    "launch.actions": (DeclareLaunchArgument, ExecuteProcess),
    "launch.substitutions": (LaunchConfiguration, PathJoinSubstitution),
    "launch_ros": (),
    "launch_ros.actions": (Node,),
    "launch_ros.substitutions": (ExecutableInPackage, FindPackageShare),
}


class Launch:
    """One launch file, resolved with the default or a stand-in for every argument."""

    def __init__(self, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        for name, classes in STAND_IN.items():
            module = ModuleType(name)
            vars(module).update({each.__name__: each for each in classes})
            monkeypatch.setitem(sys.modules, name, module)
        self.entities = runpy.run_path(str(file))["generate_launch_description"]().entities
        self.arguments = {each.name: each for each in self.of(DeclareLaunchArgument)}

    def of(self, kind: type) -> list[Any]:
        return [entity for entity in self.entities if isinstance(entity, kind)]

    def text(self, value: Any) -> str:
        """Return a substitution's text; the share folder of a package is its source folder."""
        if isinstance(value, LaunchConfiguration):
            argument = self.arguments[value.variable_name]
            return self.text(argument.default_value or f"given {argument.name}")
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
        "/clock": runtime.CLOCK_QOS,
    }
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
