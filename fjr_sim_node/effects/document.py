"""The catalogue of effects as a Markdown table: `python -m fjr_sim_node.effects.document`.

`python -m fjr_sim_node.effects.document docs/effects.md` puts it between the document's marks.
"""

from __future__ import annotations

import math

from fjr_interface.parameters import Value
from fjr_kit.document_tables import renew

from . import CATALOGUE, QUANTITIES, Effect, EffectParameter


def table() -> str:
    """Return how many effects there are, and the table of all and their parameters."""
    lines = [
        f"The catalogue holds {len(CATALOGUE)} effects.",
        "",
        "| effect and parameters | unit | default | range | what it is |",
        "|---|---|---|---|---|",
    ]
    for effect in CATALOGUE:
        lines.append(_effect_row(effect))
        lines += [_parameter_row(parameter) for parameter in effect.parameters]
    return "\n".join(lines)


def _effect_row(effect: Effect) -> str:
    quantity, _ = QUANTITIES[effect.telltale.over]
    same = f" Equals {effect.same_as}." if effect.same_as else ""
    return (
        f"| **`{effect.identifier}`** | | | | {effect.summary} *Acts on: {effect.acts_on}. "
        f"Telltale: {effect.telltale.words}; drawn over {quantity}.{same}* "
        f"Source: {effect.source}. |"
    )


def _parameter_row(parameter: EffectParameter) -> str:
    name = f"`.{parameter.name}`" + (" (size)" if parameter.role in ("size", "limit") else "")
    bounds = f"{_number(parameter.low)} to {_number(parameter.high)}"
    return (
        f"| {name} | {parameter.unit} | {_number(parameter.default)} | {bounds} "
        f"| {parameter.description} |"
    )


def _number(value: Value) -> str:
    return "infinity" if value == math.inf else f"{value:g}"


TABLES = {"catalogue": table()}

if __name__ == "__main__":
    renew(TABLES)
