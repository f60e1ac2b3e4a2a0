"""What `fjr analyze` prints: key numbers of each level, and what a reader must see."""

from __future__ import annotations

import math

from rich.console import Console

from bla_analyzer.results.findings import between_levels, findings
from bla_analyzer.results.result import Result
from bla_analyzer.results.summary import campaign, failed_checks, headline, summarize
from fjr_kit.number_text import formatted
from fjr_kit.terminal import print_table


def print_summary(result: Result, console: Console) -> None:
    """Print the key numbers of each level, and every sentence that a reader must see."""
    console.print(campaign(result), headline(result), highlight=False)
    heads, rows = _table(result)
    v = next((i for i, (name, _) in enumerate(heads) if name.startswith("V\n")), 0)
    print_table(console, heads, rows, apart=v)
    several = len(result.levels) > 1
    for level in result.levels:
        for sentence in findings(level):
            prefix = f"Level {level.level}: " if several else ""
            console.print(f"{prefix}{sentence}", highlight=False, markup=False)
    for sentence in between_levels(result):
        console.print(sentence, highlight=False, markup=False)
    for sentence in (*result.notes, *(check.sentence for check in failed_checks(result))):
        console.print(f"Note: {sentence}", highlight=False, markup=False)


def _table(result: Result) -> tuple[list[tuple[str, str]], list[list[str]]]:
    """Return a row for each level: line counts, levels in dB re 1 rad, V of each model."""
    models = [comparison.name for comparison in result.levels[0].comparisons]
    heads = [("level", ""), ("lines", ""), ("95 %\ndisc", "%")]
    heads += [(name, "dB") for name in ("linear", "total", "odd", "even", "noise")]
    heads += [(f"V\n{name.removeprefix('G0_')}", "dB\N{SUPERSCRIPT TWO}") for name in models]
    rows = []
    for level in result.levels:
        numbers = summarize(level)
        v = {comparison.name: comparison.v_mean for comparison in level.comparisons}
        in_db = (
            numbers.linear_db,
            numbers.total_db,
            numbers.odd_db,
            numbers.even_db,
            numbers.noise_db,
        )
        row = [numbers.name.removeprefix("Level "), str(numbers.lines)]
        row.append(_cell(numbers.radius_percent, ".2g"))
        row += [_cell(value, ".1f") for value in in_db]
        rows.append(row + [_cell(v.get(name, math.nan), ".3g") for name in models])
    return heads, rows


def _cell(value: float, form: str) -> str:
    return "-" if math.isnan(value) else formatted(value, form)
