"""Drawings of Fig. 5."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fjr_bringup.design.shaping_output import KINDS
from fjr_kit.plots import layout
from fjr_kit.tasks import Arrays

from . import drawing
from .part import PlotPlace

SIGNALS = (("reference", "rad"), ("torque", "N m"))
COLORS = {"excited": "#000000", "odd": "#d62728", "even": "#2ca02c"}
LABELS = {"excited": "excited odd", "odd": "non excited odd", "even": "non excited even"}


def spectra_plots(shaping: Arrays) -> tuple[PlotPlace, ...]:
    """Return the four spectra as interactive plots."""
    places = []
    rms = dict(zip(("before", "after"), shaping["torque_rms_nm"][[0, -1]], strict=True))
    for when in ("before", "after"):
        for signal, unit in SIGNALS:
            data = []
            for kind in reversed([kind for kind, _, _ in KINDS]):
                frequency, values = shaping[f"{when}_{signal}_{kind}"]
                if np.isfinite(values).any():
                    data.append(
                        drawing.curve(
                            frequency, values, LABELS[kind], COLORS[kind], symbol="circle"
                        )
                    )
            title = f"{signal.capitalize()} spectrum {when} shaping"
            caption = f", torque {rms[when]:.1f} N m rms on the excited lines."
            made = layout("frequency (Hz)", f"{signal} (dB re 1 {unit})")
            plot = {"data": data, "layout": made}
            places.append(PlotPlace(f"fig5-{when}-{signal}", title, caption, plot, 300))
    return tuple(places)


def v_plot(curves: Any) -> PlotPlace:
    """Return V over torque without and with shaping."""
    data = []
    for name, color in (("unshaped", "#7a7f87"), ("shaped", "#0072b2")):
        torque, whole, above = curves[name]
        for v, lines, dash in ((above, "from 1 Hz", "solid"), (whole, "all lines", "dot")):
            style = {"dash": dash, "symbol": "circle", "unit": "dB²"}
            data.append(drawing.curve(torque, v, f"{name}, {lines}", color, **style))
    plot = {"data": data, "layout": layout("torque rms (N m)", "V (dB²)", y_range=(0, 4))}
    caption = ", both nonlinearities, against G0_viscous."
    return PlotPlace("fig5-v", "V at equal torque rms", caption, plot, 400)


def figure(shaping: Arrays) -> Figure:
    """Draw the paper's four panels."""
    drawn = Figure(figsize=(drawing.WIDTH_IN * 1.3, 4.4))
    axes = drawn.subplots(2, 2, sharex=True)
    for column, when in enumerate(("before", "after")):
        for row, (signal, unit) in enumerate(SIGNALS):
            axis = axes[row, column]
            for kind, _, _ in reversed(KINDS):
                frequency, values = shaping[f"{when}_{signal}_{kind}"]
                if np.isfinite(values).any():
                    axis.plot(frequency, values, ".", color=COLORS[kind], ms=2, label=LABELS[kind])
            letter = "abcd"[2 * column + row]
            axis.set_title(f"({letter}) {signal} {when}, dB re 1 {unit}", fontsize=8.5)
            axis.set_xlim(0, 50)
    for axis in axes[1]:
        axis.set_xlabel("frequency (Hz)")
    axes[1, 0].legend(loc="lower center", markerscale=3)
    drawn.tight_layout()
    return drawn
