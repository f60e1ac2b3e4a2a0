"""fit.html: the values that its template shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fjr_kit.page import Mark, Row, render_page

from .fit_plots import fit_plots
from .fit_types import Fit, Interval, LevelFit
from .fit_words import OUTPUT_WORDS, headline, quantities


def render_fit(fit: Fit, provenance: Mapping[str, str]) -> str:
    """Return the whole page.

    Args:
        fit: the models.
        provenance: what made the page, by name, in order.
    """
    return render_page(
        "bla_analyzer.fit",
        "fit.html",
        title=f"Model of {fit.source}",
        plots={"overview": {}, "levels": [fit_plots(level) for level in fit.levels]},
        provenance={"folder": fit.source, **provenance},
        fit=fit,
        headline=headline(fit),
        bad=not all(level.test.passed for level in fit.levels),
        findings=[(level.name, level.findings) for level in fit.levels],
        names=[level.name for level in fit.levels],
        quantities=[[_row(name, one) for name, one in quantities(level)] for level in fit.levels],
        roots=[_roots(level) for level in fit.levels],
        orders=[_orders(level) for level in fit.levels],
    )


def _row(name: str, one: Interval) -> Row:
    return (name, one.value, one.low, one.high, "" if one.unit == "1" else one.unit)


def _roots(level: LevelFit) -> list[Row]:
    kinds: list[tuple[str, Any]] = [("pole", level.poles)]
    kinds += [(f"zero, {OUTPUT_WORDS[one.output]}", one.zeros) for one in level.outputs]
    return [
        (
            *(what, root.re, root.im, root.std_re, root.std_im),
            *(root.frequency_hz.value, root.damping_ratio.value),
        )
        for what, roots in kinds
        for root in roots
    ]


def _orders(level: LevelFit) -> list[Row]:
    return [
        (
            f"{test.name} (chosen)" if test == level.test else test.name,
            *(float(test.parameters), test.cost, test.expected, test.low, test.high),
            *(test.aic, test.mdl),
            Mark.of(test.passed, ("yes", "no")),
        )
        for test in level.orders
    ]
