"""Standard output and error whose reader may go away, as in `fjr ... | head -1`."""

from __future__ import annotations

import errno
import io
import sys
from typing import Any

_GONE = (errno.EPIPE, errno.EIO)
"""The pipe's reader has ended; the terminal was closed."""


class _Forgiving(io.FileIO):
    """A file of which nobody may read to the end: what is written after that is dropped."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            if error.errno not in _GONE:
                raise
            return len(data)


def outlive_readers() -> None:
    """Let a command finish its work, and end by its own status, when its output is not read."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if not isinstance(stream, io.TextIOWrapper):
            continue
        stream.flush()
        raw = _Forgiving(stream.fileno(), "w", closefd=False)
        forgiving = io.TextIOWrapper(
            io.BufferedWriter(raw),
            encoding=stream.encoding,
            errors=stream.errors,
            line_buffering=stream.line_buffering or name == "stderr",
        )
        setattr(sys, name, forgiving)
