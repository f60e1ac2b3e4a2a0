"""Interactive plots of the report: plotly figures as plain dicts.

Colours are names of the style sheet's variables ("--excited"); the page puts in the values, so that
light, dark and print share one description.
"""

from __future__ import annotations

import numpy as np

from fjr_kit.number_text import SIGMA
from fjr_kit.plots import (
    SECONDS,
    Options,
    Plot,
    Trace,
    area,
    extremes,
    linked,
    numbers,
    stack,
    trace,
)
from fjr_records.realization import TimeSignals

from ..results.result import BlaEstimate, LevelResult, LineLevels, OutputBla
from ..results.summary import (
    bla_phase_deg,
    decibel,
    magnitude_band_db,
    phase_deg,
    phase_reach_deg,
    shown_signals,
    signal_at,
    significant,
    total_distortion,
)
from .loop_plots import loop_plots

KINDS = (
    ("excited", "excited lines", "--excited", "circle"),
    ("odd", "odd detection lines", "--odd", "triangle-up"),
    ("even", "even lines", "--even", "square"),
)
MODEL_LINES = (("--ink", "solid"), ("--model", "dash"), ("--ink", "dot"), ("--model", "dashdot"))


def level_plots(level: LevelResult) -> dict[str, Plot]:
    """Return the plots of a level by the identifier of their place in the page."""
    plots = {"time": _time(level.signals)}
    if level.excited.frequency_hz.size:
        plots = {"spectra": _spectra(level), "distortion": _distortion(level)} | plots
    if level.bla is None:
        return plots
    return {"bla": _bla(level, level.bla), **loop_plots(level.bla)} | plots


def _bla(level: LevelResult, bla: BlaEstimate) -> Plot:
    """Return magnitude and phase of the BLA, its uncertainties and the models."""
    f, traces = bla.frequency_hz, []
    for color, dash, c in zip(*_model_lines(level), level.comparisons, strict=True):
        traces.append(trace(f, decibel(c.g0), c.name, color, dash=dash, unit="dB"))
        phase: Options = {"row": 2, "showlegend": False, "unit": "degrees"}
        traces.append(trace(f, phase_deg(c.g0), c.name, color, dash=dash, **phase))
    traces += _uncertainties(bla) + _bands(level, bla)
    traces += _link_points(bla) + _bla_points(level, bla)
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)"]
    return linked(traces, titles, [2.2, 1.0], f)


def outputs(level: LevelResult, bla: BlaEstimate) -> list[tuple[OutputBla, np.ndarray, str, str]]:
    """Return the BLA, phase (degrees), ending of its name and colour of each output."""
    made: list[tuple[OutputBla, np.ndarray, str, str]] = [
        (bla, bla_phase_deg(level, bla), "", "--excited")
    ]
    if bla.link is not None:
        made.append((bla.link, phase_deg(bla.link.g), ", link position", "--even"))
    return made


def _model_lines(level: LevelResult) -> tuple[list[str], list[str]]:
    lines = [MODEL_LINES[i % len(MODEL_LINES)] for i in range(len(level.comparisons))]
    return [color for color, _ in lines], [dash for _, dash in lines]


def _bla_points(level: LevelResult, bla: BlaEstimate) -> list[Trace]:
    """Return the points of the BLA; hollow where the line is unreliable."""
    traces, phase = [], bla_phase_deg(level, bla)
    for keep, name, symbol in (
        (bla.reliable, "BLA", "circle"),
        (~bla.reliable, "BLA, unreliable", "circle-open"),
    ):
        if keep.any():
            f, radius = bla.frequency_hz[keep], (bla.radius_95 / np.abs(bla.g))[keep]
            mark: Options = {"symbol": symbol, "customdata": numbers(100.0 * radius)}
            note = "dB, 95 % radius %{customdata:.3g} % of |G|"
            traces.append(trace(f, decibel(bla.g)[keep], name, "--excited", **mark, unit=note))
            mark |= {"row": 2, "showlegend": False, "unit": "degrees"}
            traces.append(trace(f, phase[keep], name, "--excited", **mark))
    return traces


def _bands(level: LevelResult, bla: BlaEstimate) -> list[Trace]:
    """Return the bands that the discs of each output span, in magnitude and phase."""
    f, traces = bla.frequency_hz, []
    for one, phase, what, color in outputs(level, bla):
        if not np.isfinite(one.radius_95).any():
            continue
        name = f"95 % band{what}"
        traces.append(area(f, *magnitude_band_db(one.g, one.radius_95), name, color))
        reach = phase_reach_deg(one.g, one.radius_95)
        lower: Options = {"row": 2, "showlegend": False}
        traces.append(area(f, phase - reach, phase + reach, name, color, **lower))
    return traces


def _link_points(bla: BlaEstimate) -> list[Trace]:
    """Return the BLA of the link position, with the radius of its disc, where there is one."""
    if bla.link is None:
        return []
    f, link, name = bla.frequency_hz, bla.link, "BLA, link position"
    mark: Options = {"symbol": "square", "size": 4}
    dashed: Options = {"dash": "dot", "unit": "dB"}
    disc = trace(f, decibel(link.radius_95), "95 % disc, link position", "--radius", **dashed)
    return [
        *([disc] if np.isfinite(link.radius_95).any() else []),
        trace(f, decibel(link.g), name, "--even", **mark, unit="dB"),
        trace(
            f, phase_deg(link.g), name, "--even", **mark, row=2, showlegend=False, unit="degrees"
        ),
    ]


def _uncertainties(bla: BlaEstimate) -> list[Trace]:
    f, radius = bla.frequency_hz, "radius of the 95 % disc"
    traces = []
    if np.isfinite(bla.radius_95).any():
        traces.append(trace(f, decibel(bla.radius_95), radius, "--radius", dash="solid", unit="dB"))
    if np.isfinite(bla.var_nonlinear).any():
        keep = significant(bla)
        name = f"{SIGMA} nonlinear (significant at {keep.sum()})"
        y = decibel(np.sqrt(bla.var_nonlinear[keep]))
        traces.append(trace(f[keep], y, name, "--nonlinear", symbol="diamond", unit="dB"))
    if np.isfinite(bla.var_noise).any():
        y = decibel(np.sqrt(bla.var_noise))
        traces.append(trace(f, y, f"{SIGMA} noise of the BLA", "--noise", dash="solid", unit="dB"))
    return traces


def _spectra(level: LevelResult) -> Plot:
    """Return the spectra of reference, torque and position by kind of line."""
    titles, named = [], set()
    rows = shown_signals(level)
    traces = _noise((level.excited,), row=len(rows))
    for row, (signal, unit) in enumerate(rows, start=1):
        titles.append(f"{signal} (dB re 1 {unit})")
        for kind, name, color, symbol in reversed(KINDS):
            lines: LineLevels = getattr(level, kind)
            y = decibel(signal_at(level, lines, signal))
            if np.isfinite(y).any():
                mark: Options = {"symbol": symbol, "row": row, "showlegend": name not in named}
                f, note = lines.frequency_hz, f"dB re 1 {unit}"
                traces.append(trace(f, y, name, color, **mark, unit=note))
                named.add(name)
    return linked(traces, titles, [1.0] * len(rows), level.excited.frequency_hz)


def _noise(kinds: tuple[LineLevels, ...], row: int) -> list[Trace]:
    f = np.concatenate([lines.frequency_hz for lines in kinds])
    y = decibel(np.concatenate([lines.noise for lines in kinds]))
    mark: Options = {"symbol": "circle", "size": 3, "row": row, "unit": "dB re 1 rad"}
    return [trace(f, y, f"noise ({SIGMA})", "--noise", **mark)] if np.isfinite(y).any() else []


def _distortion(level: LevelResult) -> Plot:
    """Return the linear output, odd and even distortion and noise."""
    note: Options = {"unit": "dB re 1 rad"}
    traces = _noise((level.excited, level.odd, level.even), row=1)
    for kind, _, color, symbol in reversed(KINDS[1:]):
        lines: LineLevels = getattr(level, kind)
        if len(lines.frequency_hz):
            f, name = lines.frequency_hz, f"{kind} distortion"
            faint: Options = {"symbol": symbol, "opacity": 0.4, "showlegend": False}
            traces.append(trace(f, decibel(lines.corrected), name, color, **faint, **note))
            traces.append(trace(f, decibel(lines.smoothed), name, color, dash="solid", **note))
    total = decibel(total_distortion(level))
    if np.isfinite(total).any():
        mark: Options = {"symbol": "diamond", "size": 4}
        what = "distortion and noise at excited lines"
        traces.append(trace(level.excited.frequency_hz, total, what, "--nonlinear", **mark, **note))
    _, name, color, symbol = KINDS[0]
    f, y = level.excited.frequency_hz, decibel(level.excited.position)
    traces.append(trace(f, y, name, color, symbol=symbol, **note))
    return linked(traces, ["position (dB re 1 rad)"], [1.0], f)


def _time(signals: TimeSignals) -> Plot:
    """Return the signals of one period; long ones by the extremes of each bin."""
    rows = (
        ("reference", signals.reference_rad, "rad"),
        ("torque", signals.torque_nm, "N m"),
        ("position", signals.position_rad, "rad"),
    )
    shown = [row for row in rows if np.isfinite(row[1]).any()]
    traces = []
    for row, (name, values, unit) in enumerate(shown, start=1):
        t, y = extremes(signals.time_s, values)
        style: Options = {"dash": "solid", "width": 1.0, "row": row, "showlegend": False}
        traces.append(trace(t, y, name, "--ink", **style, unit=unit, at=SECONDS))
    titles = [f"{name} ({unit})" for name, _, unit in shown]
    return {"data": traces, "layout": stack(titles, [1.0] * len(shown), "time (s)")}
