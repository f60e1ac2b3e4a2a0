"""Tables that the code writes into a document, each between two marks of its name."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path


def in_step(document: str, tables: Mapping[str, str]) -> str:
    """Return a document with the present tables, by name, between their marks.

    Raises:
        ValueError: the document lacks the marks of a table.
    """
    for name, table in tables.items():
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        before, begun, rest = document.partition(begin)
        _, ended, after = rest.partition(end)
        if not begun or not ended:
            raise ValueError(f"the document lacks the marks {begin} and {end}")
        document = f"{before}{begin}\n\n{table}\n\n{end}{after}"
    return document


def renew(tables: Mapping[str, str]) -> None:
    """Renew the tables of the document that the command line names, or print them."""
    if len(sys.argv) < 2:
        print(*tables.values(), sep="\n\n")
        return
    path = Path(sys.argv[1])
    path.write_text(in_step(path.read_text(encoding="utf-8"), tables), encoding="utf-8")
