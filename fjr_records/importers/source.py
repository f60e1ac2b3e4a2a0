"""What all file formats share: columns by name, and a bound on what a file may unpack to."""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError

_INDEXED = re.compile(r"(?P<name>.*)\[(?P<index>[0-9]{1,9})\]")
LEAST_BYTES, EXPANSION = 2**25, 32
"""A file may hold so many bytes of numbers, and so many times its size: a few hundred bytes of an
archive can stand for gigabytes."""
_LOOKED_AT = 2**16
"""Bytes that tell whether a file is text."""
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")
_NEVER_IN_TEXT = {*range(7), *range(14, 27), *range(28, 32)}
_SHOWN = 20
"""Most names of columns that a sentence shows."""


@dataclass(frozen=True)
class Heading:
    """What a file says of a column.

    Attributes:
        title: its name.
        unit: what stands of it in a row of units; empty if there is none.
        nanoseconds: the column whose nanoseconds were added to it; empty if there is none.
    """

    title: str
    unit: str = ""
    nanoseconds: str = ""


@dataclass(frozen=True)
class Names:
    """The columns of an open file.

    Attributes:
        path: the file.
        known: the names that are there.
        find: returns the array of a name.
        unlisted: names that `find` takes as well, but that no sentence lists.
        headings: of names that are not their own title, or of which more is said.
        find_with_holes: returns it with NaN where a row or entry does not hold it; None where
            `find` does.
        empty: whether the file is empty.
    """

    path: Path
    known: Sequence[str]
    find: Callable[[str], Any]
    unlisted: Sequence[str] = ()
    headings: Mapping[str, Heading] = field(default_factory=dict)
    find_with_holes: Callable[[str], Any] | None = None
    empty: bool = False

    def column(self, name: str, *, holes: bool = False) -> np.ndarray:
        """Return the array `name`, or the signal i of a matrix for `name[i]`; raise InputError.

        With holes, there may be NaN where a row or entry does not hold it.
        """
        find = (self.find_with_holes or self.find) if holes else self.find
        if name in self.known or name in self.unlisted:
            return np.asarray(find(name))
        match = _INDEXED.fullmatch(name)
        if match is None or match["name"] not in {*self.known, *self.unlisted}:
            raise self.missing(name if match is None else match["name"] or name)
        matrix, index = np.asarray(find(match["name"])), int(match["index"])
        axis = sample_axis(matrix.shape)
        if matrix.ndim != 2 or index >= matrix.shape[1 - axis]:
            shape = " x ".join(map(str, matrix.shape))
            raise InputError(
                f"{self.path}: {match['name']} is {shape}, so there is no {name}; signals count "
                "from 0."
            )
        return matrix[:, index] if axis == 0 else matrix[index]

    def heading(self, name: str) -> Heading:
        """Return what the file says of a column, for `name[i]` what it says of the matrix."""
        match = None if name in self.headings else _INDEXED.fullmatch(name)
        whole = Heading(name) if match is None else self.headings.get(match["name"], Heading(name))
        return self.headings.get(name, whole)

    def missing(self, name: str) -> InputError:
        """Return the error for a name that is not there."""
        nothing = "nothing, it is empty; copy or record it again" if self.empty else "nothing"
        there = ", ".join(each[:_SHOWN] for each in self.known[:_SHOWN]) or nothing
        more = f" and {len(self.known) - _SHOWN} more" if len(self.known) > _SHOWN else ""
        return InputError(f"{self.path}: there is no {name}; the file holds {there}{more}.")


def sample_axis(shape: tuple[int, ...]) -> int:
    """Return along which side of a matrix the samples lie: the longer one, else the first."""
    return 1 if len(shape) == 2 and shape[1] > shape[0] else 0


def refuse_bomb(path: Path, size: int, least: int = LEAST_BYTES) -> None:
    """Raise InputError if so many bytes of numbers are more than a file of honest records holds."""
    if size > max(least, EXPANSION * path.stat().st_size):
        raise InputError(
            f"{path}: its {path.stat().st_size} bytes stand for {size:.2g} bytes of numbers, as no "
            "measured record does; write it again without compression."
        )


def unreadable(path: Path, what: str, mend: str) -> InputError:
    """Return the error for a file that is not what its name says.

    Args:
        path: the file.
        what: what it should be.
        mend: what to do, unless it is empty.
    """
    if not path.stat().st_size:
        return InputError(f"{path}: is not {what}: the file is empty; copy or record it again.")
    return InputError(f"{path}: is not {what}; {mend}.")


def is_text(path: Path) -> bool:
    """Tell whether a file begins as text of several lines, without bytes that no text holds."""
    with path.open("rb") as file:
        begin = file.read(_LOOKED_AT)
    if begin[:2] in _UTF_16:
        return True
    return bool({*b"\r\n"} & set(begin)) and not set(begin) & _NEVER_IN_TEXT


def read_text(path: Path) -> str:
    """Return the text of a file, unpacked if it ends in `.gz`; raise InputError if it is none.

    UTF-8 and UTF-16 with a mark are told; what is neither is taken for Latin-1, as loggers on
    Windows write it, unless it holds zero bytes.
    """
    content = _unpacked(path) if path.suffix.lower() == ".gz" else path.read_bytes()
    utf_16 = content[:2] in _UTF_16
    for encoding in ("utf-16",) if utf_16 else ("utf-8-sig", "latin-1"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(f"{path}: is not a text file in UTF-8.")


def _unpacked(path: Path) -> bytes:
    most = max(LEAST_BYTES, EXPANSION * path.stat().st_size)
    try:
        with gzip.open(path) as file:
            content = file.read(most + 1)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise InputError(f"{path}: is not a whole gzip file; pack it again.") from None
    refuse_bomb(path, len(content))
    return content
