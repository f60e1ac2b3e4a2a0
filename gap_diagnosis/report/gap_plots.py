"""Interactive plots of steady periods: where the gap lies, and the residual torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fjr_kit.number_text import SIGMA
from fjr_kit.plots import (
    BARRED,
    LOG,
    PLAIN,
    Options,
    Plot,
    Trace,
    frequency_layout,
    numbers,
    trace,
)

from ..where.residual_map import KINDS, ResidualMap, Signal
from ..where.residual_torque import ResidualTorque
from ..where.torque_curves import COORDINATES, Coordinate, curve

STAGES = {"nominal": "nominal", "refit": "after the refit", "explained": "best explanation"}
"""Models in order, and what a map of each is called."""
SCALE = [[at, f"--sigma{i}"] for i, at in enumerate((0.0, 0.34, 0.6, 0.8, 1.0))]
"""Noise is grey and near to the page, light or dark; what is strongest stands out most from it."""
MOST_DECADES = 4.0
KIND_STYLES = {
    "excited": ("excited lines", "--excited", "circle"),
    "odd": ("odd detection lines", "--odd", "triangle-up"),
    "even": ("even lines", "--even", "square"),
}
UNITS: dict[Coordinate, str] = {"velocity": "rad/s", "position": "rad", "deflection": "rad"}


def where_plot(maps: Mapping[str, ResidualMap], signal: Signal) -> Plot:
    """Return maps of sigma over frequency, level and kind of line (rows), one for each stage."""
    shown = {name: maps[name] for name in STAGES if name in maps}
    first = next(iter(shown.values()))
    kinds = [kind for kind in KINDS if kind != "dc" and (first.kinds == kind).any()]
    rows = [(level, kind) for kind in reversed(kinds) for level in range(len(first.levels))]
    axes = frequency_layout(
        [STAGES[name] for name in shown], [1.0] * len(shown), first.frequency_hz[1:]
    )
    traces = []
    for number, (name, found) in enumerate(shown.items(), start=1):
        traces.append(_map_trace(found, signal, rows, number, len(shown)))
        axes[f"yaxis{number if number > 1 else ''}"] |= {
            "title": {"text": STAGES[name], "standoff": 12},
            "tickvals": list(range(len(rows))),
            "ticktext": [f"{kind} {found.amplitudes_rad[row]:.2g}" for row, kind in rows],
            "range": [-0.6, len(rows) - 0.4],
        }
    return {"data": traces, "layout": axes | BARRED, "linked": True}


def _map_trace(
    found: ResidualMap, signal: Signal, rows: Sequence[tuple[int, str]], number: int, count: int
) -> Trace:
    x, y, color, text = [], [], [], []
    part = found.signals[signal]
    for height, (row, kind) in enumerate(rows):
        lines = np.flatnonzero(found.kinds == kind)
        sigma = part.sigma[row, lines]
        x += numbers(found.frequency_hz[lines])
        y += [float(height)] * lines.size
        color += numbers(np.clip(np.log10(np.maximum(sigma, 1e-3)), 0.0, MOST_DECADES))
        text += [f"{value:.3g} {SIGMA}" for value in sigma]
    ticks = list(range(int(MOST_DECADES) + 1))
    bar = {
        "title": {"text": f"{SIGMA}"},
        "tickvals": ticks,
        "ticktext": [f"{10**tick:g}" for tick in ticks],
        "thickness": 12,
    }
    marker = {
        "symbol": "square",
        "size": 7,
        "color": color,
        "colorscale": SCALE,
        "cmin": 0.0,
        "cmax": MOST_DECADES,
        "showscale": number == count,
        "colorbar": bar,
    }
    made: Trace = {"type": "scatter", "mode": "markers", "x": x, "y": y, "marker": marker}
    made["showlegend"] = False
    made |= {"text": text, "hovertemplate": "%{x:.4g} Hz<br>%{text}<extra></extra>"}
    return made | ({"yaxis": f"y{number}"} if number > 1 else {})


def sigma_plot(maps: Mapping[str, ResidualMap], row: int, signal: Signal) -> Plot:
    """Return sigma over frequency at one level, a plot for each stage."""
    shown = {name: maps[name] for name in STAGES if name in maps}
    first = next(iter(shown.values()))
    titles = [f"{SIGMA} {STAGES[name]}" for name in shown]
    axes = frequency_layout(titles, [1.0] * len(shown), first.frequency_hz[1:])
    every = np.array([found.signals[signal].sigma[row, 1:] for found in shown.values()])
    top = np.log10(max(float(np.nanmax(np.where(np.isfinite(every), every, 1.0))), 10.0)) + 0.2
    traces = []
    for number, found in enumerate(shown.values(), start=1):
        axes[f"yaxis{number if number > 1 else ''}"] |= LOG | {"range": [-1.0, top]}
        for kind, (name, color, symbol) in KIND_STYLES.items():
            lines = found.kinds == kind
            mark: Options = {"symbol": symbol, "row": number, "showlegend": number == 1}
            sigma = found.signals[signal].sigma[row, lines]
            f = found.frequency_hz[lines]
            traces.append(trace(f, sigma, name, color, **mark, unit=SIGMA))
    return {"data": traces, "layout": axes, "linked": True}


def torque_plot(before: ResidualTorque, after: ResidualTorque | None, level: int) -> Plot:
    """Return the residual torque over velocity, position and deflection at one level."""
    traces = []
    for row, coordinate in enumerate(COORDINATES, start=1):
        directions = (0,) if coordinate == "velocity" else (1, -1)
        stages = ((before, "after the refit", "--model"), (after, "best explanation", "--excited"))
        for residual, name, color in stages:
            if residual is None:
                continue
            for direction in directions:
                found = curve(residual, coordinate, direction, level)
                options: Options = {"row": row}
                options["dash"] = "dot" if direction < 0 else "solid"
                options |= {"unit": "N m", "at": f"{PLAIN} {UNITS[coordinate]}"}
                options["showlegend"] = row == 1
                made = trace(found.center, found.torque, name, color, **options)
                traces.append(made | {"xaxis": f"x{row}" if row > 1 else "x"})
    return {"data": traces, "layout": _torque_layout()}


def _torque_layout() -> Options:
    axes: Options = {}
    names = {"velocity": "motor velocity", "position": "motor position", "deflection": "deflection"}
    height, gap = 0.24, 0.14
    for row, coordinate in enumerate(COORDINATES, start=1):
        suffix = row if row > 1 else ""
        top = 1.0 - (row - 1) * (height + gap)
        title = f"{names[coordinate]} ({UNITS[coordinate]})"
        axes[f"xaxis{suffix}"] = {"title": {"text": title}, "anchor": f"y{suffix}"}
        axes[f"yaxis{suffix}"] = {
            "title": {"text": "torque (N m)"},
            "domain": [max(round(top - height, 4), 0.0), round(top, 4)],
            "anchor": f"x{suffix}",
        }
    return axes
