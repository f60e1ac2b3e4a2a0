"""compare.html: the values that its template `compare_page.html` shows."""

from __future__ import annotations

from collections.abc import Mapping

from fjr_kit.page import render_page

from . import words
from .compare_plots import place, plots, shown
from .result import Comparison


def render(found: Comparison, provenance: Mapping[str, str]) -> str:
    """Return the whole page.

    Args:
        found: the comparison.
        provenance: what made the page, by name, in order.
    """
    pairs = [
        {
            "name": pair.other,
            "notes": pair.notes,
            "levels": words.level_rows(pair),
            "powers": words.power_rows(pair),
            "parameters": words.parameter_rows(pair),
            "causes": words.cause_rows(pair),
            "gaps": words.gap_rows(pair) if found.kind == "diagnoses" else [],
            "blas": [(place(number, i), level.name) for i, level in enumerate(pair.levels)],
            "forest": (place(number), 34 * len(shown(pair)) + 110) if shown(pair) else None,
        }
        for number, pair in enumerate(found.pairs)
    ]
    others = ", ".join(pair.other for pair in found.pairs)
    return render_page(
        "fjr_compare",
        "compare_page.html",
        title=f"{others} beside {found.first}",
        plots={"overview": plots(found), "levels": [{}]},
        provenance=provenance,
        found=found,
        headline=words.headline(found),
        pairs=pairs,
    )
