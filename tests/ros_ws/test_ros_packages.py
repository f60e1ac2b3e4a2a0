"""The packages of `ros_ws`: what package.xml and setup.py declare is what the sources need."""

from __future__ import annotations

import ast
import sys
from importlib.metadata import distribution

import pytest
from packaging.requirements import Requirement
from workspace import PACKAGES, ROOT, folder, manifest, setup_arguments

EXTRAS = ("report", "dask")
"""Extras of the wheel that packages of the workspace name too."""
OPTIONAL = {"cma", "control", "mujoco", "simulation_interfaces", "h5py"}
WITH_PYDANTIC = {"pydantic_core", "typing_extensions"}
PRODUCT = distribution("fjr-rig")
REQUIRED = {
    requirement.name: requirement
    for requirement in map(Requirement, PRODUCT.requires or [])
    if requirement.marker is None
    or any(requirement.marker.evaluate({"extra": extra}) for extra in EXTRAS)
}
MODULES = {"pyyaml": "yaml"}
"""Modules whose library has another name on PyPI."""


def pip_name(key: str) -> str:
    """Return the name on PyPI of a rosdep key such as python3-rosbags-pip."""
    name = key.removeprefix("python3-").removesuffix("-pip")
    return {module: pip for pip, module in MODULES.items()}.get(name, name)


def imported(package: str) -> set[str]:
    """Return what a package's modules import from elsewhere, by top-level name."""
    found = set()
    for file in (ROOT / package).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
                found.add(node.module.partition(".")[0])
    return found - set(sys.stdlib_module_names) - {package} - OPTIONAL - WITH_PYDANTIC


def test_the_workspace_holds_every_package_by_a_link_to_its_sources() -> None:
    for package in PACKAGES:
        link = folder(package) / package
        assert link.is_symlink() and link.samefile(ROOT / package)
    assert set(PACKAGES) == {
        path.parent.name for path in ROOT.glob("*/__init__.py") if path.parent.name != "tests"
    }


@pytest.mark.parametrize("package", PACKAGES)
def test_manifests_are_valid(package: str) -> None:
    parsed, warnings = manifest(package)
    assert not warnings
    assert parsed.name == package
    assert parsed.package_format == 3
    assert parsed.version == PRODUCT.version
    assert parsed.get_build_type() == "ament_python"
    assert {str(person) for person in parsed.maintainers} == {
        str(person) for person in manifest("fjr_interface")[0].maintainers
    }
    assert parsed.licenses == manifest("fjr_interface")[0].licenses


@pytest.mark.parametrize("package", PACKAGES)
def test_setup_installs_what_the_wheel_installs(
    package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = setup_arguments(package, monkeypatch)
    assert given["name"] == package
    assert given["version"] == PRODUCT.version
    scripts = {
        f"{entry.name} = {entry.value}"
        for entry in PRODUCT.entry_points
        if entry.group == "console_scripts" and entry.value.startswith(f"{package}.")
    }
    assert set(given.get("entry_points", {}).get("console_scripts", ())) == scripts


@pytest.mark.parametrize("package", PACKAGES)
def test_all_imports_are_declared_and_no_other_library(
    package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    declared = {dependency.name for dependency in manifest(package)[0].exec_depends}
    keys = {name for name in declared if name.startswith("python3-")}
    given = setup_arguments(package, monkeypatch)
    texts = list(given["install_requires"])
    for extra in EXTRAS:
        texts += given["extras_require"].get(extra, [])
    without_key = {Requirement(text).name: Requirement(text) for text in texts}
    del without_key["setuptools"]
    libraries = {pip_name(key) for key in keys} | set(without_key)
    # ROS packages and those of this workspace have the names of their modules.
    modules = {MODULES.get(name, name) for name in libraries}
    known = {name.partition(".")[0] for name in modules} | (declared - keys)
    assert imported(package) <= known
    assert declared & set(PACKAGES) == imported(package) & set(PACKAGES)
    assert libraries <= set(REQUIRED)
    for name, requirement in without_key.items():
        assert requirement.specifier == REQUIRED[name].specifier
