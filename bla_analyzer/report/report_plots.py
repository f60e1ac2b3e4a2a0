"""Interactive plots of the report: plotly figures as plain dicts.

Colours are names of the style sheet's variables ("--excited"); the page puts in the values, so that
light, dark and print share one description.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fjr_kit.plots import (
    LOG,
    SECONDS,
    Options,
    Plot,
    Trace,
    extremes,
    frequency_layout,
    layout,
    linked,
    numbers,
    stack,
    trace,
)
from fjr_records.realization import TimeSignals

from ..results.result import BlaEstimate, LevelResult, LineLevels, Result
from ..results.summary import (
    bla_phase_deg,
    decibel,
    level_name,
    phase_deg,
    signal_at,
    significant,
    summarize,
    total_distortion,
)

SIGMA = "\N{GREEK SMALL LETTER SIGMA}"
KINDS = (
    ("excited", "excited lines", "--excited", "circle"),
    ("odd", "odd detection lines", "--odd", "triangle-up"),
    ("even", "even lines", "--even", "square"),
)
AMPLITUDE = "%{x:.4g} rad"
MODEL_LINES = (("--ink", "solid"), ("--model", "dash"), ("--ink", "dot"), ("--model", "dashdot"))


def level_plots(level: LevelResult) -> dict[str, Plot]:
    """Return the plots of a level by the identifier of their place in the page."""
    plots = {"time": _time(level.signals)}
    if level.excited.frequency_hz.size:
        plots = {"spectra": _spectra(level), "distortion": _distortion(level)} | plots
    return plots if level.bla is None else {"bla": _bla(level, level.bla)} | plots


def overview_plots(result: Result) -> dict[str, Plot]:
    """Return the plots over all levels; none if there is only one level."""
    if len(result.levels) < 2:
        return {}
    return {"all-bla": _all_bla(result), "all-v": _all_v(result), "all-power": _all_power(result)}


def _bla(level: LevelResult, bla: BlaEstimate) -> Plot:
    """Return magnitude and phase of the BLA, its uncertainties and the models."""
    f, traces = bla.frequency_hz, []
    for color, dash, c in zip(*_model_lines(level), level.comparisons, strict=True):
        traces.append(trace(f, decibel(c.g0), c.name, color, dash=dash, unit="dB"))
        phase: Options = {"row": 2, "showlegend": False, "unit": "degrees"}
        traces.append(trace(f, phase_deg(c.g0), c.name, color, dash=dash, **phase))
    traces += _uncertainties(bla) + _bla_points(level, bla)
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)"]
    return linked(traces, titles, [2.2, 1.0], f)


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


def _uncertainties(bla: BlaEstimate) -> list[Trace]:
    f, radius = bla.frequency_hz, "radius of the 95 % disc"
    traces = [trace(f, decibel(bla.radius_95), radius, "--radius", dash="solid", unit="dB")]
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
    traces, titles, named = _noise((level.excited,), row=3), [], set()
    rows = (("reference", "rad"), ("torque", "N m"), ("position", "rad"))
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
    return linked(traces, titles, [1.0, 1.0, 1.0], level.excited.frequency_hz)


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


def _amplitudes(result: Result) -> np.ndarray:
    return np.array(
        [
            np.sqrt(np.mean(level.amplitude_rad**2)) if level.amplitude_rad.size else np.nan
            for level in result.levels
        ]
    )


def _all_bla(result: Result) -> Plot:
    """Return the BLA of all levels; a click on one selects its level."""
    traces = []
    for i, level in enumerate(result.levels):
        if level.bla is not None:
            f, y = level.bla.frequency_hz, decibel(level.bla.g)
            shade = f"--level{round(4 * i / (len(result.levels) - 1))}"
            traces.append(trace(f, y, level_name(level), shade, dash="solid", unit="dB", meta=i))
    f = result.levels[0].excited.frequency_hz
    return {"data": traces, "layout": frequency_layout(["BLA (dB re 1 rad/(N m))"], [1.0], f)}


def _all_v(result: Result) -> Plot:
    """Return V of every model against amplitude."""
    names = list(dict.fromkeys(c.name for level in result.levels for c in level.comparisons))
    traces = []
    for i, name in enumerate(names):
        color, dash = MODEL_LINES[i % len(MODEL_LINES)]
        found = [{c.name: c.v_mean for c in level.comparisons} for level in result.levels]
        v = np.array([values.get(name, np.nan) for values in found])
        style: Options = {"dash": dash, "symbol": "circle", "at": AMPLITUDE}
        traces.append(trace(_amplitudes(result), v, name, color, **style, unit="dB²"))
    return {"data": traces, "layout": _amplitude_layout(result, "V (dB²)")}


def _all_power(result: Result) -> Plot:
    """Return the mean power at each kind of line against amplitude."""
    sums = [summarize(level) for level in result.levels]
    kinds = (("linear_db", *KINDS[0][1:]), *((f"{k}_db", *rest) for k, *rest in KINDS[1:]))
    traces = []
    for field, name, color, symbol in (*kinds, ("noise_db", "noise", "--noise", "circle")):
        y = np.array([getattr(number, field) for number in sums])
        if np.isfinite(y).any():
            style: Options = {"dash": "solid", "symbol": symbol, "at": AMPLITUDE}
            traces.append(trace(_amplitudes(result), y, name, color, **style, unit="dB re 1 rad"))
    return {"data": traces, "layout": _amplitude_layout(result, "mean power (dB re 1 rad)")}


def _amplitude_layout(result: Result, title: str) -> dict[str, Any]:
    made = layout("amplitude of a line (rad, rms)", title)
    amplitude = _amplitudes(result)
    if amplitude.min() > 0 and amplitude.max() > 3 * amplitude.min():
        made["xaxis"] |= LOG | {"dtick": "D2"}
    return made
