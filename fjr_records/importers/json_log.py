"""JSON logs: an object of lists, a list of entries somewhere in it, or one entry on each line."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError, shown

from .clock_stamps import is_stamp, since
from .source import Heading, Names, read_text, refuse_bomb

_BYTES_OF_A_NODE, _LEAST = 80, 2**28
"""What a value takes in memory once it is parsed, and what any file may take."""
_BATCH = 1000
"""Lines that are parsed at once."""
_SHOWING = 100
"""Entries of a list that show which columns it has."""
_ROS_STAMPS = (("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"))
"""Fields of stamps as ROS 2, Foxglove and ROS 1 write them."""


def open_json(path: Path) -> Names:
    """Open a JSON log; raise InputError.

    A column is named by its path: `entries.position` is the field `position` of each object in the
    list `entries`, `entries[1]` the second number of each row in it; `position` alone is the field
    of entries that are the file itself, or stand on a line each. A stamp of ROS is named by what
    holds its `sec` and `nanosec`.
    """
    text = read_text(path)
    refuse_bomb(path, _BYTES_OF_A_NODE * sum(map(text.count, ",[{")), _LEAST)
    content = _parse(path, text)
    if isinstance(content, dict) and not any(isinstance(v, (dict, list)) for v in content.values()):
        content = [content]  # one entry, alone on its line
    content = _of_pandas(content)
    log = _Log(path, content)
    found = _found(content)
    in_s = {name: Heading(name, "s") for name, value in found.items() if _is_stamp(value)}
    known = [
        name
        for name, value in found.items()
        if _may_be_number(value) and name.rpartition(".")[0] not in in_s
    ]
    with_holes = partial(log.column, holes=True)
    return Names(path, known, log.column, list(found), in_s, with_holes)


def _parse(path: Path, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        lines = (found.group() for found in re.finditer(r"\S[^\n]*", text))
        first = next(lines, "")
        if not first:
            raise InputError(
                f"{path}: is not JSON: the file is empty; copy or record it again."
            ) from None
        if first[:1] not in ("{", "[") or next(lines, None) is None:
            raise InputError(f"{path}: is not JSON ({_what(error)}).") from None
    lines = (found.group() for found in re.finditer(r"\S[^\n]*", text))
    entries: list[Any] = []
    while batch := list(islice(lines, _BATCH)):
        entries += _batch(path, batch, len(entries) + 1)
    return entries


def _batch(path: Path, lines: list[str], number: int) -> list[Any]:
    """Return the entries of some lines, which share the names of their fields in memory."""
    try:
        entries = json.loads(f"[{','.join(lines)}]")
        if len(entries) == len(lines):
            return entries
    except ValueError:
        pass
    return [_line(path, number + at, line) for at, line in enumerate(lines)]


def _line(path: Path, number: int, line: str) -> Any:
    try:
        return json.loads(line)
    except ValueError as error:
        raise InputError(f"{path}: is not JSON: entry {number} ({_what(error)}).") from None


def _what(error: ValueError) -> str:
    return str(error).splitlines()[0].rstrip(".")[:80]


def _of_pandas(content: Any) -> Any:
    """Return columns that pandas wrote, {column: {row: value}}, as lists, and anything else as is.

    Rows that are not called 0, 1, ... are a column of their own, `index`: often the time.
    """
    columns = list(content.values()) if isinstance(content, dict) else []
    if not columns or not all(isinstance(column, dict) for column in columns):
        return content
    rows = list(columns[0])
    if not rows or not all(is_stamp(row) or _is_number(row) for row in rows):
        return content
    if any(list(column) != rows for column in columns[1:]):
        return content
    if any(isinstance(each, (dict, list)) for column in columns for each in column.values()):
        return content
    index = {} if rows == [str(at) for at in range(len(rows))] else {"index": rows}
    return {**index, **{name: list(column.values()) for name, column in content.items()}}


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _is_ros_stamp(value: Any) -> bool:
    """Tell whether a value is a stamp of ROS: {"sec": 1, "nanosec": 500}."""
    return _ros_stamp(value) is not None


def _ros_stamp(value: Any) -> tuple[int, int] | None:
    """Return s and ns of a stamp of ROS; None if a value is none."""
    if isinstance(value, dict):
        for names in _ROS_STAMPS:
            whole, rest = map(value.get, names)
            if type(whole) is int and type(rest) is int:
                return whole, rest
    return None


def _since_ros_stamp(first: Any, value: Any) -> float:
    """Return the time from the second in which one stamp was taken to another (s)."""
    begun, stamp = _ros_stamp(first), _ros_stamp(value)
    if begun is None or stamp is None:
        raise ValueError(value)
    return stamp[0] - begun[0] + 1e-9 * stamp[1]


def _number(value: Any) -> Any:
    """Return a number, or what holds some, also of a word in quotes; raise ValueError for none."""
    if isinstance(value, str):
        return float(value)
    if isinstance(value, (int, float, list)):
        return value
    raise ValueError(value)


def _is_hole(value: Any) -> bool:
    return value is None or value == [] or value != value


def _is_clock_stamp(value: Any) -> bool:
    return isinstance(value, str) and is_stamp(value)


def _inside(value: Any) -> Iterator[Any]:
    """Yield a value and all in it, in the order of the file."""
    yield value
    for each in value.values() if isinstance(value, dict) else value:
        if isinstance(each, (dict, list)):
            yield from _inside(each)
        else:
            yield each


def _is_stamp(value: Any) -> bool:
    return _is_ros_stamp(value) or _is_clock_stamp(value)


def _may_be_number(value: Any) -> bool:
    return not isinstance(value, str) or is_stamp(value) or _is_number(value)


def _found(content: Any, prefix: str = "") -> dict[str, Any]:
    """Return {path: a value} of all columns, as the first entries of lists show."""
    found: dict[str, Any] = {}
    if isinstance(content, dict):
        for key, value in content.items():
            found |= _found(value, _under(prefix, key))
        return found
    first = content[:_SHOWING] if isinstance(content, list) else []
    entries = [entry for entry in first if isinstance(entry, dict)]
    if first and not entries:
        return {prefix: next((value for value in first if not _is_hole(value)), None)}
    for entry in entries:
        for path, value in _fields(entry, prefix):
            if path not in found or _is_hole(found[path]) or not _may_be_number(found[path]):
                found[path] = value
    return found


def _fields(entry: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield path and value of each field of an entry, and of those inside them."""
    for key, value in entry.items():
        path = _under(prefix, key)
        if not isinstance(value, dict) or _is_ros_stamp(value):
            yield path, value
        if isinstance(value, dict):
            yield from _fields(value, path)


def _under(prefix: str, key: str) -> str:
    return f"{prefix}.{key}" if prefix else key


@dataclass(frozen=True)
class _Log:
    """A JSON log that was parsed."""

    path: Path
    content: Any

    def column(self, name: str, *, holes: bool = False) -> np.ndarray:
        """Return the column of a path; every entry must have a number, or a row of them.

        Stamps count in s from the first one in the file. With holes, an entry may have nothing,
        which is NaN.
        """
        keys = name.split(".") if name else []
        values = list(_walk(self.path, self.content, keys, name, holes=holes))
        if len(values) == 1 and isinstance(values[0], list):
            (values,) = values
        if holes:
            width = next((len(each) for each in values if isinstance(each, list)), 0)
            refuse_bomb(self.path, 8 * width * len(values))
            hole = [math.nan] * width if width else math.nan
            values = [hole if _is_hole(each) else each for each in values]
        if not set(map(type, values)) <= {int, float, bool, list}:
            values = self._read(name, values)
        column = np.array(values, dtype=object)
        kinds = set(map(type, column.ravel()))
        if kinds <= {int, float, bool}:
            with suppress(OverflowError):  # an integer of hundreds of digits
                return column.astype(float)
        if list in kinds:
            raise InputError(f"{self.path}: {name} has rows of different lengths.")
        raise InputError(f"{self.path}: {name} does not hold real numbers; choose another column.")

    def _read(self, name: str, values: list[Any]) -> list[Any]:
        """Return stamps and words as numbers, anything else as it is."""
        there = (each for each in values if not _is_hole(each))
        read, kind = self._reader(next(there, None))
        numbers = []
        for at, value in enumerate(values):
            try:
                numbers.append(value if value != value else read(value))  # a hole is NaN
            except (TypeError, ValueError):
                raise InputError(
                    f"{self.path}: {name} is {shown(value)} in entry {at}, not a {kind}; repair or "
                    "cut the record, or choose another column."
                ) from None
        return numbers

    def _reader(self, first: Any) -> tuple[Callable[[Any], Any], str]:
        """Return what reads the values of a column that begins with a value, and their kind."""
        if _is_ros_stamp(first):
            origin = next(filter(_is_ros_stamp, _inside(self.content)))
            return partial(_since_ros_stamp, origin), "stamp of sec and nanosec"
        if _is_clock_stamp(first):
            origin = next(filter(_is_clock_stamp, _inside(self.content)))
            return since(origin), "stamp of calendar and clock"
        return _number, "number"


def _walk(
    path: Path, value: Any, keys: list[str], name: str, at: int = -1, *, holes: bool
) -> Iterator[Any]:
    """Yield the value at the end of the path, in each entry if a list is on the way.

    With holes, an entry without a value yields NaN.
    """
    for done in range(len(keys)):
        if isinstance(value, list):
            for number, entry in enumerate(value):
                yield from _walk(path, entry, keys[done:], name, number, holes=holes)
            return
        key = keys[done]
        rest = ".".join(keys[done:])
        if isinstance(value, dict) and rest in value:  # a key with a dot in it
            value = value[rest]
            break
        if not isinstance(value, dict) or key not in value:
            if holes and at >= 0:
                yield math.nan
                return
            where = f"entry {at}" if at >= 0 else "the file"
            raise InputError(f"{path}: {where} has no {name}; repair or cut the record.")
        value = value[key]
    yield math.nan if holes and value is None else value
