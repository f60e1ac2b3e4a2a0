"""Drawings of the certificate."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from . import drawing
from .part import PlotPlace

ROBUST, FAST, NOISE = "#0072b2", "#d55e00", "#7a7f87"


def ratio_plot(found: Any) -> PlotPlace:
    """Return the ratios of a `Certificate` as an interactive plot."""
    data = []
    for name, color in (("robust", ROBUST), ("fast", FAST), ("noise", NOISE)):
        ratio = found.ratio[name]
        for chosen, symbol in ((found.reliable, "circle"), (~found.reliable, "circle-open")):
            points = drawing.trace(
                found.frequency_hz[chosen], ratio[chosen], name, color, "markers", symbol=symbol
            )
            data.append(points | {"legendgroup": name, "showlegend": symbol == "circle"})
        for limit in found.limits[name]:
            ends = found.frequency_hz[[0, -1]]
            line = drawing.trace(ends, [limit, limit], name, color, dash="dot")
            data.append(line | {"legendgroup": name, "showlegend": False})
    layout = drawing.layout("frequency (Hz)", "empirical / predicted variance", log_x=True)
    layout["yaxis"] |= {"type": "log", "tickformat": "~g"}
    caption = "<b>Empirical over predicted variance</b>; dotted: 95 % bounds; hollow: unreliable."
    return PlotPlace("certificate", caption, {"data": data, "layout": layout}, 440)


def coverage_plot(found: Any) -> PlotPlace:
    """Return the coverage of discs of a `Certificate` as an interactive plot."""
    data = []
    for name, words, color in (("robust", "robust", ROBUST), ("fast_all", "fast, all", FAST)):
        chosen = found.reliable
        points = 100.0 * found.covered[name][chosen]
        data.append(
            drawing.trace(found.frequency_hz[chosen], points, words, color, "markers", unit="%")
        )
        for limit in found.covered_limits[name]:
            ends = found.frequency_hz[[0, -1]]
            line = drawing.trace(ends, [100.0 * limit] * 2, words, color, dash="dot")
            data.append(line | {"showlegend": False})
    layout = drawing.layout("frequency (Hz)", "discs that hold the truth (%)", log_x=True)
    layout["yaxis"] |= {"range": [88, 100]}
    caption = "<b>Coverage of 95 % discs</b> of single experiments; dotted: 95 % bounds."
    return PlotPlace("coverage", caption, {"data": data, "layout": layout}, 340)


def law_plot(found: Any) -> PlotPlace:
    """Return the laws of a `Certificate` as an interactive plot."""
    data = []
    for (name, (x, variance, slope, _)), color in zip(
        found.laws.items(), (ROBUST, NOISE), strict=True
    ):
        label = f"{name}: slope {slope:.3f}"
        data.append(
            drawing.trace(x, variance / variance[0] * (2.0 / x[0]), label, color, "markers")
        )
    x = np.array([2.0, 14.0])
    data.append(drawing.trace(x, 2.0 / x, "slope \N{MINUS SIGN}1", "#000000", dash="dot"))
    layout = drawing.layout("M, or P", "variance, relative", log_x=True)
    layout["xaxis"] |= {"dtick": "D1"}
    layout["yaxis"] |= {"type": "log", "tickformat": "~g", "dtick": "D1"}
    caption = "<b>Laws</b>: total variance against M, noise variance against P (geometric means)."
    return PlotPlace("laws", caption, {"data": data, "layout": layout}, 340)


def figure(found: Any) -> Figure:
    """Draw the ratios of a `Certificate`."""
    drawn, axis = drawing.single()
    for name, color in (("fast", FAST), ("robust", ROBUST), ("noise", NOISE)):
        ratio = found.ratio[name]
        keep = found.reliable
        axis.plot(found.frequency_hz[keep], ratio[keep], ".", color=color, label=name)
        for limit in found.limits[name]:
            axis.axhline(limit, color=color, ls=":", lw=0.8)
    drawing.log_values(axis)
    axis.set_yticks([0.5, 0.7, 1.0, 1.4, 2.0])
    axis.set(xlabel="frequency (Hz)", ylabel="empirical / predicted variance", xlim=(0, 50))
    axis.legend(loc="upper right")
    return drawn
