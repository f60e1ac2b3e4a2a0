"""How and when `fjr` was called: what reports say about their making."""

from __future__ import annotations

import shlex
import sys
from datetime import datetime


def command_line() -> str:
    """Return the command under way as it can be given again."""
    return shlex.join(["fjr", *sys.argv[1:]])


def call_date() -> str:
    """Return the time of day with its zone, to the second."""
    return datetime.now().astimezone().isoformat(timespec="seconds")
