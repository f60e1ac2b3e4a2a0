"""Interactive plots of a comparison: BLAs over each other with their difference, parameters."""

from __future__ import annotations

import numpy as np

from bla_analyzer.results.summary import decibel, phase_deg
from fjr_kit.plots import Options, Plot, layout, linked, trace

from .result import BlaDifference, Comparison, Pair, ParameterDifference

_FIRST, _OTHER, _MARKED = "--excited", "--odd", "--nonlinear"


def plots(found: Comparison) -> dict[str, Plot]:
    """Return all plots by the identifiers of their places."""
    made: dict[str, Plot] = {}
    for number, pair in enumerate(found.pairs):
        for index, level in enumerate(pair.levels):
            made[place(number, index)] = _bla(level.bla, found.first, pair.other)
        if shown(pair):
            made[place(number)] = _parameters(shown(pair))
    return made


def place(pair: int, level: int | None = None) -> str:
    """Return the identifier of a plot's place."""
    return f"pair-{pair}" if level is None else f"pair-{pair}-level-{level}"


def shown(pair: Pair) -> list[ParameterDifference]:
    """Return the parameters whose relative change can be drawn."""
    return [
        one
        for one in pair.parameters
        if one.change_percent is not None and np.isfinite([one.low, one.high]).all()
    ]


def _bla(bla: BlaDifference, first: str, other: str) -> Plot:
    """Return magnitude and phase of both, and their difference beside its 95 % disc."""
    f, traces = bla.frequency_hz, []
    phase_first = phase_deg(bla.g_first)
    phases = phase_first, phase_first + np.angle(bla.g_other / bla.g_first, deg=True)
    for g, phase, name, color, symbol in (
        (bla.g_first, phases[0], first, _FIRST, "circle"),
        (bla.g_other, phases[1], other, _OTHER, "triangle-up"),
    ):
        style: Options = {"symbol": symbol, "dash": "solid", "width": 1.0}
        traces.append(trace(f, decibel(g), name, color, **style, unit="dB"))
        style |= {"row": 2, "showlegend": False}
        traces.append(trace(f, phase, name, color, **style, unit="degrees"))
    difference = np.abs(bla.g_other - bla.g_first)
    band: Options = {"dash": "solid", "row": 3, "unit": "dB"}
    chance = "chance alone, in 95 % of cases"
    traces.append(trace(f, decibel(bla.radius_95), chance, "--radius", **band))
    mark: Options = {"row": 3, "unit": "dB"}
    for keep, name, color, symbol in (
        (~bla.changed, "difference", "--noise", "circle"),
        (bla.changed, "difference, significant by itself", _MARKED, "diamond"),
    ):
        if keep.any():
            y = decibel(difference[keep])
            traces.append(trace(f[keep], y, name, color, symbol=symbol, **mark))
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)", "|difference| (dB)"]
    return linked(traces, titles, [2.0, 1.0, 1.2], f)


def _parameters(parameters: list[ParameterDifference]) -> Plot:
    """Return the relative change of each parameter with its 95 % interval."""
    names = [one.name for one in parameters]
    at = np.arange(len(names), dtype=float)
    scale = np.array([100.0 / one.first.value for one in parameters])
    ends = np.sort([[one.low, one.high] for one in parameters], axis=1) * scale[:, None]
    ends.sort(axis=1)
    change = np.array([one.change_percent or 0.0 for one in parameters])
    changed = np.array([one.changed for one in parameters])
    traces = []
    for keep, label, color, symbol in (
        (~changed, "no change that can be told from chance", "--noise", "circle"),
        (changed, "changed", _MARKED, "diamond"),
    ):
        if keep.any():
            made = trace(change[keep], at[keep], label, color, symbol=symbol, size=8)
            arms = {
                "array": (ends[keep, 1] - change[keep]).tolist(),
                "arrayminus": (change[keep] - ends[keep, 0]).tolist(),
            }
            style = {"type": "data", "symmetric": False, "color": color, "thickness": 1, "width": 3}
            made["error_x"] = style | arms
            made["hovertemplate"] = "%{x:.3g} %<extra>%{customdata}</extra>"
            made["customdata"] = [name for name, kept in zip(names, keep, strict=True) if kept]
            traces.append(made)
    axes = layout("change (% of the first)", "")
    axes["xaxis"] |= {"zeroline": True, "zerolinecolor": "--muted"}
    axes["yaxis"] |= {
        "tickvals": at.tolist(),
        "ticktext": names,
        "range": [len(names) - 0.5, -0.5],
    }
    return {"data": traces, "layout": axes}
