"""Figures of a fit for papers, PNG and PDF: one for each level."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from fjr_kit.figure_style import (
    EVEN,
    EXCITED,
    NONLINEAR,
    ODD,
    RADIUS,
    STYLE,
    frequency_axis,
    legend,
    save,
    stacked_axes,
)

from ..results.summary import decibel, phase_deg
from .fit_types import Fit, LevelFit
from .fit_words import OUTPUT_WORDS

COLOURS = ((EXCITED, ODD), (EVEN, NONLINEAR))


def write_fit_figures(
    fit: Fit, folder: Path, progress: Callable[[str], None] | None = None
) -> None:
    """Draw the figure of each level into `folder` (which exists), as PNG and PDF."""
    with rc_context(STYLE):
        for level in fit.levels:
            name = f"level_{level.level}_fit"
            if progress is not None:
                progress(f"figure {name}")
            save(draw_fit(level, fit.model), folder / name)


def draw_fit(level: LevelFit, model: str) -> Figure:
    """Draw BLA with discs, model and residual."""
    title = f"{model.capitalize()} model {level.test.name}, {level.name}"
    if model != "rational":
        title = f"{model.capitalize()} model, {level.name}"
    figure, axes = stacked_axes(2, 4.6, title, (2.2, 1))
    magnitude, phase = axes
    for one, (colour, residual) in zip(level.outputs, COLOURS, strict=False):
        f, what, size = one.frequency_hz, OUTPUT_WORDS[one.output], np.abs(one.g)
        arm = np.minimum(one.radius_95, 0.9 * size)
        bars = [decibel(size) - decibel(size - arm), decibel(size + arm) - decibel(size)]
        magnitude.errorbar(
            f, decibel(size), bars, fmt="o", color=colour, elinewidth=0.6, label=f"BLA,\n{what}"
        )
        magnitude.plot(
            one.curve.frequency_hz,
            decibel(one.curve.g),
            "-",
            color="black",
            lw=0.9,
            label="model",
            zorder=5,
        )
        magnitude.plot(
            f, decibel(one.g - one.model), "D", ms=2.2, color=residual, label=f"residual,\n{what}"
        )
        magnitude.plot(
            f, decibel(one.radius_95), "-", color=RADIUS, label="radius of the\n95 % disc"
        )
        curve = phase_deg(one.curve.g)
        turned = np.interp(f, one.curve.frequency_hz, curve)
        phase.plot(
            f,
            turned + np.angle(one.g / np.exp(1j * np.radians(turned)), deg=True),
            "o",
            color=colour,
        )
        phase.plot(one.curve.frequency_hz, curve, "-", color="black", lw=0.9)
    magnitude.set_ylabel("magnitude (dB re 1 rad/(N m))")
    phase.set_ylabel("phase (degrees)")
    frequency_axis(axes, level.outputs[0].frequency_hz)
    legend(magnitude)
    return figure
