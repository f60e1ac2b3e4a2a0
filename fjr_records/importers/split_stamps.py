"""Stamps of ROS in two columns, whole seconds and the nanoseconds of each: `secs` and `nsecs`."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

_SECONDS = re.compile(r"(?P<before>(?:.*[^a-z])?)(?:secs?|seconds)", re.I | re.S)
_NANOSECONDS = ("nsecs", "nsec", "nanosec", "nanosecs", "nanoseconds")


def is_seconds(name: str) -> bool:
    """Tell whether the name of a column ends as one of seconds: header.stamp.sec, secs."""
    return _SECONDS.fullmatch(name) is not None


def nanoseconds_beside(title: str, names: Iterable[str]) -> str | None:
    """Return which of some columns holds the nanoseconds to a column; None if there is none.

    Args:
        title: name of the column, which may be one of seconds.
        names: of all columns.
    """
    seconds = _SECONDS.fullmatch(title)
    if seconds is None:
        return None
    sought = {f"{seconds['before']}{end}".lower() for end in _NANOSECONDS}
    return next((name for name in names if name.lower() in sought), None)


def joined(seconds: np.ndarray, nanoseconds: np.ndarray) -> np.ndarray | None:
    """Return stamps in s, (samples,); None unless they are whole seconds and nanoseconds of each.

    Args:
        seconds: (samples,), NaN in rows without a stamp.
        nanoseconds: (samples,), as well.
    """
    there = np.isfinite(seconds) & np.isfinite(nanoseconds)
    whole, part = seconds[there], nanoseconds[there]
    if (whole % 1.0 != 0.0).any() or (part < 0.0).any() or (part >= 1e9).any():
        return None
    return seconds + 1e-9 * nanoseconds
