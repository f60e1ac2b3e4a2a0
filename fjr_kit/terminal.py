"""Tables on a terminal of any width: no value is ever cut."""

from __future__ import annotations

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text


def print_table(
    console: Console,
    heads: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[str]],
    left: Sequence[str] = (),
    apart: int = 0,
) -> None:
    """Print a table; where it is wider than the terminal, each row as a block of lines instead.

    Args:
        console: where to.
        heads: name (of one or more lines) and unit of each column, the unit empty if it has none.
        rows: cells in the order of `heads`.
        left: names of the columns after the first that hold words; the others hold numbers.
        apart: the column from which on a table that is too wide becomes a second one with the first
            column again, if both then fit; 0 for never.
    """
    first = range(len(heads))
    for split in ([first], [range(apart), (0, *first[apart:])] if apart else []):
        tables = [
            _table([heads[i] for i in part], [[row[i] for i in part] for row in rows], left)
            for part in split
        ]
        if tables and all(_width(console, table) <= console.width for table in tables):
            for table in tables:
                console.print(table)
            return
    _print_blocks(console, heads, rows)


def _table(
    heads: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]], left: Sequence[str]
) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for index, (name, unit) in enumerate(heads):
        words = index == 0 or name in left
        title = f"{name}\n[{unit}]" if unit else name
        table.add_column(Text(title), justify="left" if words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _width(console: Console, table: Table) -> int:
    return console.measure(table, options=console.options.update(max_width=10**6)).maximum


def _print_blocks(
    console: Console, heads: Sequence[tuple[str, str]], rows: Sequence[Sequence[str]]
) -> None:
    labels = [name.replace("\n", " ") for name, _ in heads]
    width = max(map(len, labels))
    for row in rows:
        console.print()
        console.print(Text(f"{labels[0]} {row[0]}".strip(), style="bold"), overflow="fold")
        for label, (_, unit), cell in zip(labels[1:], heads[1:], row[1:], strict=True):
            value = f"{cell} {unit}".rstrip() if cell not in ("", "-") else "-"
            line = Text(f"  {label:<{width}}  {value}")
            console.print(line if len(line) <= console.width else Text(f"  {label}: {value}"))
    console.print()
