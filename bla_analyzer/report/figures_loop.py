"""Figures of the loop of a level: coherence, sensitivity, and the Nyquist plots of G and of G C."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from fjr_kit.figure_style import EVEN, EXCITED, ODD, WIDTH_IN, frequency_axis, legend, stacked_axes

from ..results.loop import loop_discs, peak
from ..results.result import BlaEstimate, LevelResult, OutputBla
from ..results.summary import decibel, level_name, magnitude_band_db

BAND = 0.25
"""Opacity of what is an uncertainty."""
CORNERS = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 49))


def draw_loop(level: LevelResult, bla: BlaEstimate) -> Figure:
    """Draw the coherence and, where it is known, the sensitivity with its band and its peak."""
    rows = 1 if bla.sensitivity is None else 2
    title = f"Coherence, {level_name(level)}" if rows == 1 else f"Loop, {level_name(level)}"
    figure, axes = stacked_axes(rows, 1.2 + 1.7 * rows, title, (1,) * rows)
    f = bla.frequency_hz
    for one, name, color in _outputs(bla):
        axes[0].plot(f, one.coherence, "o-", color=color, ms=2, lw=0.8, label=name)
    axes[0].set_ylabel("coherence")
    legend(axes[0])
    if bla.sensitivity is not None:
        s, radius, axis = bla.sensitivity.s, bla.sensitivity.s_radius_95, axes[1]
        axis.fill_between(f, *magnitude_band_db(s, radius), color=EXCITED, alpha=BAND, lw=0,
                          label="95 % band")  # fmt: skip
        axis.plot(f, decibel(s), "o-", color=EXCITED, ms=2, lw=0.8, label="|S|")
        top = peak(bla)
        if top is not None:
            label = f"Ms = {top.ms:.3g}"
            axis.plot(top.frequency_hz, decibel(top.ms), "D", color=ODD, ms=4, label=label)
        axis.set_ylabel("|S| (dB)")
        legend(axis)
    frequency_axis(axes, f)
    return figure


def draw_nyquist(level: LevelResult, bla: BlaEstimate) -> Figure:
    """Draw G and, where the sensitivity is known, the loop G C in the complex plane."""
    count = 1 if bla.sensitivity is None else 2
    figure = Figure(figsize=(WIDTH_IN, 3.4))
    figure.text(0.1, 1.0 - 0.14 / 3.4, f"Nyquist, {level_name(level)}", va="center", fontsize=11)
    axes = [figure.add_axes((0.12 + 0.47 * i, 0.13, 0.37, 0.7)) for i in range(count)]
    for one, name, color in _outputs(bla):
        discs = one.g[:, None] + one.radius_95[:, None] * CORNERS
        _draw_curve(axes[0], one.g, discs, f"G, {name}", color)
    axes[0].set(xlabel="real part (rad/(N m))", ylabel="imaginary part (rad/(N m))")
    if bla.sensitivity is not None:
        curve, discs = loop_discs(bla.sensitivity, CORNERS)
        _draw_curve(axes[1], curve, discs, "G C", EXCITED)
        axes[1].plot(-1.0, 0.0, "x", color=ODD, ms=5)
        top = peak(bla)
        if top is not None:
            around = CORNERS / top.ms - 1.0
            axes[1].plot(around.real, around.imag, ":", color=ODD, lw=0.9, label="distance 1/Ms")
        axes[1].set(xlim=(-3.0, 1.5), ylim=(-2.25, 2.25), xlabel="real part")
        axes[1].set_aspect("equal")
    axes[0].set_aspect("equal", adjustable="datalim")
    for axis in axes:
        axis.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2, ncol=2)
    return figure


def _outputs(bla: BlaEstimate) -> list[tuple[OutputBla, str, str]]:
    made: list[tuple[OutputBla, str, str]] = [(bla, "motor", EXCITED)]
    return made if bla.link is None else [*made, (bla.link, "link", EVEN)]


def _draw_curve(axis: Axes, g: np.ndarray, discs: np.ndarray, label: str, color: str) -> None:
    known = discs[np.isfinite(discs).all(axis=1)]
    outlines = list(np.stack([known.real, known.imag], axis=-1))
    axis.add_collection(PolyCollection(outlines, facecolor=color, alpha=BAND, lw=0))
    axis.plot(g.real, g.imag, "o-", color=color, ms=2, lw=0.6, label=label)
