"""Tables in text: any of the usual delimiters and decimal marks, with or without names above."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError, shown

from .source import Heading, Names, read_text

_DELIMITERS = ("\t", ";", ",", "|", None)
"""None stands for white space."""
_COMMENTS = ("#", "%", "//", "!", "$")
_LOOKED_AT = 100
"""Lines that tell delimiter and decimal mark."""
_NOWHERE = 2**62
"""Number of a line that no file has."""
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.I)


@dataclass(frozen=True)
class _Layout:
    """How the lines are to be read."""

    delimiter: str | None
    decimal_comma: bool

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, stripped."""
        if self.delimiter is None:
            return line.split()
        line = line.strip(" \r\n")
        if '"' in line:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=self.delimiter))]
        cells = [cell.strip() for cell in line.split(self.delimiter)]
        return cells[:-1] if len(cells) > 1 and not cells[-1] else cells

    def is_number(self, cell: str) -> bool:
        """Tell whether a cell holds a number."""
        cut = self.decimal_comma and cell.endswith(",")
        return not cut and _NUMBER.fullmatch(self.plain(cell)) is not None

    def plain(self, cell: str) -> str:
        """Return a cell with a decimal point."""
        return cell.replace(",", ".", 1) if self.decimal_comma else cell

    def width(self, line: str) -> int:
        """Return how many numbers the line holds; 0 if anything in it is none."""
        cells = self.cells(line)
        return len(cells) if cells and all(map(self.is_number, cells)) else 0


_LAYOUTS = tuple(
    _Layout(d, comma) for comma in (False, True) for d in _DELIMITERS if not (comma and d == ",")
)


def open_text(path: Path) -> Names:
    """Open a table; columns without names are called 0, 1, ...; raise InputError."""
    text = read_text(path)
    first = [line for _, line in _lines(text, _LOOKED_AT)]
    layout = max(_LAYOUTS, key=lambda one: _fitness(one, first))
    start, names, units = _start(layout, text)
    places = {name: at for at, name in reversed(list(enumerate(names)))}
    numbers = [each for at in range(len(names)) for each in (str(at), f"[{at}]")]
    titled = [Heading(name, units[at] if units else "") for at, name in enumerate(names)]
    headings = {number: titled[int(number.strip("[]"))] for number in numbers}
    headings |= {name: titled[at] for name, at in places.items()}

    def find(name: str) -> np.ndarray:
        if names.count(name) > 1:
            raise InputError(
                f"{path}: the column {name} is there {names.count(name)} times; rename one, or "
                "name it by its number, counted from 0."
            )
        index = places[name] if name in places else int(name.strip("[]"))
        return _column(path, layout, text, start, index, len(names), name)

    return Names(path, names, find, numbers, headings)


def _lines(text: str, most: int | None = None) -> Iterator[tuple[int, str]]:
    """Yield (number from 1, line) of the lines that are not blank."""
    begin, number, given = 0, 0, 0
    while begin < len(text) and (most is None or given < most):
        end = text.find("\n", begin)
        end = len(text) if end < 0 else end
        number += 1
        line = text[begin:end]
        begin = end + 1
        if line.strip():
            given += 1
            yield number, line


def _fitness(layout: _Layout, lines: list[str]) -> tuple[int, int, int, int]:
    """Return how well a layout fits: rows of one width, columns, names above, how common it is."""
    widths = [layout.width(line) for line in lines]
    usual = max(set(widths), key=lambda w: (bool(w), widths.count(w), w), default=0)
    named = max((len(layout.cells(line.strip().lstrip("#%/! "))) for line in lines[:1]), default=0)
    return (widths.count(usual) if usual else 0, usual, named, -_LAYOUTS.index(layout))


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENTS)


def _start(layout: _Layout, text: str) -> tuple[int, list[str], list[str]]:
    """Return the number of the first line of numbers, the names of the columns, and their units.

    The names stand in one of the two lines above, the other may hold units, else none are
    returned; without names the columns are numbered. A line above in which some cells are numbers
    is a damaged row.
    """
    above: list[tuple[int, list[str], bool]] = []
    for number, line in _lines(text, _LOOKED_AT):
        width = layout.width(line)
        if not width:
            bare = line.strip().lstrip("#%/! ")
            names = [cell.strip("# %") for cell in layout.cells(bare)]
            above = [*above[-1:], (number, names, _is_comment(line))]
            continue
        fitting = [each for each in above if len(each[1]) == width]
        for row, names, comment in fitting:
            if not comment and any(map(layout.is_number, names)):
                return row, [str(index) for index in range(width)], []
        if fitting:
            return number, fitting[0][1], fitting[1][1] if len(fitting) > 1 else []
        if above and not above[0][2] and layout.delimiter is not None and len(above[0][1]) > 1:
            return number, above[0][1], []  # the rows are said to be too short or too long
        return number, [str(index) for index in range(width)], []
    return _NOWHERE, above[0][1] if above else [], []


def _column(
    path: Path, layout: _Layout, text: str, start: int, index: int, columns: int, name: str
) -> np.ndarray:
    """Return one column; raise InputError that names the line."""
    values = []
    for number, line in _lines(text):
        if number < start or _is_comment(line):
            continue
        cells = layout.cells(line)
        if len(cells) != columns:
            raise InputError(
                f"{path}: line {number} has {len(cells)} columns, not {columns}; repair or cut it."
            )
        try:
            values.append(float(layout.plain(cells[index])))
        except ValueError:
            raise InputError(
                f"{path}: line {number}: {shown(cells[index])} in column {name} is not a number; "
                "repair or cut it."
            ) from None
    if not values:
        raise InputError(f"{path}: holds no numbers below the line of names.")
    return np.array(values)
