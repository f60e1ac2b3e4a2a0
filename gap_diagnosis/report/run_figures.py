"""Figures of the runs of a diagnosis: error by band after each step, torque the model lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from fjr_kit.figure_style import EXCITED, NOISE, ODD, WIDTH_IN, legend, log_values
from fjr_kit.number_text import SIGMA

from ..how_far.run_comparison import RunComparison
from ..outcome.cause_words import two_digits
from ..outcome.verdict_words import explanation
from .gap_figures import LEVEL_COLORS

_STEPS = (NOISE, ODD, EXCITED, *LEVEL_COLORS[::-1])


def run_figures(found: Sequence[RunComparison], *, known: bool) -> dict[str, Callable[[], Figure]]:
    """Return what draws each figure by its name.

    Args:
        found: the levels.
        known: whether the noise is.
    """
    return {
        "error_by_band": partial(draw_bands, found, known=known),
        "missing_torque": partial(draw_missing_torque, found),
    }


def draw_bands(found: Sequence[RunComparison], *, known: bool) -> Figure:
    """Draw the rms error in each band after each step, a row for each level."""
    rows = len(found)
    tall = 0.7 + 1.4 * rows
    figure = Figure(figsize=(WIDTH_IN, tall))
    grid = figure.add_gridspec(
        rows, 1, left=0.1, right=0.74, bottom=0.44 / tall, top=1 - 0.32 / tall, hspace=0.25
    )
    what = {"motion": "position", "torque": "torque"}[found[0].compared]
    figure.text(0.1, 1 - 0.14 / tall, f"Error of the {what} by band", va="center", fontsize=11)
    axes = [figure.add_subplot(grid[row]) for row in range(rows)]
    for axis, level in zip(axes, found, strict=True):
        for order, (name, errors) in enumerate(level.errors.items()):
            last = name.split(" + ")[-1]
            label = last if name in ("nominal", "refit") else f"+ {explanation([last])}"
            color = _STEPS[min(order, len(_STEPS) - 1)]
            axis.plot(np.arange(errors.size), errors, "o-", color=color, label=label)
        if known:
            axis.axhline(1.0, color=NOISE, lw=0.8, ls="--", label="noise")
        log_values(axis)
        ends = level.edges_hz
        axis.set_xticks(range(ends.size - 1), [f"to {two_digits(end)}" for end in ends[1:]])
        axis.set_ylabel(f"level {level.level}: error / {SIGMA if known else level.compared}")
    axes[-1].set_xlabel("band (Hz)", labelpad=1)
    legend(axes[0], *axes[1:])
    return figure


def draw_missing_torque(found: Sequence[RunComparison]) -> Figure:
    """Draw the torque that refit and best model lack over velocity and angle, by level."""
    tall = 4.0
    figure = Figure(figsize=(WIDTH_IN, tall))
    figure.text(0.1, 1 - 0.14 / tall, "Torque that the model lacks", va="center", fontsize=11)
    grid = figure.add_gridspec(
        2, 1, left=0.1, right=0.74, bottom=0.44 / tall, top=1 - 0.32 / tall, hspace=0.4
    )
    styles = (("refit", "refit", ODD), ("explained", "best explanation", EXCITED))
    names = ("motor velocity (rad/s)", "motor position (rad)")
    axes = [figure.add_subplot(grid[row]) for row in range(2)]
    for row, (axis, name) in enumerate(zip(axes, names, strict=True)):
        for level in found:
            curves = (level.over_velocity, level.over_angle)[row]
            for key, label, color in styles:
                if key in curves:
                    axis.plot(curves[key].center, curves[key].torque, color=color, label=label)
        axis.axhline(0.0, color="black", lw=0.5)
        axis.set_xlabel(name, labelpad=1)
        axis.set_ylabel("torque (N m)")
    legend(axes[0], axes[1])
    return figure
