"""Tables of limits and faults for the document: `python -m fjr_bringup.rehearsal.tables`.

`python -m fjr_bringup.rehearsal.tables docs/rehearsal.md` puts them between the document's marks.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from fjr_interface.parameters import Parameter
from fjr_sim_node.drive.faults import CATALOGUE, Fault

from .limits import LIMITS


def limits_table() -> str:
    """Return the table of all limits."""
    lines = ["| limit | unit | default | of what |", "|---|---|---|---|"]
    lines += [
        f"| `{limit.name}` | {limit.unit} | {_value(limit)} | {limit.description} |"
        for limit in LIMITS
    ]
    return "\n".join(lines)


def faults_table() -> str:
    """Return the table of all faults."""
    lines = [
        "| fault and its parameters | what happens | safe state | within | check |",
        "|---|---|---|---|---|",
    ]
    return "\n".join([*lines, *map(_fault_row, CATALOGUE)])


def _fault_row(fault: Fault) -> str:
    parameters = "; ".join(
        f"`{each.name}` {_value(each)}{f' {each.unit}' if each.unit else ''}"
        for each in fault.parameters
        if each.name != "after_s"
    )
    cells = [
        f"**`{fault.identifier}`**" + (f" ({parameters})" if parameters else ""),
        fault.summary,
        fault.safe_state,
        f"{fault.within_s:g} s",
        f"`{fault.finding}`",
    ]
    return f"| {' | '.join(cells)} |"


def _value(parameter: Parameter) -> str:
    if isinstance(parameter.default, str):
        return " or ".join(parameter.choices)
    return f"{parameter.default:g}".replace("inf", "none")


TABLES: dict[str, Callable[[], str]] = {"limits": limits_table, "faults": faults_table}


def in_step(document: str) -> str:
    """Return a document with the present tables between their marks."""
    for name, table in TABLES.items():
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        before, found, rest = document.partition(begin)
        _, closed, after = rest.partition(end)
        if not found or not closed:
            raise ValueError(f"the document lacks the marks {begin} and {end}")
        document = f"{before}{begin}\n\n{table()}\n\n{end}{after}"
    return document


if __name__ == "__main__":
    if len(sys.argv) > 1:
        path = Path(sys.argv[1])
        path.write_text(in_step(path.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        for make in TABLES.values():
            print(make(), end="\n\n")
