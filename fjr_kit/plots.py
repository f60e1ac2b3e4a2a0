"""Parts of interactive plots: traces and layouts of plotly as plain dicts.

Colours are names of the style sheet's variables ("--excited"); the page puts in the values, so that
light, dark and print share one description.
"""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Trace = dict[str, Any]
Plot = dict[str, Any]
Options = dict[str, Any]

BARRED: Options = {"modebar": {"orientation": "h"}, "margin": {"t": 36}}
"""Layout of a plot with a colour bar: the tools lie in a strip above it, not on the bar."""
LOG: Options = {"type": "log", "dtick": 1, "tickformat": "~g"}
"""A logarithmic axis with plain numbers at the decades."""
HERTZ, SECONDS, PLAIN = "%{x:.4g} Hz", "%{x:.4f} s", "%{x:.4g}"
"""How what is shown of a point begins: with its x."""
SIZES = {"triangle-up": 7, "square": 4, "diamond": 6}
POINTS = 1000
"""Bins of a time plot; each shows its smallest and its greatest value."""


def numbers(values: ArrayLike) -> list[float | None]:
    """Return six significant digits of each value; None (a gap) where it is not finite."""
    array = np.asarray(values, float)
    return [float(f"{x:.6g}") if np.isfinite(x) else None for x in array.tolist()]


def trace(
    x: ArrayLike,
    y: ArrayLike,
    name: str,
    color: str,
    *,
    dash: str = "",
    symbol: str = "",
    width: float = 1.5,
    size: float = 0,
    row: int = 1,
    unit: str = "",
    at: str = HERTZ,
    band: tuple[ArrayLike, ArrayLike] | None = None,
    **options: Any,
) -> Trace:
    """Return a trace: a line where it has a `dash`, markers where it has a `symbol`, or both.

    Args:
        x: where the points lie.
        y: their values.
        name: what the legend calls the trace; plotly reads tags in names, so it is escaped.
        color: a variable of the style sheet.
        dash: solid, dot, dash or dashdot.
        symbol: plotly's name of a marker.
        width: width of the line.
        size: size of the markers; 0 for that of the symbol.
        row: number of its y axis.
        unit: unit of y, shown beside a point.
        at: how x is shown beside a point, such as `HERTZ`.
        band: lowest and highest value of an interval around each point.
        options: what else plotly shall be told.
    """
    made: Trace = {"type": "scatter", "x": numbers(x), "y": numbers(y), "name": html.escape(name)}
    made["mode"] = "+".join(["lines"] * bool(dash) + ["markers"] * bool(symbol))
    made["hovertemplate"] = f"{at}<br>%{{y:.4g}} {unit}<extra>%{{fullData.name}}</extra>"
    if dash:
        made["line"] = {"color": color, "dash": dash, "width": width}
    if symbol:
        marker = {"color": color, "symbol": symbol, "size": size or SIZES.get(symbol, 5)}
        made["marker"] = marker
    if band is not None:
        low, middle, high = (np.asarray(edge, float) for edge in (band[0], y, band[1]))
        arms = {"array": numbers(high - middle), "arrayminus": numbers(middle - low)}
        style = {"type": "data", "symmetric": False, "color": color, "thickness": 1, "width": 2}
        made["error_y"] = style | arms
    if row > 1:
        made["yaxis"] = f"y{row}"
    return made | {"legendgroup": made["name"]} | options


def layout(
    x: str, y: str, *, log_x: bool = False, y_range: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Return the layout of one plot with titled axes."""
    made = stack([y], [1.0], x)
    if log_x:
        made["xaxis"] |= LOG
    if y_range is not None:
        made["yaxis"]["range"] = list(y_range)
    return made


def frequency_layout(
    titles: list[str], heights: list[float], frequency_hz: np.ndarray
) -> dict[str, Any]:
    """Return the layout of stacked plots (top first) over one frequency axis."""
    low, high = float(frequency_hz.min()), float(frequency_hz.max())
    made = stack(titles, heights, "frequency (Hz)")
    if low > 0 and high > 10 * low:
        span = [np.log10(low / 1.1), np.log10(high * 1.1)]
        made["xaxis"] |= LOG | {"range": span}
    return made


def stack(titles: list[str], heights: list[float], x_title: str) -> dict[str, Any]:
    """Return the layout of stacked plots with the relative `heights` over one x axis."""
    gap, count = 0.06, len(titles)
    sizes = np.array(heights) / sum(heights) * (1.0 - gap * (count - 1))
    made: dict[str, Any] = {"xaxis": {"title": {"text": x_title}, "anchor": f"y{count}"}}
    if count == 1:
        made["xaxis"]["anchor"] = "y"
    top = 1.0
    for i, (title, size) in enumerate(zip(titles, sizes.tolist(), strict=True)):
        domain = [max(0.0, round(top - size, 4)), round(top, 4)]
        made[f"yaxis{i + 1 if i else ''}"] = {"title": {"text": title}, "domain": domain}
        top -= size + gap
    return made


def extremes(t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the greatest sample of each of POINTS bins, in order of time."""
    if len(y) <= 2 * POINTS:
        return t, y
    starts = np.linspace(0, len(y), POINTS, endpoint=False).astype(int)
    bins = np.split(np.arange(len(y)), starts[1:])
    picks = [b[f(y[b])] for b in bins for f in (np.argmin, np.argmax)]
    index = np.unique(picks)
    return t[index], y[index]


def linked(
    traces: list[Trace],
    titles: list[str],
    heights: list[float],
    f: np.ndarray,
    on_top: str = "last",
) -> Plot:
    """Return a plot over frequency `f` (Hz), whose zoom and axis the others of the page follow.

    The legend names the trace that lies on top first; `on_top` "first" keeps their order.
    """
    made = frequency_layout(titles, heights, f)
    if on_top == "last":
        made["legend"] = {"traceorder": "reversed"}
    return {"data": traces, "layout": made, "linked": True}


def area(
    x: ArrayLike, low: ArrayLike, high: ArrayLike, name: str, color: str, **options: Any
) -> Trace:
    """Return the area between two curves over x; what is not finite cuts it."""
    at, bottom, top = (np.asarray(values, float) for values in (x, low, high))
    known = np.isfinite(bottom) & np.isfinite(top)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], known.astype(int), [0]])))
    parts = [slice(*pair) for pair in ends.reshape(-1, 2).tolist()]
    outlines = [
        (np.concatenate([at[p], at[p][::-1]]), np.concatenate([bottom[p], top[p][::-1]]))
        for p in parts
    ]
    return filled(outlines, name, color, **options)


def filled(
    outlines: Sequence[tuple[np.ndarray, np.ndarray]], name: str, color: str, **options: Any
) -> Trace:
    """Return filled polygons, (x, y) of the corners of each."""
    gap = [np.nan]
    x, y = (
        np.concatenate([part for outline in outlines for part in (outline[i], gap)] or [gap])
        for i in (0, 1)
    )
    made = trace(x, y, name, color, dash="solid", width=0.0, **options)
    del made["hovertemplate"]
    return made | {"fill": "toself", "fillcolor": color, "opacity": 0.3, "hoverinfo": "skip"}


def plane(traces: list[Trace], x: str, y: str, window: tuple[float, ...] | None = None) -> Plot:
    """Return a plot of the complex plane, both axes of one scale.

    Of a trace with frequencies as `customdata` the page shows those in the band that is zoomed.

    Args:
        traces: last ones lie on top.
        x: title of the axis of the real part.
        y: title of the axis of the imaginary part.
        window: what is seen at first: x from, x to, y from, y to.
    """
    made = layout(x, y) | {"legend": {"traceorder": "reversed"}}
    made["yaxis"] |= {"scaleanchor": "x"}
    if window is not None:
        made["xaxis"]["range"], made["yaxis"]["range"] = list(window[:2]), list(window[2:])
    return {"data": traces, "layout": made, "plane": True}
