"""Lines above a table of numbers: names of its columns, their units, and what else stands there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from .import_map import UNITS
from .stated_units import stated_unit

_ALL_UNITS = {unit: factor for units in UNITS.values() for unit, factor in units.items()}
LONGEST_UNIT = 40
"""Characters of a cell that may state a unit."""
MOST_COLUMNS = 1000
"""Columns of a table in whose cells units are sought."""
_LABELS = ("unit", "einheit")
"""What a cell holds that only says that its line is one of units."""
_OPENING, _CLOSING = ("[", "(", "{", "<"), ("]", ")", "}", ">")


@dataclass(frozen=True)
class Head:
    """What the lines above a table say of its columns.

    Attributes:
        names: of the columns; a column whose name is a number, or nothing, goes by its number.
        units: of each column, as a line other than the names states it; empty where none does.
        others: {what another line calls a column: its number}, of what stands there once.
    """

    names: list[str]
    units: list[str] = field(default_factory=list)
    others: Mapping[str, int] = field(default_factory=dict)


def head_of(
    above: Sequence[list[str]], widths: Sequence[int], is_number: Callable[[str], bool]
) -> Head:
    """Return what the lines above a table say of its columns; without names if none fits.

    The names are the line with most different cells, the first of such; a line of units only where
    there is no other.

    Args:
        above: the cells of each line above the table.
        widths: how many cells a line that fits may have; the first leaves out an empty last column.
        is_number: tells whether a cell holds a number.
    """
    rows = [row for row in (_fitting(cells, widths) for cells in above) if row]
    rows = rows or _with_values(above, widths[0], is_number)
    if not rows:
        return Head([])
    named = [row for row in rows if not _is_of_units(row)] or rows
    names = max(named, key=lambda row: _different(row, is_number))
    place = next(at for at, row in enumerate(rows) if row is names)
    rest = rows[:place] + rows[place + 1 :]
    units = [""] * len(names)
    for at, row in sorted(enumerate(rest), key=lambda one: _is_of_units(one[1])):
        below = at >= place and _is_of_units(row)  # there also what is no unit that is known
        found = [unit_in(cell) or _unlabelled(cell) * below for cell in row[:MOST_COLUMNS]]
        units[: len(found)] = [new or old for new, old in zip(found, units, strict=False)]
    times = Counter(cell for row in rest for cell in row)
    taken = {"", *names}
    others = {
        cell: at
        for row in rest
        for at, cell in enumerate(row[: len(names)])
        if times[cell] == 1 and cell not in taken and not is_number(cell)
    }
    called = [str(at) if is_number(cell) else cell or str(at) for at, cell in enumerate(names)]
    return Head(called, units, others)


def unit_in(cell: str) -> str:
    """Return the unit that a cell is, or that ends it in brackets; empty if there is none.

    It may be that of another quantity than a rig's: A, V, counts.
    """
    if len(cell) > LONGEST_UNIT:
        return ""
    return _alone(cell) or (stated_unit(cell, "", _ALL_UNITS) if cell.endswith(_CLOSING) else "")


def _unlabelled(cell: str) -> str:
    """Return a cell of a line of units; empty if it only says that this is one."""
    return "" if any(label in cell.lower() for label in _LABELS) else cell


@lru_cache(maxsize=2**16)
def _alone(cell: str) -> str:
    """Return the unit that a cell is, perhaps in brackets; empty if it is none that is known."""
    short = cell[1:-1] if cell.startswith(_OPENING) and cell.endswith(_CLOSING) else cell
    return stated_unit(f"- ({short})", "", _ALL_UNITS) if len(short) <= LONGEST_UNIT else ""


def _different(row: list[str], is_number: Callable[[str], bool]) -> tuple[int, int]:
    """Return how many different cells a line has, and how many of them are no numbers."""
    cells = set(row) - {""}
    return len(cells), sum(not is_number(cell) for cell in cells)


def _is_of_units(row: list[str]) -> bool:
    """Tell whether at least half of the cells of a line that hold anything are units."""
    filled = [cell for cell in row[:MOST_COLUMNS] if cell]
    return 0 < len(filled) <= 2 * sum(bool(_alone(cell)) for cell in filled)


def _fitting(cells: list[str], widths: Sequence[int]) -> list[str]:
    """Return the cells of a line that fits, each after its label alone: empty if it does not fit.

    TwinCAT writes the label of a line before each channel, though one time column serves all.
    """
    if len(cells) in widths:
        return cells
    labelled = len(cells) > 2 and len(set(cells[::2])) == 1
    once = [cells[0], *cells[1::2]] if labelled else []
    return once if len(once) in widths else []


def _with_values(
    above: Sequence[list[str]], columns: int, is_number: Callable[[str], bool]
) -> list[list[str]]:
    """Return the last two lines, cut to the columns, if further names have a value in the second.

    Rigol writes the begin and the step of the time there.
    """
    if len(above) < 2 or not columns < len(above[-2]) == len(above[-1]):
        return []
    if not all(map(is_number, above[-1][columns:])):
        return []
    return [cells[:columns] for cells in above[-2:]]
