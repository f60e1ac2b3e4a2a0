"""JSON logs: an object of lists, a list of entries somewhere in it, or one entry on each line."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from fjr_kit.errors import InputError, shown

from .source import Names, read_text, refuse_bomb

_BYTES_OF_A_NODE, _LEAST = 80, 2**28
"""What a value takes in memory once it is parsed, and what any file may take."""
_BATCH = 1000
"""Lines that are parsed at once."""
_SHOWING = 100
"""Entries of a list that show which columns it has."""


def open_json(path: Path) -> Names:
    """Open a JSON log; raise InputError.

    A column is named by its path: `entries.position` is the field `position` of each object in the
    list `entries`, `entries[1]` the second number of each row in it; `position` alone is the field
    of entries that are the file itself, or stand on a line each.
    """
    text = read_text(path)
    refuse_bomb(path, _BYTES_OF_A_NODE * sum(map(text.count, ",[{")), _LEAST)
    content = _parse(path, text)
    if isinstance(content, dict) and not any(isinstance(v, (dict, list)) for v in content.values()):
        content = [content]  # one entry, alone on its line
    words = _known(content, words=True)

    def find(name: str, *, holes: bool = False) -> np.ndarray:
        return _column(path, content, name, holes=holes)

    return Names(path, _known(content), find, words, find_with_holes=partial(find, holes=True))


def _parse(path: Path, text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        lines = (found.group() for found in re.finditer(r"\S[^\n]*", text))
        first = next(lines, "")
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


def _known(content: Any, prefix: str = "", *, words: bool = False) -> list[str]:
    """Return the paths of all columns, of words if asked, as the first entries of lists show."""
    if isinstance(content, dict):
        inside = [_known(value, _under(prefix, key), words=words) for key, value in content.items()]
        return [path for paths in inside for path in paths]
    if not isinstance(content, list) or not content:
        return []
    entries = [entry for entry in content[:_SHOWING] if isinstance(entry, dict)]
    if not entries:
        return [prefix]
    fields: dict[str, None] = {}
    for entry in entries:
        fields |= dict.fromkeys(_fields(entry, prefix, words=words))
    return list(fields)


def _fields(entry: dict[str, Any], prefix: str, *, words: bool) -> list[str]:
    """Return the paths of the fields of an entry, and of those inside them."""
    found = []
    for key, value in entry.items():
        path = _under(prefix, key)
        if isinstance(value, dict):
            found += _fields(value, path, words=words)
        elif words or not isinstance(value, str):
            found.append(path)
    return found


def _under(prefix: str, key: str) -> str:
    return f"{prefix}.{key}" if prefix else key


def _column(path: Path, content: Any, name: str, *, holes: bool) -> np.ndarray:
    """Return the column of a path; every entry must have a number, or a row of them.

    With holes, an entry may have nothing, which is NaN.
    """
    keys = name.split(".") if name else []
    values = list(_walk(path, content, keys, name, holes=holes))
    try:
        column = np.array(values[0] if len(values) == 1 else values)
    except ValueError:
        raise InputError(f"{path}: {name} has rows of different lengths.") from None
    if column.dtype.kind in "fiub":
        return column
    for at, value in enumerate(values[0] if len(values) == 1 else values):
        if not isinstance(value, (int, float, list)):
            raise InputError(f"{path}: {name} is {shown(value)} in entry {at}, not a number.")
    raise InputError(f"{path}: {name} does not hold real numbers; choose another column.")


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
