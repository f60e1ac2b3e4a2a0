"""Tables in text: any of the usual delimiters and decimal marks, with or without names above."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError, shown

from .clock_stamps import STAMPS_READ, has_clock, is_stamp, rejoined, since
from .source import Heading, Names, read_text
from .table_head import LONGEST_UNIT, Head, head_of, unit_in

_DELIMITERS = ("\t", ";", ",", "|", None)
"""None stands for white space."""
_COMMENTS = ("#", "%", "//", "!", "$")
_LOOKED_AT = 100
"""Lines that tell delimiter and decimal mark."""
_LABVIEW = "Comment"
"""Name of a last column in LabVIEW's measurement files, whose rows say nothing there."""
_PROSE = 3
"""Lines above a table that may name its columns though they are comments, or white space parts
them: further up such lines are prose."""
_MOST_COLUMNS = 100_000
_NOWHERE = 2**62
"""Number of a line that no file has."""
_NUMBER = re.compile(
    r"[+-]?(\d+(\.\d*)?|\.\d+)([ed][+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.I | re.ASCII
)
_WITH_UNIT = re.compile(r"(?P<number>[-+\d.,eE]*\d[.,]?)\s*(?P<unit>[^\d\s.,+-]\D*)", re.ASCII)


@dataclass(frozen=True)
class _Layout:
    """How the lines are to be read."""

    delimiter: str | None
    decimal_comma: bool

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line, stripped."""
        if self.delimiter is None:
            return rejoined(line.split()) if ":" in line else line.split()
        line = line.strip(" \r\n")
        cells = line.split(self.delimiter)
        if '"' in line and line.count('"') % 2 == 0:  # else one has no end, and is none
            with suppress(csv.Error):  # a cell that is longer than any
                cells = next(csv.reader([line], delimiter=self.delimiter))
        return [cell.strip() for cell in cells]

    def is_number(self, cell: str) -> bool:
        """Tell whether a cell holds a number."""
        cut = self.decimal_comma and cell.endswith(",")
        return not cut and _NUMBER.fullmatch(self.plain(cell)) is not None

    def plain(self, cell: str) -> str:
        """Return a cell with a decimal point."""
        return cell.replace(",", ".", 1) if self.decimal_comma else cell

    def value(self, cell: str) -> float:
        """Return the number of a cell; raise ValueError if there is none."""
        plain = self.plain(cell)
        return float(plain.replace("D", "E").replace("d", "e") if "d" in plain.lower() else plain)

    def has_unit(self, cell: str) -> bool:
        """Tell whether a cell holds a number with a unit behind it."""
        short = len(cell) <= 2 * LONGEST_UNIT
        parts = _WITH_UNIT.fullmatch(cell) if short else None
        return (
            parts is not None and self.is_number(parts["number"]) and bool(unit_in(parts["unit"]))
        )

    def holds(self, cell: str) -> bool:
        """Tell whether a cell holds a number, or a stamp of calendar and clock.

        A unit behind a number is no obstacle here: it is refused when the column is read.
        """
        return self.is_number(cell) or is_stamp(cell) or self.has_unit(cell)


@dataclass(frozen=True)
class _Grid:
    """The cells of a table: how many a row has, and in which columns most of them are numbers.

    Other columns may hold anything, or nothing: the mode of a drive, a status in hexadecimals.
    """

    layout: _Layout
    width: int
    numbers: tuple[int, ...]

    @classmethod
    def of(cls, layout: _Layout, lines: Sequence[str]) -> _Grid:
        """Return the grid by which most of some lines hold numbers."""
        rows = [layout.cells(line) for line in lines if not _is_comment(line)]
        held = [[layout.holds(cell) for cell in row] for row in rows]
        counts = Counter(len(row) for row in held if any(row))
        if not counts:
            return cls(layout, 0, ())
        width = max(counts, key=lambda w: (counts[w], w))
        fitting = [row for row in held if len(row) == width]
        rows_of_table = fitting[len(fitting) // 2 :]  # the lines above it may hold numbers, too
        often = [2 * sum(of) >= len(rows_of_table) for of in zip(*rows_of_table, strict=True)]
        return cls(layout, width, tuple(np.flatnonzero(often)))

    def is_row(self, cells: Sequence[str]) -> bool:
        """Tell whether cells are those of a row of numbers, of which some may be missing."""
        if len(cells) != self.width or not self.numbers:
            return False
        of_numbers = [cells[at] for at in self.numbers]
        there = [cell for cell in of_numbers if cell]
        return bool(there) and all(map(self.layout.holds, there))

    def fitness(self, lines: Sequence[str]) -> tuple[float, ...]:
        """Return how well it fits lines: rows, names above, numbers in a row, how common it is."""
        found = [self.is_row(self.layout.cells(line)) for line in lines]
        first = found.index(True) if any(found) else 1
        above = [self.layout.cells(_uncommented(line)) for line in lines[:first]]
        headed = self.width > 1 and any(len(names) == self.width for names in above[-2:])
        share = len(self.numbers) / max(self.width, 1)
        named = max(map(len, above), default=0)
        parted = any(found) and self.layout.delimiter is not None
        rank = -_LAYOUTS.index(self.layout)
        return sum(found), headed, len(self.numbers), share, parted, named, rank


_LAYOUTS = tuple(_Layout(d, comma) for comma in (False, True) for d in _DELIMITERS)
"""The likeliest first. Of numbers with a decimal comma a comma parts those in quotes alone."""


def open_text(path: Path) -> Names:
    """Open a table; columns without names are called 0, 1, ...; raise InputError."""
    text = read_text(path)
    if "\n" not in text:
        text = text.replace("\r", "\n")  # ends of lines as on old Macs
    first = [line for _, line in _lines(text, _LOOKED_AT)]
    if max((_columns_at_most(line) for line in first), default=0) > _MOST_COLUMNS:
        raise InputError(
            f"{path}: a line has more than {_MOST_COLUMNS} columns; a row is one sample, so "
            "turn the table."
        )
    grid = max((_Grid.of(one, first) for one in _LAYOUTS), key=lambda one: one.fitness(first))
    layout = grid.layout
    start, head = _start(grid, text)
    names, units = head.names, head.units
    places = {**head.others, **{name: at for at, name in reversed(list(enumerate(names)))}}
    numbers = [each for at in range(len(names)) for each in (str(at), f"[{at}]")]
    stamps = _stamps(layout, text, start)
    origin = next(iter(stamps.values()), "")
    units = ["s" if at in stamps else "".join(units[at : at + 1]) for at in range(len(names))]
    titled = [Heading(name, unit) for name, unit in zip(names, units, strict=True)]
    headings = {number: titled[int(number.strip("[]"))] for number in numbers}
    headings |= {name: titled[at] for name, at in places.items()}

    times = Counter(names)
    twice = {name for name, number in times.items() if number > 1}
    listed = [str(at) if name in twice else name for at, name in enumerate(names)]

    def find(name: str, *, holes: bool = False) -> np.ndarray:
        if name in twice:
            raise InputError(
                f"{path}: the column {name} is there {times[name]} times; rename one, or "
                "name it by its number, counted from 0."
            )
        index = places[name] if name in places else int(name.strip("[]"))
        columns = len(names)
        return _column(path, layout, text, start, index, columns, name, origin=origin, holes=holes)

    unlisted = [*numbers, *twice, *head.others]
    with_holes = partial(find, holes=True)
    return Names(path, listed, find, unlisted, headings, with_holes, empty=not text.strip())


def _columns_at_most(line: str) -> int:
    """Return how many cells a line has by the delimiter that makes most of it."""
    return max(len(line.split()) if d is None else line.count(d) + 1 for d in _DELIMITERS)


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


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENTS)


def _uncommented(line: str) -> str:
    line = line.strip(" \r\n")
    return line.lstrip("#%/! ") if _is_comment(line) else line


def _start(grid: _Grid, text: str) -> tuple[int, Head]:
    """Return the number of the first line of numbers, and what the lines above call the columns.

    A line right above that begins with a number is a damaged row.
    """
    layout, above = grid.layout, list[tuple[int, list[str], bool]]()
    for number, line in _lines(text, _LOOKED_AT):
        if grid.is_row(layout.cells(line)) and not _is_comment(line):
            break
        cells = [cell.strip("# %") for cell in layout.cells(_uncommented(line))]
        cells = cells[:-1] if cells[-1:] in ([_LABVIEW], [""]) else cells
        above.append((number, cells, _is_comment(line)))
    else:
        return _NOWHERE, Head(above[-2:][0][1] if above else [])
    columns = grid.width - (not layout.cells(line)[-1])  # without one after the last delimiter
    widths = (columns, grid.width)
    while above and not above[-1][2] and len(above[-1][1]) in widths:
        if not layout.holds(above[-1][1][grid.numbers[0]]):
            break
        number = above.pop()[0]
    nearest = above[-_PROSE:]
    lines = [one for one in above if one in nearest or (layout.delimiter and not one[2])]
    head = head_of([cells for _, cells, _ in lines], widths, layout.is_number)
    last = above[-2:]
    if not head.names and last and not last[0][2] and layout.delimiter and len(last[0][1]) > 1:
        return number, Head(last[0][1])  # the rows are said to be too short or too long
    return number, head if head.names else Head(list(map(str, range(columns))))


def _stamps(layout: _Layout, text: str, start: int) -> dict[int, str]:
    """Return the stamps of calendar and clock in the first line of numbers, by their columns."""
    for number, line in _lines(text):
        if number >= start and not _is_comment(line):
            return {at: cell for at, cell in enumerate(layout.cells(line)) if is_stamp(cell)}
    return {}


def _column(
    path: Path,
    layout: _Layout,
    text: str,
    start: int,
    index: int,
    columns: int,
    name: str,
    *,
    origin: str,
    holes: bool,
) -> np.ndarray:
    """Return one column, stamps in s from the origin; raise InputError that names the line.

    With holes, an empty cell is NaN.
    """
    values, begun = list[float](), False
    read: Callable[[str], float] = layout.value
    kind = "number"
    for number, line in _lines(text):
        if number < start or _is_comment(line):
            continue
        cells = layout.cells(line)
        if len(cells) == columns + 1 and not cells[-1]:
            cells = cells[:-1]
        if len(cells) != columns:
            raise InputError(
                f"{path}: line {number} has {len(cells)} columns, not {columns}; repair or cut it."
            )
        cell = cells[index]
        if holes and not cell:
            values.append(math.nan)
            continue
        try:
            if not begun and is_stamp(cell):
                read, kind = since(origin or cell), "stamp of calendar and clock"
            begun = True
            values.append(read(cell))
        except ValueError:
            mend = "repair or cut it"
            if layout.has_unit(cell):
                mend = "write the unit in the name of the column, not in each cell"
            elif has_clock(cell):
                mend = STAMPS_READ
            raise InputError(
                f"{path}: line {number}: {shown(cell)} in column {name} is not a {kind}; {mend}."
            ) from None
    if not values:
        raise InputError(f"{path}: holds no numbers below the line of names.")
    return np.array(values)
