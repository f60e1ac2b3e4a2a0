"""What `colcon test` asks of every package: whole where it was installed, imports, executables run.

Each package has this file by a link in its test folder; the package is the folder above that link.
"""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path
from xml.etree import ElementTree

import pytest

SOURCE = Path(__file__).parents[1]
NAME = str(ElementTree.parse(SOURCE / "package.xml").getroot().findtext("name"))
EXECUTABLES = sorted(
    entry.name for entry in distribution(NAME).entry_points if entry.group == "console_scripts"
)

IMPORT_ALL = """
import importlib, pathlib, sys
name = sys.argv[1]
folder = pathlib.Path(importlib.import_module(name).__file__).parent
for file in folder.rglob("*.py"):
    if not file.stem.startswith("__"):
        importlib.import_module(".".join((name, *file.relative_to(folder).with_suffix("").parts)))
print(folder)
"""


def installed() -> Path:
    """Return the prefix that holds the package, as the ament index finds it."""
    marker = Path("share/ament_index/resource_index/packages") / NAME
    prefixes = [Path(entry) for entry in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)]
    return next(prefix for prefix in prefixes if (prefix / marker).exists())


def files(folder: Path) -> set[Path]:
    """Return the files below a folder, relative to it."""
    found = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    return {path for path in found if "__pycache__" not in path.parts}


def run(*command: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a command where nothing but what is installed can be imported."""
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300)


def test_every_file_is_installed_and_every_module_imports(tmp_path: Path) -> None:
    done = run(sys.executable, "-c", IMPORT_ALL, NAME, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = Path(done.stdout.strip())
    assert folder not in (SOURCE / NAME, (SOURCE / NAME).resolve()), "not what colcon installed"
    assert files(folder) == files(SOURCE / NAME)


@pytest.mark.parametrize("kind", ["launch", "config", "urdf"])
def test_shared_files_are_installed(kind: str) -> None:
    assert files(installed() / "share" / NAME / kind) == files(SOURCE / kind)


@pytest.mark.parametrize("name", EXECUTABLES)
def test_executables_start(name: str, tmp_path: Path) -> None:
    executable = str(installed() / "lib" / NAME / name)
    if name == "fjr":
        done = run(executable, "--help", cwd=tmp_path)
        assert done.returncode == 0 and "Usage: fjr" in done.stdout, done.stderr
    else:
        done = run(executable, "--ros-args", "-p", "no_such_parameter:=1", cwd=tmp_path)
        assert done.returncode == 2 and "There is no parameter" in done.stderr, done.stderr


@pytest.mark.parametrize("file", sorted((SOURCE / "launch").glob("*")), ids=lambda file: file.name)
def test_launch_files_load(file: Path) -> None:
    sources = pytest.importorskip("launch.launch_description_sources", reason="no ROS 2 here")
    assert sources.get_launch_description_from_python_launch_file(str(file)).entities
