"""What every part of the reproduction hands to the report."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

Plot = dict[str, Any]


@dataclass(frozen=True)
class Statement:
    """One row of the side-by-side table.

    Attributes:
        subject: what it is about, such as 'Fig. 4'.
        paper: what the paper says, or the target.
        measured: what this run measured.
        verdict: repeats, differs, or target met / missed.
        repeat: how to repeat it by itself.
    """

    subject: str
    paper: str
    measured: str
    verdict: str
    repeat: str


@dataclass(frozen=True)
class PlotPlace:
    """An interactive plot with its caption (HTML)."""

    name: str
    caption: str
    plot: Plot
    height: int = 420


@dataclass(frozen=True)
class Table:
    """A table: heads and rows of texts."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Part:
    """One section of the report.

    Attributes:
        title: its heading.
        text: paragraphs (HTML).
        statements: rows of the side-by-side table.
        plots: interactive plots.
        tables: tables.
        figures: figures in the paper's own form by file name.
        numbers: what results.json keeps.
    """

    title: str
    text: tuple[str, ...] = ()
    statements: tuple[Statement, ...] = ()
    plots: tuple[PlotPlace, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: dict[str, Figure] = field(default_factory=dict)
    numbers: dict[str, Any] = field(default_factory=dict)


def met(reached: bool) -> str:
    """Return the verdict on a target."""
    return "target met" if reached else "target missed"


def repeats(does: bool) -> str:
    """Return the verdict on a statement of the paper."""
    return "repeats" if does else "differs"
