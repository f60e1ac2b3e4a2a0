"""A file of JSON objects, one a line, that only grows and survives a kill at any moment."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fjr_kit.errors import InputError


class JsonLines:
    """Such a file; it need not exist.

    A line counts once its newline is on the disk; what a kill left of one is cut off before the
    next is appended, and never read.
    """

    def __init__(self, path: Path) -> None:
        """Take the file's place."""
        self.path = path

    def read(self) -> list[dict[str, Any]]:
        """Return all objects; raise InputError for a whole line that is none."""
        try:
            text = self.path.read_bytes()
        except FileNotFoundError:
            return []
        except OSError as error:
            raise InputError(f"{self.path} cannot be read: {error.strerror}.") from None
        *lines, _ = text.split(b"\n")
        return [self._parsed(line, number) for number, line in enumerate(lines, 1)]

    def _parsed(self, line: bytes, number: int) -> dict[str, Any]:
        try:
            values = json.loads(line)
        except ValueError:
            values = None
        if not isinstance(values, dict):
            raise InputError(
                f"{self.path}: line {number} is no JSON object; remove that line and go on."
            )
        return values

    def append(self, *objects: Mapping[str, Any]) -> None:
        """Write objects to the disk, a line each; raise InputError if that can't be done."""
        lines = "".join(json.dumps(each, separators=(",", ":")) + "\n" for each in objects)
        try:
            with self.path.open("ab+") as file:
                file.truncate(self._whole(file.tell()))
                file.write(lines.encode())
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise InputError(f"{self.path} cannot be written: {error.strerror}.") from None

    def _whole(self, size: int) -> int:
        """Return the size up to the end of the last whole line."""
        return self.path.read_bytes().rfind(b"\n") + 1 if size else 0
