"""Figures of a blind check: accuracy against effect size, calibration, confusion of effects."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fjr_kit.figure_style import EVEN, EXCITED, NOISE, NONLINEAR, ODD, STYLE, WIDTH_IN, legend, save

from .outcome import Outcome
from .score import MethodScores, rate

_COLOURS = (EXCITED, ODD, EVEN, NONLINEAR, NOISE)
_MARKERS = "osD^v"
_LAST_BIN = 11.2


def draw_all(scored: Mapping[str, MethodScores], outcomes: Sequence[Outcome], folder: Path) -> None:
    """Draw all figures into a folder, PNG and PDF."""
    with mpl.rc_context(STYLE):
        _accuracy(scored, folder / "accuracy")
        ours = [o for o in outcomes if o.method == next(iter(scored))]
        _calibration(ours, folder / "calibration")
        _confusion(ours, folder / "confusion")


def _figure(height_in: float, right: float = 0.8) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH_IN, height_in))
    axis = figure.add_axes((0.1, 0.44 / height_in, right - 0.1, 1.0 - 0.7 / height_in))
    return figure, axis


def _accuracy(scored: Mapping[str, MethodScores], stem: Path) -> None:
    """Draw the share of single effects named first and right, over their size."""
    figure, axis = _figure(2.8)
    for number, (method, result) in enumerate(scored.items()):
        rows = [row for row in result.by_size if row.first_right.cases]
        middle = [_middle(row.low, row.high) * 1.04 ** (number - 1.5) for row in rows]
        value = np.array([row.first_right.value for row in rows])
        low = np.array([row.first_right.low for row in rows])
        high = np.array([row.first_right.high for row in rows])
        style: dict[str, Any] = {"color": _COLOURS[number % 5], "marker": _MARKERS[number % 5]}
        axis.errorbar(middle, value, [value - low, high - value], label=method, capsize=2, **style)
    axis.axvline(3.0, color=NOISE, linewidth=0.6, linestyle=":")
    axis.set_xscale("log")
    axis.set_xticks([0.5, 1, 2, 4, 8], ["0.5", "1", "2", "4", "8"])
    axis.minorticks_off()
    axis.set_ylim(-0.02, 1.02)
    axis.set_xlabel("size of the effect over its detection limit")
    axis.set_ylabel("right effect first")
    axis.set_title("Single effects of the catalogue, with 95 % intervals", loc="left")
    legend(axis)
    save(figure, stem)


def _middle(low: float, high: float | None) -> float:
    return float(np.sqrt(max(low, 0.35) * (high or _LAST_BIN)))


def _calibration(outcomes: Sequence[Outcome], stem: Path) -> None:
    """Draw how often verdicts were right over the confidence that they stated."""
    figure, axis = _figure(2.8)
    pairs = [(o.diagnosis.confidence, o.right) for o in outcomes if o.diagnosis]
    edges = np.linspace(0.0, 1.0, 6)
    axis.plot([0, 1], [0, 1], color=NOISE, linewidth=0.6, linestyle=":")
    for low, high in itertools.pairwise(edges):
        inside = [(c, r) for c, r in pairs if low <= c < high or (high == 1.0 and c == 1.0)]
        if not inside:
            continue
        share = rate(right for _, right in inside)
        value, low_end, high_end = np.array([share.value, share.low, share.high], float)
        mean, bars = float(np.mean([c for c, _ in inside])), [[value - low_end], [high_end - value]]
        axis.errorbar([mean], [value], bars, color=EXCITED, marker="o", capsize=2)
        axis.annotate(f" {len(inside)}", (mean, value), fontsize=8)
    axis.set_xlim(0.0, 1.02)
    axis.set_ylim(-0.02, 1.02)
    axis.set_xlabel("stated confidence")
    axis.set_ylabel("share of right verdicts")
    axis.set_title("Calibration, with numbers of cases", loc="left")
    save(figure, stem)


def _confusion(outcomes: Sequence[Outcome], stem: Path) -> None:
    """Draw what was said of each true class, single effects above their detection limit."""
    shown = [o for o in outcomes if o.kind != "two" and not (o.kind == "single" and o.relative < 1)]
    rows = sorted({_truth(o) for o in shown})
    columns = sorted({_said(o) for o in shown})
    if not shown:
        save(_without_cases("no single effect of this check lies above its detection limit"), stem)
        return
    counts = np.zeros((len(rows), len(columns)))
    for outcome in shown:
        counts[rows.index(_truth(outcome)), columns.index(_said(outcome))] += 1
    height = 1.9 + 0.16 * len(rows)
    figure = Figure(figsize=(WIDTH_IN, height))
    axis = figure.add_axes((0.3, 1.5 / height, 0.68, 1.0 - 1.75 / height))
    axis.imshow(counts, cmap="Blues", aspect="auto", vmin=0, vmax=max(counts.max(), 1))
    for row, column in zip(*np.nonzero(counts), strict=True):
        dark = counts[row, column] > 0.6 * counts.max()
        axis.text(
            column, row, f"{counts[row, column]:.0f}", ha="center", va="center", fontsize=7,
            color="white" if dark else "black",
        )  # fmt: skip
    axis.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axis.set_yticks(range(len(rows)), rows, fontsize=7)
    axis.grid(False)
    axis.set_title("True class (rows) and what was said first (columns)", loc="left")
    save(figure, stem)


def _without_cases(why: str) -> Figure:
    """Return a figure that says why it shows nothing."""
    figure = Figure(figsize=(WIDTH_IN, 1.0))
    figure.text(0.02, 0.5, f"Nothing to show: {why}.", va="center")
    return figure


def _truth(outcome: Outcome) -> str:
    return outcome.truth[0] if outcome.truth else outcome.kind


def _said(outcome: Outcome) -> str:
    return outcome.named[0] if outcome.named else f"({outcome.verdict})"
