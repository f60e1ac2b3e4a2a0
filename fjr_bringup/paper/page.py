"""report.html of `fjr paper`: one file that opens offline, with the side-by-side table on top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from bla_analyzer import page

from .part import Part, Statement, Table

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
    sections = "\n".join(map(_section, parts))
    origin = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>\n" for k, v in provenance.items())
    body = f"""<header>
<h1>{escape(title)}</h1>
<p class="lead">{escape(lead)}</p>
<div class="verdict"><strong>{escape(verdict(statements))}</strong></div>
</header>
<section>
<h2>The paper beside this run</h2>
{_side_by_side(statements)}</section>
{sections}
<section>
<h2>Provenance</h2>
<dl>
{origin}</dl>
</section>"""
    return page.page(title, body, {"overview": plots, "levels": []})


def verdict(statements: Sequence[Statement]) -> str:
    """Return how many statements repeat and how many targets are met."""
    words = [statement.verdict for statement in statements]
    targets = words.count("target met") + words.count("target missed")
    said = words.count("repeats") + words.count("differs")
    wrong = words.count("cannot be right")
    return (
        f"{words.count('repeats')} of {said} statements of the paper repeat, {wrong} cannot be "
        f"right; {words.count('target met')} of {targets} targets are met."
    )


def _side_by_side(statements: Sequence[Statement]) -> str:
    rows = "".join(
        f"<tr><th scope=row>{escape(one.subject)}</th><td>{escape(one.paper)}</td>"
        f"<td>{escape(one.measured)}</td><td>{_verdict(one.verdict)}</td></tr>\n"
        for one in statements
    )
    heads = "".join(
        f"<th scope=col>{head}</th>" for head in ("", "paper or target", "measured", "")
    )
    return (
        f'<div class="scroll"><table><thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>'
        "</table></div>\n"
    )


def _verdict(word: str) -> str:
    if word in _NEUTRAL:
        return escape(word)
    kind = "pass" if word in _GOOD else "fail"
    return f'<span class="{kind}">{escape(word)}</span>'


def _section(part: Part) -> str:
    text = "".join(f"<p>{paragraph}</p>\n" for paragraph in part.text)
    plots = "".join(page.figure(one.name, one.height, one.caption) for one in part.plots)
    tables = "".join(map(_table, part.tables))
    return f"<section>\n<h2>{escape(part.title)}</h2>\n{text}{plots}{tables}</section>"


def _table(table: Table) -> str:
    heads = "".join(f"<th scope=col>{escape(head)}</th>" for head in table.heads)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n"
        for row in table.rows
    )
    return (
        f'<div class="scroll"><table><caption>{escape(table.caption)}</caption>'
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n"
    )
