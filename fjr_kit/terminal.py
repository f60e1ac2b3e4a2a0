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
) -> None:
    """Print a table; where it is wider than the terminal, each row as a block of lines instead.

    Args:
        console: where to.
        heads: name (of one or more lines) and unit of each column, the unit empty if it has none.
        rows: cells in the order of `heads`.
        left: names of the columns after the first that hold words; the others hold numbers.
    """
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for index, (name, unit) in enumerate(heads):
        words = index == 0 or name in left
        title = f"{name}\n[{unit}]" if unit else name
        table.add_column(Text(title), justify="left" if words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))
    unlimited = console.options.update(max_width=10**6)
    if console.measure(table, options=unlimited).maximum <= console.width:
        console.print(table)
    else:
        _print_blocks(console, heads, rows)


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
