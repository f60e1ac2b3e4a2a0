"""Helpers of the figures: axes in the paper's form, and traces in the printed colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from fjr_kit.figure_style import log_axis
from fjr_kit.plots import PLAIN, Trace, trace

INK = "#000000"
THEMED = {
    INK: "--ink",
    "#1f4fd8": "--blue",
    "#d62728": "--red",
    "#2ca02c": "--green",
    "#0072b2": "--excited",
    "#d55e00": "--odd",
    "#009e73": "--even",
    "#7a7f87": "--noise",
    "#8a8f98": "--muted",
}
"""Colours of the printed figures by their names in the page's style sheet."""
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
GAIN_DB = "dB re 1 rad/(N m)"
"""Unit of gains, and of variances of gains as 10 log10."""


def single(height_in: float = 3.2) -> tuple[Figure, Axes]:
    """Return a figure with one pair of axes, a column wide."""
    figure = Figure(figsize=(WIDTH_IN, height_in))
    return figure, figure.add_axes((0.13, 0.14, 0.84, 0.82))


def amplitude_axis(axis: Axes, low: float = 1e-3, high: float = 1e-1) -> None:
    """Scale x for amplitudes."""
    log_axis(axis, low, high)
    axis.set_xlabel("amplitude of a line (rad)")


def decibel_power(values: np.ndarray) -> np.ndarray:
    """Return 10 log10 of positive values; NaN elsewhere."""
    return 10.0 * np.log10(np.where(values > 0, values, np.nan))


def themed(color: str) -> str:
    """Return the style sheet's name of a printed colour, so that a dark page can lighten it."""
    return THEMED.get(color, color)


def curve(x: ArrayLike, y: ArrayLike, name: str, color: str, **options: Any) -> Trace:
    """Return a page's trace of what is printed in `color`: a solid line, or points of a symbol."""
    style = {"dash": "" if "symbol" in options else "solid", "at": PLAIN} | options
    return trace(x, y, name, themed(color), **style)
