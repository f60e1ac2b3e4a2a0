"""Tables of limits and faults for the document: `python -m fjr_bringup.rehearsal.tables`.

`python -m fjr_bringup.rehearsal.tables docs/rehearsal.md` puts them between the document's marks.
"""

from __future__ import annotations

from fjr_interface.parameters import Parameter
from fjr_kit.document_tables import renew
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


TABLES = {"limits": limits_table(), "faults": faults_table()}

if __name__ == "__main__":
    renew(TABLES)
