"""Command lines of the nodes: what they refuse, their help, and what they say without ROS."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from processes import Starter
from workspace import ROOT

from fjr_interface.parameters import ParameterGroup
from fjr_interface.ros.program import Program
from fjr_interface.topics import NODES

BRIDGE = ("fjr_bringup.bridge", "serve")
PROGRAMS = [*((module,) for module in NODES.values()), BRIDGE]
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
SCRIPTS = re.findall(r'^(?:\w+_node) = "([\w.]+):main"$', PROJECT, re.MULTILINE)

NO_ROS = """
import sys

class NoRos:
    def find_spec(self, name, path=None, target=None):
        if name == "rclpy" or name.endswith("_msgs") or name in ("rcl_interfaces", "std_srvs"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NoRos())
"""


@pytest.mark.parametrize("program", PROGRAMS, ids=" ".join)
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("-p", "joint:=a"), " --ros-args -p joint:=a\n"),
        (("joint:=a",), " --ros-args -p joint:=a\n"),
        (("--foo",), "does not know the argument '--foo'"),
        (("--realizations", "3"), "does not know the argument '--realizations'"),
        (("--ros-args", "-p", "joint:=a", "--", "more"), "does not know the argument 'more'"),
        (("--ros-args", "--foo"), "ROS does not know the arguments ['--foo'] behind --ros-args"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_an_argument_that_nobody_reads_is_refused(
    start_program: Starter, program: tuple[str, ...], arguments: tuple[str, ...], sentence: str
) -> None:
    node = start_program(*program, *arguments)
    assert node.exit_status() == 2
    assert node.output.startswith("error: ") and node.output.count("\n") == 1, node.output
    assert sentence in node.output


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("", ": names no node; "), ("# k1: 0\n", ": names no node; "), (None, ": cannot be read: ")],
)
def test_a_parameter_file_that_holds_nothing_is_refused(
    start_program: Starter, tmp_path: Path, text: str | None, sentence: str
) -> None:
    file = tmp_path / "rig.yaml"
    if text is not None:
        file.write_text(text)
    node = start_program("fjr_sim_node", "--ros-args", "--params-file", str(file))
    assert node.exit_status() == 2
    assert node.output.startswith(f"error: {file}{sentence}") and node.output.count("\n") == 1


@pytest.mark.parametrize("program", [*PROGRAMS, BRIDGE[:1]], ids=" ".join)
@pytest.mark.parametrize("word", ["--help", "-h"])
def test_help_names_purpose_and_parameters_and_starts_nothing(
    start_program: Starter, program: tuple[str, ...], word: str
) -> None:
    node = start_program(*program, word)
    assert node.exit_status() == 0
    assert node.output.startswith("Usage: ") and "--ros-args [-p NAME:=VALUE]" in node.output
    assert "\n  joint  joint\n      Joint " in node.output and "\n  readers" in node.output
    assert max(map(len, node.output.splitlines())) <= 100


@pytest.mark.parametrize("program", PROGRAMS, ids=" ".join)
def test_help_that_nobody_reads_to_its_end_is_no_failure(program: tuple[str, ...]) -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", *program, "--help"]
    done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_program_without_parameters_has_help_too() -> None:
    assert Program("name", "What it\n    does.\n\nMore.").help().endswith("\n\nWhat it does.")
    assert "Parameters" not in Program("name", None, ParameterGroup()).help()


@pytest.mark.parametrize(
    "command",
    [
        *[(f"-m{' '.join(program)}").split() for program in PROGRAMS],
        *[["-c", f"import sys; from {module} import main; sys.exit(main())"] for module in SCRIPTS],
        *[
            ["-m", "fjr_cli", *words.split()]
            for words in (
                "status",
                "pause",
                "play",
                "step 3",
                "reset",
                "speed",
                "speed 2",
                "stop",
                "estop",
                "estop --release",
                "bridge serve --joint elbow",
                "bridge observe --joint elbow",
            )
        ],
    ],
    ids=" ".join,
)
def test_without_ros_one_sentence_says_so(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "sitecustomize.py").write_text(NO_ROS)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, *command],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and not done.stdout
    assert done.stderr.count("\n") == 1, done.stderr
    sentence = done.stderr.removeprefix("error: ")
    assert sentence.startswith("ROS 2 is not there (No module named '")
    assert sentence.endswith("'); install fjr-rig[ros] or source ROS 2 Jazzy.\n")
