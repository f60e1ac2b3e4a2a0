"""Figures of where the gap lies: sigma maps and residual torque.

Colours mean the same in all figures: a kind of line as in the BLA figures, sigma on one scale.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from fjr_kit.figure_style import (
    EVEN,
    EXCITED,
    NOISE,
    ODD,
    WIDTH_IN,
    Style,
    frequency_axis,
    legend,
    log_axis,
    log_values,
    plain_values,
    stacked_axes,
)
from fjr_kit.number_text import SIGMA

from ..where.residual_map import ResidualMap, Signal
from ..where.residual_torque import ResidualTorque
from ..where.torque_curves import COORDINATES, Coordinate, Curve, curve

SIGMA_RANGE = (1.0, 1000.0)
SIGMA_COLORS = "cividis_r"
"""One scale for all sigma maps; perceptually uniform, and the same to colour-blind readers."""
STYLES: dict[str, tuple[str, str, str]] = {
    "excited": ("excited lines", EXCITED, "o"),
    "odd": ("odd detection lines", ODD, "^"),
    "even": ("even lines", EVEN, "s"),
    "dc": ("DC", "#000000", "D"),
}
UNITS: dict[Coordinate, str] = {"velocity": "rad/s", "position": "rad", "deflection": "rad"}
LEVEL_COLORS = ("#92CCEC", "#0072B2", "#00264D")
AFTER = NOISE


def _curves(residual: ResidualTorque, coordinate: Coordinate, bins: int) -> list[Curve]:
    directions = (0,) if coordinate == "velocity" else (-1, 1)
    return [
        curve(residual, coordinate, direction, int(level), bins)
        for level in np.unique(residual.level)
        for direction in directions
    ]


def draw_sigma_maps(maps: Mapping[str, ResidualMap], signal: Signal = "position") -> Figure:
    """Draw sigma over frequency (x) and level (y), a row for each kind of line.

    Args:
        maps: maps to put beside each other by title, such as before, after refit, after the effect.
        signal: position or torque.
    """
    height = 3.9
    figure = Figure(figsize=(WIDTH_IN, height))
    top, bottom = 1 - 0.52 / height, 0.42 / height
    title = f"Where the gap lies: {signal}, over frequency and amplitude of a line (rad)"
    figure.text(0.02, 1 - 0.14 / height, title, va="center", fontsize=11)
    grid = figure.add_gridspec(
        4, len(maps), height_ratios=(1.1, 3, 3, 3), left=0.135, right=0.865,
        bottom=bottom, top=top, hspace=0.16, wspace=0.08,
    )  # fmt: skip
    mesh = None
    for column, (name, found) in enumerate(maps.items()):
        for row, kind in enumerate(("dc", "excited", "odd", "even")):
            axis = figure.add_subplot(grid[row, column])
            mesh = _draw_kind(axis, found, kind, signal) or mesh
            _label_map(axis, found, kind, first=column == 0)
            if row == 0:
                axis.set_title(name, fontsize=9, pad=3)
    if mesh is not None:
        bar = figure.add_axes((0.88, bottom, 0.018, top - bottom))
        figure.colorbar(mesh, cax=bar, label=f"residual / noise ({SIGMA})", extend="both")
        plain_values(bar)
    return figure


def _draw_kind(axis: Axes, found: ResidualMap, kind: str, signal: Signal):
    """Draw the lines of one kind as cells; return the mesh, None if there are none."""
    chosen = np.flatnonzero(found.kinds == kind)
    rows = np.arange(len(found.levels) + 1) - 0.5
    axis.grid(False)
    axis.set_ylim(rows[0], rows[-1])
    if not chosen.size:
        return None
    sigma = found.signals[signal].sigma[:, chosen]
    finite = np.nan_to_num(sigma, nan=SIGMA_RANGE[0], posinf=1e12)
    norm = LogNorm(*SIGMA_RANGE)
    return axis.pcolormesh(
        _edges(found.frequency_hz[chosen]), rows, finite, norm=norm, cmap=SIGMA_COLORS
    )


def _edges(frequency_hz: np.ndarray) -> np.ndarray:
    """Return the borders of cells, half way between lines."""
    if frequency_hz.size == 1:
        return np.array([-0.5, 0.5]) + frequency_hz[0]
    middle = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    first = max(2 * frequency_hz[0] - middle[0], 0.5 * frequency_hz[0])
    return np.concatenate([[first], middle, [2 * frequency_hz[-1] - middle[-1]]])


def _label_map(axis: Axes, found: ResidualMap, kind: str, first: bool) -> None:
    names = [f"{amplitude:.2g}" for amplitude in found.amplitudes_rad]
    shown = first and kind != "dc"
    axis.set_yticks(range(len(names)), names if shown else [""] * len(names))
    axis.tick_params(length=2)
    if kind == "dc":
        axis.set_xticks([])
    else:
        lines = found.frequency_hz[1:]
        log_axis(axis, lines[0] / 1.1, lines[-1] * 1.1)
        axis.tick_params(labelbottom=kind == "even", which="both")
    if kind == "even":
        axis.set_xlabel("frequency (Hz)", labelpad=1)
    if first:
        label = {"dc": "DC", "odd": "odd, free"}.get(kind, kind)
        axis.set_ylabel(label, rotation=0 if kind == "dc" else 90, labelpad=4)
        axis.yaxis.set_label_coords(-0.15 if kind == "dc" else -0.32, 0.2 if kind == "dc" else 0.5)


def draw_sigma_lines(found: ResidualMap, signal: Signal = "position") -> Figure:
    """Draw sigma of every line over frequency, a row for each level; discoveries are filled."""
    rows = len(found.levels)
    figure, axes = stacked_axes(
        rows, 0.8 + 1.3 * rows, f"Gap over frequency: {signal}", (1,) * rows
    )
    part = found.signals[signal]
    for row, axis in enumerate(axes):
        for kind, (label, color, marker) in STYLES.items():
            for filled in (False, True):
                chosen = (found.kinds == kind) & (part.significant[row] == filled)
                at = found.frequency_hz[chosen]
                at = np.full_like(at, found.frequency_hz[1] * 0.7) if kind == "dc" else at
                style: Style = {"color": color, "mfc": color if filled else "none", "mew": 0.6}
                axis.plot(
                    at, part.sigma[row, chosen], marker, label=label if filled else None, **style
                )
        axis.axhline(1.0, color=NOISE, lw=0.8)
        log_values(axis)
        axis.set_ylabel(f"{SIGMA} at {found.amplitudes_rad[row]:.2g} rad")
    frequency_axis(axes, found.frequency_hz[1:])
    low, high = axes[-1].get_xlim()
    axes[-1].set_xlim(low * 0.6, high)
    legend(axes[0], *axes[1:])
    return figure


def draw_residual_torque(
    residual: ResidualTorque, after: ResidualTorque | None = None, bins: int = 40
) -> Figure:
    """Draw tau_res over velocity, position and deflection; a shade for each level.

    Args:
        residual: before.
        after: with the effect in the model, grey.
        bins: bins of a curve.
    """
    height = 5.4
    figure = Figure(figsize=(WIDTH_IN, height))
    figure.text(
        0.02,
        1 - 0.14 / height,
        "Torque that the model lacks on the motor",
        va="center",
        fontsize=11,
    )
    grid = figure.add_gridspec(
        3, 1, left=0.1, right=0.755, bottom=0.42 / height, top=1 - 0.3 / height, hspace=0.42
    )
    axes = [figure.add_subplot(grid[row]) for row in range(3)]
    for axis, coordinate in zip(axes, COORDINATES, strict=True):
        if after is not None:
            for found in _curves(after, coordinate, bins):
                axis.plot(
                    found.center, found.torque, "-", color=AFTER, lw=0.7, label="with the effect"
                )
        _draw_curves(axis, _curves(residual, coordinate, bins))
        axis.axhline(0.0, color="black", lw=0.5)
        axis.set_xlabel(f"{_AXES[coordinate]} ({UNITS[coordinate]})", labelpad=1)
        axis.set_ylabel("torque (N m)")
    axes[1].plot([], [], "--", color="black", lw=0.9, label="moving backward")
    legend(axes[0], *axes[1:])
    return figure


_AXES: dict[Coordinate, str] = {
    "velocity": "motor velocity",
    "position": "motor position",
    "deflection": "deflection of the transmission",
}


def _draw_curves(axis: Axes, curves: list[Curve]) -> None:
    levels = sorted({found.level for found in curves if found.level is not None})
    for found in curves:
        order = 0 if found.level is None else levels.index(found.level)
        color = LEVEL_COLORS[-1 - (len(levels) - 1 - order) % len(LEVEL_COLORS)]
        dash = {1: "-", -1: "--", 0: "-"}[found.direction]
        style: Style = {"color": color, "ls": dash, "label": f"level {found.level}"}
        axis.plot(found.center, found.torque, marker=".", ms=2, **style)
        axis.fill_between(
            found.center,
            found.torque - 2 * found.std,
            found.torque + 2 * found.std,
            color=color,
            alpha=0.2,
            lw=0,
        )
