"""What `fjr compare` prints: what changed, and the tables that say so."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from fjr_compare import words
from fjr_compare.result import Comparison, Pair
from fjr_kit.number_text import unsigned_zero
from fjr_kit.page import Mark, Row
from fjr_kit.terminal import print_table

_BLA = (
    *(("level", "", ""), ("change of G", "%", ".2g"), ("clearest at", "Hz", ".4g")),
    *(("lines", "", ""), ("p", "", ".2g"), ("BLA", "", "")),
)
_POWERS = (
    *(("level", "", ""), ("power", "", ""), ("first", "dB", ".1f"), ("other", "dB", ".1f")),
    *(("change", "dB", "+.1f"), ("p", "", ".2g"), ("verdict", "", "")),
)
_PARAMETERS = (
    *(("parameter", "", ""), ("unit", "", ""), ("first", "", ".4g"), ("other", "", ".4g")),
    *(("change", "%", "+.2g"), ("from", "", "+.3g"), ("to", "", "+.3g"), ("scatter", "%", ".2g")),
    *(("p", "", ".2g"), ("verdict", "", "")),
)
_CAUSES = (("cause", "", ""), ("first", "", ""), ("other", "", ""), ("verdict", "", ""))
_GAPS = (("gap", "", ""), ("first", "%", ".3g"), ("other", "%", ".3g"))
_WORDS = ("power", "unit", "BLA", "verdict")

Heads = Sequence[tuple[str, str, str]]
"""Name, unit and format of each column; columns of words have no format."""


def print_comparison(found: Comparison, console: Console) -> None:
    """Print whether anything changed, what, and the tables of each pair."""
    _say(console, words.headline(found))
    for change in found.changes:
        _say(console, f"  {change}")
    for pair in found.pairs:
        _say(console, f"{pair.other} beside {found.first}:")
        for note in pair.notes:
            _say(console, f"Note: {note}")
        for heads, rows in _tables(pair):
            if rows:
                _table(console, heads, rows)


def _tables(pair: Pair) -> list[tuple[Heads, list[Row]]]:
    if pair.levels:
        return [(_BLA, words.level_rows(pair)), (_POWERS, words.power_rows(pair))]
    return [
        (_PARAMETERS, words.parameter_rows(pair)),
        (_CAUSES, words.cause_rows(pair)),
        (_GAPS, words.gap_rows(pair)),
    ]


def _table(console: Console, heads: Heads, rows: Sequence[Row]) -> None:
    forms = [form for _, _, form in heads]
    cells = [[_cell(c, form) for c, form in zip(row, forms, strict=True)] for row in rows]
    print_table(console, [(name, unit) for name, unit, _ in heads], cells, left=_WORDS)


def _cell(cell: object, form: str) -> str:
    if isinstance(cell, Mark):
        return cell.word
    if isinstance(cell, float):
        return unsigned_zero(format(cell, form)) if cell == cell else "-"
    return str(cell)


def _say(console: Console, text: str) -> None:
    console.print(text, highlight=False, soft_wrap=True, markup=False)
