"""Parts of interactive plots: traces and layouts of plotly as plain dicts.

Colours are names of the style sheet's variables ("--excited"); the page puts in the values, so that
light, dark and print share one description.
"""

from __future__ import annotations

import html
from typing import Any

import numpy as np

Trace = dict[str, Any]
Plot = dict[str, Any]
Options = dict[str, Any]

SIZES = {"triangle-up": 7, "square": 4, "diamond": 6}
POINTS = 1000
"""Bins of a time plot; each shows its smallest and its greatest value."""


def numbers(values: np.ndarray) -> list[float | None]:
    """Return six significant digits of each value; None (a gap) where it is not finite."""
    return [float(f"{x:.6g}") if np.isfinite(x) else None for x in values.tolist()]


def _text(text: str) -> str:
    """Escape a text from bags: plotly reads tags and entities in names."""
    return html.escape(text)


def trace(x: np.ndarray, y: np.ndarray, name: str, color: str, **options: Any) -> Trace:
    """Return a trace; `row` is the number of its y axis, `symbol` a marker, `dash` a line."""
    row, symbol, dash = options.pop("row", 1), options.pop("symbol", ""), options.pop("dash", "")
    made: Trace = {"type": "scatter", "x": numbers(x), "y": numbers(y), "name": _text(name)}
    made["mode"] = "+".join(["lines"] * bool(dash) + ["markers"] * bool(symbol))
    if dash:
        made["line"] = {"color": color, "dash": dash, "width": 1.5}
    if symbol:
        size = options.pop("size", SIZES.get(symbol, 5))
        made["marker"] = {"color": color, "symbol": symbol, "size": size}
    if row > 1:
        made["yaxis"] = f"y{row}"
    return made | {"legendgroup": made["name"]} | options


def hover(unit: str, x: str = "%{x:.4g} Hz") -> str:
    """Return what is shown of a point: x, and y with its unit."""
    return f"{x}<br>%{{y:.4g}} {unit}<extra>%{{fullData.name}}</extra>"


def frequency_layout(
    titles: list[str], heights: list[float], frequency_hz: np.ndarray
) -> dict[str, Any]:
    """Return the layout of stacked plots (top first) over one frequency axis."""
    low, high = float(frequency_hz.min()), float(frequency_hz.max())
    layout = stack(titles, heights, "frequency (Hz)")
    if low > 0 and high > 10 * low:
        span = [np.log10(low / 1.1), np.log10(high * 1.1)]
        layout["xaxis"] |= {"type": "log", "range": span, "dtick": 1, "tickformat": "~g"}
    return layout


def stack(titles: list[str], heights: list[float], x_title: str) -> dict[str, Any]:
    """Return the layout of stacked plots with the relative `heights` over one x axis."""
    gap, count = 0.06, len(titles)
    sizes = np.array(heights) / sum(heights) * (1.0 - gap * (count - 1))
    layout: dict[str, Any] = {"xaxis": {"title": {"text": x_title}, "anchor": f"y{count}"}}
    if count == 1:
        layout["xaxis"]["anchor"] = "y"
    top = 1.0
    for i, (title, size) in enumerate(zip(titles, sizes.tolist(), strict=True)):
        domain = [max(0.0, round(top - size, 4)), round(top, 4)]
        layout[f"yaxis{i + 1 if i else ''}"] = {"title": {"text": title}, "domain": domain}
        top -= size + gap
    return layout


def extremes(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the greatest sample of each of POINTS bins, in order of time."""
    if len(y) <= 2 * POINTS:
        return t, y
    starts = np.linspace(0, len(y), POINTS, endpoint=False).astype(int)
    bins = np.split(np.arange(len(y)), starts[1:])
    picks = [b[f(y[b])] for b in bins for f in (np.argmin, np.argmax)]
    index = np.unique(picks)
    return t[index], y[index]


def linked(traces: list[Trace], titles: list[str], heights: list[float], f: np.ndarray) -> Plot:
    """Return a plot whose zoom along frequency `f` the others follow; last traces lie on top."""
    layout = frequency_layout(titles, heights, f) | {"legend": {"traceorder": "reversed"}}
    return {"data": traces, "layout": layout, "linked": True}
