"""What pages share: the frame that opens offline, tables and lists of escaped text.

Everything is inside: style, script, plotly.js and the data. A content security policy forbids the
page every request.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape
from importlib.resources import files
from math import isfinite
from typing import Any

from plotly.offline import get_plotlyjs

POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; form-action 'none'; base-uri 'none'"
)

Cell = str | float | tuple[float, str]
"""HTML, or a number to four digits or in a format of its own."""


def page(title: str, body: str, plots: Mapping[str, Any]) -> str:
    """Return a whole page.

    Args:
        title: its title, plain text.
        body: HTML.
        plots: `overview`, plots by place, and `levels`, the same of each level.
    """
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>{escape(title)}</title>
<style>
{asset("report.css")}</style>
</head>
<body>
{body}
<script type="application/json" id="report-data">{_data(plots)}</script>
<script>{get_plotlyjs()}</script>
<script>
{asset("report.js")}</script>
</body>
</html>
"""


def _data(plots: Mapping[str, Any]) -> str:
    """Return the plots as JSON that can neither end its script element nor start a comment."""
    text = json.dumps(plots, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def asset(name: str, package: str = "bla_analyzer") -> str:
    """Return the text of a file of a package."""
    return files(package).joinpath(name).read_text(encoding="utf-8")


def figure(name: str, height: int, caption: str) -> str:
    """Return the place of a plot, with its caption in HTML."""
    return (
        f"<figure>\n<figcaption>{caption}</figcaption>\n"
        f'<div class="plot" id="{name}" data-height="{height}"></div>\n</figure>\n'
    )


def bullets(items: Iterable[str]) -> str:
    """Return a list of HTML items; nothing if there are none."""
    rows = "".join(f"<li>{item}</li>\n" for item in items)
    return f"<ul>\n{rows}</ul>\n" if rows else ""


def _cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    value, form = cell if isinstance(cell, tuple) else (cell, ".4g")
    text = format(value, form) if isfinite(value) else "\N{EN DASH}"
    return text.replace("-", "\N{MINUS SIGN}")


def table(
    heads: list[tuple[str, str]], rows: list[tuple[int | None, list[Cell]]], text: str
) -> str:
    """Return a table. `heads`: name and unit; `rows`: index of the level and cells, HTML if str."""
    kinds = [isinstance(cell, str) for cell in rows[0][1]] if rows else [True] * len(heads)
    head = "".join(
        f"<th{_class(kind)} scope=col>{name}<small>{unit}</small></th>"
        for (name, unit), kind in zip(heads, kinds, strict=True)
    )
    body = "".join(_row(level, cells) for level, cells in rows)
    return (
        f'<div class="scroll"><table><caption>{text}</caption><thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}</tbody></table></div>\n"
    )


def _class(is_text: bool) -> str:
    return "" if is_text else ' class="number"'


def _row(level: int | None, cells: list[Cell]) -> str:
    first, *rest = map(_cell, cells)
    kinds = [isinstance(cell, str) for cell in cells]
    place = "" if level is None else f' data-level="{level}"'
    columns = "".join(
        f"<td{_class(k)}>{text}</td>" for k, text in zip(kinds[1:], rest, strict=True)
    )
    return f"<tr{place}><th{_class(kinds[0])} scope=row>{first}</th>{columns}</tr>\n"
