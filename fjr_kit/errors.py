"""The one exception that a user is meant to read."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

_LONGEST = 60
"""Characters of a value that a sentence shows."""


class InputError(Exception):
    """Something that the user gave cannot be used.

    The message is one sentence that names the file or parameter, the field and the mend. Command
    lines print it and exit with status 2; nodes log it and refuse the value.
    """


@contextmanager
def needing(library: str, mend: str) -> Iterator[None]:
    """Turn an import that fails in the body into an InputError.

    Args:
        library: what the body imports.
        mend: what the user may do, as in 'install fjr-rig[dask], or leave --dask out'.
    """
    try:
        yield
    except ImportError as error:
        raise InputError(f"{library} is not there ({error}); {mend}.") from None


def needing_ros(otherwise: str = "") -> AbstractContextManager[None]:
    """Return `needing` for rclpy; `otherwise`: a further mend, as in ', or use fjr simulate'."""
    return needing("ROS 2", f"install fjr-rig[ros] or source ROS 2 Jazzy{otherwise}")


def shown(value: Any) -> str:
    """Return a value as Python writes it, for a sentence: cut if it is long."""
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}... ({len(text)} characters)"
