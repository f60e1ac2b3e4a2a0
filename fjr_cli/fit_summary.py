"""What `fjr fit` prints: quantities with intervals of each level, and what a reader must see."""

from __future__ import annotations

from rich.console import Console

from bla_analyzer.fit.fit_types import Fit
from bla_analyzer.fit.fit_words import headline, quantities
from fjr_kit.terminal import print_table


def print_fit(fit: Fit, console: Console) -> None:
    """Print quantities with their intervals, and every sentence that a reader must see."""
    console.print(headline(fit), highlight=False)
    for level in fit.levels:
        order = "" if level.parameters else f", order {level.test.name}"
        console.print(f"\n{level.name}{order}", highlight=False, markup=False)
        rows = [
            [
                name if one.unit in ("", "1") else f"{name} ({one.unit})",
                *(f"{value:.5g}" for value in (one.value, one.low, one.high)),
            ]
            for name, one in quantities(level)
        ]
        print_table(console, [("quantity", ""), ("value", ""), ("from", ""), ("to", "")], rows)
        for sentence in level.findings:
            console.print(sentence, highlight=False, markup=False)
    for sentence in fit.between_levels:
        console.print(sentence, highlight=False, markup=False)
