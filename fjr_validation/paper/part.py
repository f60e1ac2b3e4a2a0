"""The result that every part of the reproduction hands to the report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

from fjr_kit.page import Column
from fjr_kit.plots import Plot


@dataclass(frozen=True)
class Statement:
    """One row of the side-by-side table.

    Attributes:
        subject: what it is about, such as 'Fig. 4'.
        paper: what the paper says, or the target.
        measured: what this run measured.
        verdict: repeats, differs, finding, target met / missed, or contradicts others: the
            paper's own statements cannot hold at once.
        repeat: how to repeat it by itself.
    """

    subject: str
    paper: str
    measured: str
    verdict: str
    repeat: str


@dataclass(frozen=True)
class PlotPlace:
    """An interactive plot.

    Attributes:
        name: its identifier in the page.
        title: the first words of its caption, which stand out.
        caption: the rest, which continues the sentence of the title.
        plot: traces and layout.
        height: in pixels.
    """

    name: str
    title: str
    caption: str
    plot: Plot
    height: int = 420


@dataclass(frozen=True)
class Table:
    """A table: heads and rows of texts."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def columns(self) -> list[Column]:
        """The heads as a page shows them."""
        return [Column(head) for head in self.heads]

    @property
    def cells(self) -> list[list[str]]:
        """The rows, with half widths that stay on the line of their values."""
        sign, space = "\N{PLUS-MINUS SIGN}", "\N{NO-BREAK SPACE}"
        whole = f"{space}{sign}{space}"
        return [[cell.replace(f" {sign} ", whole) for cell in row] for row in self.rows]


@dataclass(frozen=True)
class Part:
    """One section of the report.

    Attributes:
        title: its heading.
        text: paragraphs.
        statements: rows of the side-by-side table.
        plots: interactive plots.
        tables: tables.
        figures: figures in the paper's own form by file name.
        numbers: what results.json keeps.
        terms: words that the part uses, with what they mean.
    """

    title: str
    text: tuple[str, ...] = ()
    statements: tuple[Statement, ...] = ()
    plots: tuple[PlotPlace, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: dict[str, Figure] = field(default_factory=dict)
    numbers: dict[str, Any] = field(default_factory=dict)
    terms: Mapping[str, str] = field(default_factory=dict)


def met(reached: bool) -> str:
    """Return the verdict on a target."""
    return "target met" if reached else "target missed"


def inconsistent(is_so: bool) -> str:
    """Return the verdict on statements of the paper that should hold at once."""
    return "contradicts others" if is_so else "repeats"


def repeats(does: bool) -> str:
    """Return the verdict on a statement of the paper."""
    return "repeats" if does else "differs"
