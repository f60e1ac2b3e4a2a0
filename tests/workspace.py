"""What tests ask about the packages of `ros_ws`: where they are and what their files say."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
import setuptools
from catkin_pkg.package import Package, parse_package
from paths import ROOT

WORKSPACE = ROOT / "ros_ws"
PACKAGES = sorted(path.name for path in (WORKSPACE / "src").iterdir())
CONFIG = WORKSPACE / "src/fjr_bringup/config"
EXPERIMENTS = sorted((CONFIG / "paper").glob("*.yaml"))


def folder(package: str) -> Path:
    """Return a package's folder in the workspace."""
    return WORKSPACE / "src" / package


def manifest(package: str) -> tuple[Package, list[str]]:
    """Return package.xml as catkin_pkg reads and validates it, and its warnings."""
    warnings: list[str] = []
    return parse_package(str(folder(package)), warnings=warnings), warnings


def setup_arguments(package: str, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what a package's setup.py hands to setuptools."""
    given: dict[str, Any] = {}
    with monkeypatch.context() as patch:
        patch.chdir(folder(package))
        patch.setattr(setuptools, "setup", lambda **arguments: given.update(arguments))
        runpy.run_path("setup.py")
    return given
