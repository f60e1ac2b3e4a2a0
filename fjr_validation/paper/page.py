"""report.html of `fjr paper`: one file that opens offline, with the side-by-side table on top."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from fjr_kit.page import Cell, Mark, render_page

from .part import Part, Statement

_GOOD = ("repeats", "target met")
_NEUTRAL = ("finding",)


def render(title: str, lead: str, parts: Sequence[Part], provenance: Mapping[str, str]) -> str:
    """Return the whole page.

    Args:
        title: its heading.
        lead: what was run, one sentence.
        parts: sections, in order.
        provenance: what made the report, by name.
    """
    statements = [statement for part in parts for statement in part.statements]
    plots = {place.name: place.plot for part in parts for place in part.plots}
    return render_page(
        "fjr_validation.paper",
        "paper_report.html",
        title=title,
        plots={"overview": plots, "levels": []},
        provenance=provenance,
        lead=lead,
        verdict=verdict(statements),
        statements=[(s.subject, s.paper, s.measured, _marked(s.verdict)) for s in statements],
        sections=parts,
    )


def verdict(statements: Sequence[Statement]) -> str:
    """Return how many statements of the paper came to each verdict, and how many targets are met.

    Findings are neither; every other statement is counted once.
    """
    words = Counter(one.verdict for one in statements if one.verdict not in _NEUTRAL)
    met, missed = words.pop("target met", 0), words.pop("target missed", 0)
    words["repeats"] += 0
    counts = ", ".join(f"{count} {_conjugated(word, count)}" for word, count in words.items())
    return (
        f"Of {words.total()} statements of the paper {counts}; {met} of {met + missed} targets are "
        "met."
    )


def _conjugated(verdict: str, count: int) -> str:
    verb, *rest = verdict.split(" ")
    if count != 1 and verb.endswith("s"):
        verb = verb.removesuffix("s")
    return " ".join([verb, *rest])


def _marked(verdict: str) -> Cell:
    return verdict if verdict in _NEUTRAL else Mark(verdict, "pass" if verdict in _GOOD else "fail")
