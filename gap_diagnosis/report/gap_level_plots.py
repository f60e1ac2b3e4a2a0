"""Interactive plots by level: BLA, distortion and one period of rig and simulations."""

from __future__ import annotations

import numpy as np

from bla_analyzer.results.result import LineLevels
from bla_analyzer.results.summary import decibel, phase_deg
from fjr_kit.plots import SECONDS, Options, Plot, Trace, extremes, linked, stack, trace

from ..how_far.bla_comparison import LevelComparison, Response

MODEL_STYLES = {
    "nominal": ("nominal", "--noise", "dot"),
    "refit": ("refit", "--model", "dash"),
    "explained": ("best explanation", "--excited", "solid"),
}
"""Name, colour and dash of each simulation; the rig is drawn in points."""


def level_plots(found: LevelComparison) -> dict[str, Plot]:
    """Return the plots of a level by the identifier of their place in the page."""
    return {"bla": _bla(found), "distortion": _distortion(found), "time": _time(found)}


def _models(found: LevelComparison) -> list[tuple[Response, tuple[str, str, str]]]:
    return [(found.models[m], style) for m, style in MODEL_STYLES.items() if m in found.models]


def _bla(found: LevelComparison) -> Plot:
    """Return magnitude, phase and the distance from the rig's BLA beside its uncertainty."""
    f, rig, traces = found.frequency_hz, found.rig, []
    for response, (name, color, dash) in _models(found):
        line: Options = {"dash": dash, "unit": "dB"}
        traces.append(trace(f, decibel(response.g), name, color, **line))
        line |= {"row": 2, "showlegend": False, "unit": "degrees"}
        traces.append(trace(f, _phase(response.g, rig.g), name, color, **line))
        line |= {"row": 3, "unit": "dB"}
        traces.append(trace(f, decibel(response.g - rig.g), name, color, **line))
    point: Options = {"symbol": "circle", "unit": "dB"}
    traces.append(trace(f, decibel(rig.g), "rig", "--ink", **point))
    point |= {"row": 2, "showlegend": False, "unit": "degrees"}
    traces.append(trace(f, phase_deg(rig.g), "rig", "--ink", **point))
    if np.isfinite(rig.radius_95).any():
        y = decibel(rig.radius_95)
        disc: Options = {"dash": "solid", "row": 3, "unit": "dB"}
        traces.append(trace(f, y, "95 % disc of the rig's BLA", "--radius", **disc))
    distance = "|model \N{MINUS SIGN} rig| (dB)"
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)", distance]
    return linked(traces, titles, [1.4, 1.0, 1.2], f)


def _phase(g: np.ndarray, rig: np.ndarray) -> np.ndarray:
    """Return the phase in degrees on the branch nearest to the rig's."""
    return phase_deg(rig) + np.angle(g / rig, deg=True)


def _distortion(found: LevelComparison) -> Plot:
    """Return odd and even distortion at the output, corrected for the loop."""
    traces = []
    for row, kind in enumerate(("odd", "even"), start=1):
        for response, (name, color, dash) in _models(found):
            options: Options = {"dash": dash, "row": row, "showlegend": row == 1}
            traces += _distorted(getattr(response, kind), name, color, options)
        lines = getattr(found.rig, kind)
        point: Options = {"symbol": "circle", "row": row, "showlegend": row == 1, "opacity": 0.45}
        traces += _distorted(lines, "rig", "--ink", point, smooth=False)
        if lines.frequency_hz.size and np.isfinite(lines.noise).any():
            dots: Options = {"symbol": "circle", "size": 3, "row": row, "showlegend": row == 1}
            y, unit = decibel(lines.noise), "dB re 1 rad"
            traces.append(trace(lines.frequency_hz, y, "noise", "--noise", **dots, unit=unit))
    titles = ["odd (dB re 1 rad)", "even (dB re 1 rad)"]
    return linked(traces, titles, [1.0, 1.0], found.frequency_hz)


def _distorted(
    lines: LineLevels, name: str, color: str, options: Options, smooth: bool = True
) -> list[Trace]:
    if not lines.frequency_hz.size:
        return []
    y = decibel(lines.smoothed if smooth else lines.corrected)
    return [trace(lines.frequency_hz, y, name, color, **options, unit="dB re 1 rad")]


def _time(found: LevelComparison) -> Plot:
    """Return one period of y, and what each simulation misses of y and u."""
    t, traces = found.time_s, []
    x, y = extremes(t, found.position["rig"])
    line: Options = {"dash": "solid", "width": 1.0, "at": SECONDS}
    traces.append(trace(x, y, "rig", "--ink", **line, unit="rad"))
    for row, unit, signals in ((2, "rad", found.position), (3, "N m", found.torque)):
        for name, (label, color, _) in MODEL_STYLES.items():
            if name in signals:
                x, y = extremes(t, signals[name] - signals["rig"])
                line |= {"row": row, "showlegend": row == 2}
                traces.append(trace(x, y, label, color, **line, unit=unit))
    minus = "\N{MINUS SIGN}"
    titles = ["y of the rig (rad)", f"y, model {minus} rig (rad)", f"u, model {minus} rig (N m)"]
    return {"data": traces, "layout": stack(titles, [0.8, 1.0, 1.0], "time (s)")}
