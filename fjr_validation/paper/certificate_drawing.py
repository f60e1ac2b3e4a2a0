"""Drawings of the certificate."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fjr_kit.figure_style import log_values
from fjr_kit.plots import LOG, layout

from . import drawing
from .part import PlotPlace

ROBUST, FAST, NOISE = "#0072b2", "#d55e00", "#7a7f87"


def ratio_plot(found: Any) -> PlotPlace:
    """Return the ratios of a `Certificate` as an interactive plot."""
    data = []
    for name, color in (("robust", ROBUST), ("fast", FAST), ("noise", NOISE)):
        ratio = found.ratio[name]
        for chosen, symbol in ((found.reliable, "circle"), (~found.reliable, "circle-open")):
            style = {"symbol": symbol, "showlegend": symbol == "circle"}
            data.append(
                drawing.curve(found.frequency_hz[chosen], ratio[chosen], name, color, **style)
            )
        for limit in found.limits[name]:
            ends = found.frequency_hz[[0, -1]]
            style = {"dash": "dot", "showlegend": False}
            data.append(drawing.curve(ends, [limit, limit], name, color, **style))
    made = layout("frequency (Hz)", "empirical / predicted variance", log_x=True)
    made["yaxis"] |= {"type": "log", "tickformat": "~g"}
    title, caption = (
        "Empirical over predicted variance",
        "; dotted: 95 % bounds; hollow: unreliable.",
    )
    return PlotPlace("certificate", title, caption, {"data": data, "layout": made}, 440)


def coverage_plot(found: Any) -> PlotPlace:
    """Return the coverage of discs of a `Certificate` as an interactive plot."""
    data = []
    for name, words, color in (("robust", "robust", ROBUST), ("fast", "fast", FAST)):
        chosen = found.reliable
        points = 100.0 * found.covered[name][chosen]
        data.append(
            drawing.curve(
                found.frequency_hz[chosen], points, words, color, symbol="circle", unit="%"
            )
        )
        for limit in found.covered_limits[name]:
            ends = found.frequency_hz[[0, -1]]
            style = {"dash": "dot", "showlegend": False}
            data.append(drawing.curve(ends, [100.0 * limit] * 2, words, color, **style))
    labels = ("frequency (Hz)", "discs that hold the truth (%)")
    plot = {"data": data, "layout": layout(*labels, log_x=True, y_range=(88, 100))}
    title, caption = "Coverage of 95 % discs", " of single experiments; dotted: 95 % bounds."
    return PlotPlace("coverage", title, caption, plot, 340)


def law_plot(found: Any) -> PlotPlace:
    """Return the laws of a `Certificate` as an interactive plot."""
    data = []
    for (name, (x, variance, slope, _)), color in zip(
        found.laws.items(), (ROBUST, NOISE), strict=True
    ):
        label = f"{name}: slope {slope:.3f}"
        data.append(
            drawing.curve(x, variance / variance[0] * (2.0 / x[0]), label, color, symbol="circle")
        )
    x = np.array([2.0, 14.0])
    data.append(drawing.curve(x, 2.0 / x, "slope \N{MINUS SIGN}1", "#000000", dash="dot"))
    made = layout("M, or P", "variance, relative", log_x=True)
    made["xaxis"] |= {"dtick": "D1"}
    made["yaxis"] |= LOG | {"dtick": "D1"}
    caption = ": total variance against M, noise variance against P (geometric means)."
    return PlotPlace("laws", "Laws", caption, {"data": data, "layout": made}, 340)


def figure(found: Any) -> Figure:
    """Draw the ratios of a `Certificate`."""
    drawn, axis = drawing.single()
    for name, color in (("fast", FAST), ("robust", ROBUST), ("noise", NOISE)):
        ratio = found.ratio[name]
        keep = found.reliable
        axis.plot(found.frequency_hz[keep], ratio[keep], ".", color=color, label=name)
        for limit in found.limits[name]:
            axis.axhline(limit, color=color, ls=":", lw=0.8)
    log_values(axis)
    axis.set_yticks([0.5, 0.7, 1.0, 1.4, 2.0])
    axis.set(xlabel="frequency (Hz)", ylabel="empirical / predicted variance", xlim=(0, 50))
    axis.legend(loc="upper right")
    return drawn
