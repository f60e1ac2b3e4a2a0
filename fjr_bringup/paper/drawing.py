"""Helpers of the figures: axes in the paper's form, and interactive traces."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from bla_analyzer.figure_style import log_axis

INK = "#000000"
STYLE: Any = {
    "font.family": "STIXGeneral",
    "font.size": 9,
    "axes.linewidth": 0.6,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "legend.fontsize": 7.5,
    "legend.framealpha": 1.0,
    "legend.edgecolor": "#808080",
    "lines.linewidth": 1.0,
    "lines.markersize": 3,
    "figure.dpi": 200,
    "pdf.fonttype": 42,
    "text.parse_math": False,
}
"""A boxed plot as in the paper."""

WIDTH_IN = 4.4


def single(height_in: float = 3.2) -> tuple[Figure, Axes]:
    """Return a figure with one pair of axes, a column wide."""
    figure = Figure(figsize=(WIDTH_IN, height_in))
    return figure, figure.add_axes((0.13, 0.14, 0.84, 0.82))


def amplitude_axis(axis: Axes, low: float = 1e-3, high: float = 1e-1) -> None:
    """Scale x for amplitudes."""
    log_axis(axis, low, high)
    axis.set_xlabel("amplitude of a line (rad)")


def log_values(axis: Axes) -> None:
    """Scale y logarithmically with plain numbers at the ticks."""
    axis.set_yscale("log")
    axis.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def decibel(values: np.ndarray) -> np.ndarray:
    """Return 20 log10 |values|; NaN where they are zero."""
    size = np.abs(values)
    return 20.0 * np.log10(np.where(size > 0, size, np.nan))


def decibel_power(values: np.ndarray) -> np.ndarray:
    """Return 10 log10 of positive values; NaN elsewhere."""
    return 10.0 * np.log10(np.where(values > 0, values, np.nan))


def themed(color: str) -> str:
    """Return the colour for the page: ink for black, which a dark page turns white."""
    return "--ink" if color == INK else color


def _plain(values: Any) -> list[Any]:
    return [
        float(f"{value:.6g}") if np.isfinite(value) else None
        for value in np.asarray(values, float).tolist()
    ]


def trace(x: Any, y: Any, name: str, color: str, mode: str = "lines", **options: Any) -> Any:
    """Return a plotly trace; `dash`, `symbol`, `size`, `band` (low, high), `unit` are options."""
    color = themed(color)
    unit, dash = options.pop("unit", ""), options.pop("dash", "solid")
    symbol, size = options.pop("symbol", "circle"), options.pop("size", 5)
    band = options.pop("band", None)
    made = {
        "type": "scatter",
        "x": _plain(x),
        "y": _plain(y),
        "name": name,
        "mode": mode,
        "line": {"color": color, "dash": dash, "width": 1.6},
        "marker": {"color": color, "symbol": symbol, "size": size},
        "hovertemplate": f"%{{x:.4g}}<br>%{{y:.4g}} {unit}<extra>%{{fullData.name}}</extra>",
    }
    if band is not None:
        made["error_y"] = {
            "type": "data",
            "symmetric": False,
            "array": _plain(np.asarray(band[1]) - np.asarray(y)),
            "arrayminus": _plain(np.asarray(y) - np.asarray(band[0])),
            "color": color,
            "thickness": 1,
            "width": 2,
        }
    return made | options


def layout(x: str, y: str, *, log_x: bool = False, y_range: Any = None) -> dict[str, Any]:
    """Return the layout of a plot with titled axes."""
    made: dict[str, Any] = {"xaxis": {"title": {"text": x}}, "yaxis": {"title": {"text": y}}}
    if log_x:
        made["xaxis"] |= {"type": "log", "dtick": 1, "tickformat": "~g"}
    if y_range is not None:
        made["yaxis"]["range"] = list(y_range)
    return made


def span(low: float, high: float, digits: int = 3) -> str:
    """Return an interval as text."""
    return f"{low:.{digits}g} to {high:.{digits}g}"
