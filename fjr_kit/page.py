"""HTML pages that open offline, made from Jinja2 templates that escape every value.

A package renders its own template, which extends the frame `page.html`: style, script, plotly.js
and the data of the plots are inside, and a content security policy forbids the page every request.
Tables, figures and lists are macros of `parts.html`. Templates are given values, never HTML: what
comes from bags or from a command line is escaped where it is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any, NamedTuple

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from plotly.offline import get_plotlyjs

from .check import Check
from .number_text import formatted, unsigned_zero

SENTENCE = 40
"""A cell that is longer than this many characters is a sentence."""
MOST_CARDS = 20
"""A longer table of numbers stays a table on a narrow page."""


class Column(NamedTuple):
    """Head of a table's column; a column with a format holds numbers, a note explains its name."""

    name: str
    unit: str = ""
    form: str = ""
    note: str = ""

    @property
    def label(self) -> str:
        """What a card of a narrow page calls the column's cell."""
        return ", ".join(filter(None, (self.name, self.unit)))


class Mark(NamedTuple):
    """A word in the colour of its kind, `pass` or `fail`."""

    word: str
    kind: str

    @classmethod
    def of(cls, passed: bool, words: tuple[str, str] = ("passed", "failed")) -> Mark:
        """Return the first word for what has passed, the second for what has not."""
        return cls(words[0], "pass") if passed else cls(words[1], "fail")


Cell = str | float | Mark | list[str]
"""A text, a number in the format of its column, a mark, or texts of a line each."""
Row = Sequence[Cell]


def check_rows(checks: Iterable[Check], words: tuple[str, str] = ("passed", "failed")) -> list[Row]:
    """Return a row for each check, the failed ones first, for the macro `checks` of `parts.html`.

    Args:
        checks: the checks.
        words: for a check that passed, and for one that failed.
    """
    return [
        (each.name, Mark.of(each.passed, words), each.value, each.limit, each.sentence)
        for each in sorted(checks, key=lambda check: check.passed)
    ]


def render_page(
    package: str,
    template: str,
    *,
    title: str,
    plots: Mapping[str, Any],
    provenance: Mapping[str, str],
    **values: Any,
) -> str:
    """Return a whole page.

    Args:
        package: the package whose folder holds the template.
        template: name of the template's file; it extends `page.html`.
        title: title of the page, plain text.
        plots: `overview`, plots by place, and `levels`, the same of each level.
        provenance: what made the page, by name, in order.
        values: what else the template shows, as data.
    """
    page = _environment(package).get_template(template)
    shown = [plot for group in (plots["overview"], *plots["levels"]) for plot in group.values()]
    return page.render(
        title=title,
        plots=plots,
        over_frequency=any("linked" in plot for plot in shown),
        provenance=provenance,
        **values,
    )


def asset(name: str) -> str:
    """Return the text of one of this package's files, such as report.css."""
    return files("fjr_kit").joinpath(name).read_text(encoding="utf-8")


def number(value: float, form: str) -> str:
    """Return a number as a page shows it: with a minus sign, a dash where it is not finite."""
    if not isfinite(value):
        return "\N{EN DASH}"
    return unsigned_zero(formatted(value, form)).replace("-", "\N{MINUS SIGN}")


def narrow_form(rows: Sequence[Row]) -> str:
    """Return how a narrow page shows a table: rows as cards, or a long one of numbers as it is."""
    sentences = any(_length(cell) > SENTENCE for row in rows for cell in row)
    return "cards" if sentences or len(rows) <= MOST_CARDS else "wide"


def _length(cell: Cell) -> int:
    if isinstance(cell, Mark):
        return len(cell.word)
    if isinstance(cell, str):
        return len(cell)
    return len(" ".join(cell)) if isinstance(cell, list) else 0


@cache
def _environment(package: str) -> Environment:
    """Return where templates of a package find the frame, the macros and their filters."""
    made = Environment(
        loader=ChoiceLoader([PackageLoader(package, ""), PackageLoader("fjr_kit", "")]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {"number": number, "narrow_form": narrow_form}
    made.tests |= {"mark": lambda cell: isinstance(cell, Mark), "finite": isfinite}
    made.globals |= {
        "column": Column,
        "asset": asset,
        "plotly": get_plotlyjs,
    }
    made.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    return made
