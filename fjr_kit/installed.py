"""Where the product's packages lie, and their version: pip installs them as one, colcon singly."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from .errors import InputError

_REPORTS_NEED = ("matplotlib", "plotly")


def sources(packages: Iterable[str]) -> list[Path]:
    """Return all modules of packages, those of subpackages included, in a fixed order."""
    found: list[Path] = []
    for package in packages:
        spec = find_spec(package)
        for folder in (spec and spec.submodule_search_locations) or ():
            found += sorted(Path(folder).rglob("*.py"))
    return found


def product_version() -> str:
    """Return the version of the product."""
    for name in ("fjr-rig", "fjr_interface"):
        try:
            return version(name)
        except PackageNotFoundError:
            continue
    return "(not installed as a package)"


def require_report_extra() -> None:
    """Refuse to begin what ends in a report that could then not be written.

    Raises:
        InputError: a library of the extra `report` is not installed.
    """
    absent = [name for name in _REPORTS_NEED if find_spec(name) is None]
    if absent:
        raise InputError(
            f"This command writes a report, for which {' and '.join(absent)} must be installed; "
            "install fjr-rig[report]."
        )
