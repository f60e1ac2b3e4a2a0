"""Structures of a file: text fields that name the data beside them, and state their unit."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .source import Heading, Names

_DATA, _NAME, _UNIT = ("data", "value", "values"), ("name", "label"), ("unit", "units")
"""Fields, in small letters."""
_LONGEST = 100
"""Most letters of a name or a unit."""
_OF_A_MAP = set(",:=")
"""What the map of columns takes for its own."""


def names_of(
    path: Path,
    columns: Sequence[str],
    texts: Mapping[str, str],
    find: Callable[[str], Any],
    units: Mapping[str, str] | None = None,
) -> Names:
    """Return the columns of a file of structures.

    A field `Data` is called what the text `Name` beside it says, and is in the `Unit` beside it.
    In an array of structures it is listed by that name, if no other has it; elsewhere the name
    serves as well as the path.

    Args:
        path: the file.
        columns: paths of its numbers, `structure.field` or `structure[0].field`.
        texts: {path of a text: what it says}.
        find: returns the array of a path.
        units: {path: unit} that are stated of it in another way.
    """
    fields = defaultdict[str, list[str]](list)
    for column in columns:
        fields[column.rpartition(".")[0]].append(column)
    said = defaultdict[str, dict[str, str]](dict)
    for place, text in texts.items():
        parent, _, field = place.rpartition(".")
        said[parent][field.lower()] = _in_a_line(text)
    headings = {each: Heading(each, _in_a_line(unit)) for each, unit in (units or {}).items()}
    for parent in fields.keys() & said.keys():
        data = [each for each in fields[parent] if each.rpartition(".")[2].lower() in _DATA]
        name = _first(said[parent], _NAME) if data else ""
        if len(data or fields[parent]) == 1:
            (column,) = data or fields[parent]
            unit = _first(said[parent], _UNIT) or headings.get(column, Heading("")).unit
            headings[column] = Heading(name or column, unit)
    times = Counter([*columns, *(each.title for at, each in headings.items() if each.title != at)])
    called = {c: each.title for c, each in headings.items() if times[each.title] == 1}
    called = {column: title for column, title in called.items() if title != column}
    listed = {
        column: title
        for column, title in called.items()
        if column.rpartition(".")[0].endswith("]") and _fits_a_map(title)
    }
    places = {title: column for column, title in called.items()}
    return Names(
        path,
        [listed.get(column, column) for column in columns],
        lambda name: find(places.get(name, name)),
        [*listed, *places],
        headings | {title: headings[column] for title, column in places.items()},
    )


def _first(texts: Mapping[str, str], fields: Sequence[str]) -> str:
    return next((texts[field] for field in fields if texts.get(field)), "")


def _in_a_line(text: str) -> str:
    """Return a text with single spaces, as a sentence takes it; empty if it is none for it."""
    line = " ".join(text.split())
    return line if line.isprintable() and len(line) <= _LONGEST else ""


def _fits_a_map(title: str) -> bool:
    return title[0] != "-" and not _OF_A_MAP & set(title)
