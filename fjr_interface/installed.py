"""Where the product's packages lie, and their version: pip installs them as one, colcon singly."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path


def sources(packages: Iterable[str]) -> list[Path]:
    """Return the modules of packages, without subpackages, in a fixed order."""
    found: list[Path] = []
    for package in packages:
        spec = find_spec(package)
        for folder in (spec and spec.submodule_search_locations) or ():
            found += sorted(Path(folder).glob("*.py"))
    return found


def product_version() -> str:
    """Return the version of the product."""
    for name in ("fjr-rig", "fjr_interface"):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return "(not installed as a package)"
