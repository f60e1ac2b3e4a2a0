"""How and when `fjr` was called: what reports say about their making."""

from __future__ import annotations

import platform
import shlex
import sys
from datetime import datetime
from importlib.metadata import version

from .installed import product_version

_PACKAGES = ("numpy", "scipy", "numba", "matplotlib", "plotly")
"""Those on which the numbers and figures of a report rest."""


def command_line() -> str:
    """Return the command under way as it can be given again."""
    return shlex.join(["fjr", *sys.argv[1:]])


def call_date() -> str:
    """Return the time of day with its zone, to the second."""
    return datetime.now().astimezone().isoformat(timespec="seconds")


def provenance(command: str | None, date: str | None) -> dict[str, str]:
    """Return what made a report, by name in order: command line, date (if given) and versions."""
    given = {"command": command, "date": date}
    versions = [f"Python {platform.python_version()}", f"fjr-rig {product_version()}"]
    versions += [f"{name} {version(name)}" for name in _PACKAGES]
    named = {name: text for name, text in given.items() if text is not None}
    return named | {"versions": ", ".join(versions)}
