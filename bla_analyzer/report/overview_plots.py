"""Interactive plots over all levels: their BLAs, coherences and sensitivities, V and distortion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fjr_kit.plots import LOG, Options, Plot, Trace, area, layout, linked, trace

from ..results.result import BlaEstimate, LevelResult, Result
from ..results.summary import (
    amplitudes_rad,
    bla_phase_deg,
    decibel,
    level_name,
    magnitude_band_db,
    phase_reach_deg,
    summarize,
    v_by_model,
)
from .report_plots import KINDS, MODEL_LINES

AMPLITUDE = "%{x:.4g} rad"


def overview_plots(result: Result) -> dict[str, Plot]:
    """Return the plots over all levels that can be had; none if there is only one level."""
    if len(result.levels) < 2:
        return {}
    f = np.concatenate([level.excited.frequency_hz for level in result.levels])
    plots = {
        "all-bla": _all_bla(result, f),
        "all-coherence": _all_coherence(result, f),
        "all-sensitivity": _all_sensitivity(result, f),
    }
    if np.isfinite(amplitudes_rad(result)).any():
        plots |= {"all-v": _all_v(result), "all-power": _all_power(result)}
    return {name: plot for name, plot in plots.items() if plot["data"]}


def _known(result: Result) -> Iterator[tuple[LevelResult, BlaEstimate, str, Options]]:
    """Yield each level that has a BLA, with its colour and options of its curves."""
    for i, level in enumerate(result.levels):
        if level.bla is not None:
            shade = f"--level{round(4 * i / (len(result.levels) - 1))}"
            yield level, level.bla, shade, {"dash": "solid", "meta": i}


def _band_of(level: LevelResult) -> Options:
    """Return the options of a band that belongs to the curve of its level."""
    return {"showlegend": False, "legendgroup": level_name(level)}


def _all_bla(result: Result, f: np.ndarray) -> Plot:
    """Return the BLA of all levels, with bands; a click on one selects its level."""
    traces: list[Trace] = []
    for level, bla, shade, style in _known(result):
        name, phase = level_name(level), bla_phase_deg(level, bla)
        reach = phase_reach_deg(bla.g, bla.radius_95)
        at, band = bla.frequency_hz, _band_of(level)
        traces += [
            area(at, *magnitude_band_db(bla.g, bla.radius_95), name, shade, **band),
            area(at, phase - reach, phase + reach, name, shade, row=2, **band),
            trace(at, decibel(bla.g), name, shade, unit="dB", **style),
            trace(at, phase, name, shade, row=2, unit="degrees", showlegend=False, **style),
        ]
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)"]
    return linked(traces, titles, [2.2, 1.0], f, on_top="first")


def _all_coherence(result: Result, f: np.ndarray) -> Plot:
    traces = [
        trace(bla.frequency_hz, bla.coherence, level_name(level), shade, **style)
        for level, bla, shade, style in _known(result)
        if np.isfinite(bla.coherence).any()
    ]
    return linked(traces, ["coherence"], [1.0], f, on_top="first")


def _all_sensitivity(result: Result, f: np.ndarray) -> Plot:
    traces: list[Trace] = []
    for level, bla, shade, style in _known(result):
        if bla.sensitivity is not None:
            s, radius, name = bla.sensitivity.s, bla.sensitivity.s_radius_95, level_name(level)
            low, high = magnitude_band_db(s, radius)
            traces.append(area(bla.frequency_hz, low, high, name, shade, **_band_of(level)))
            traces.append(trace(bla.frequency_hz, decibel(s), name, shade, unit="dB", **style))
    return linked(traces, ["sensitivity |S| (dB)"], [1.0], f, on_top="first")


def _all_v(result: Result) -> Plot:
    """Return V of every model against amplitude."""
    traces = []
    for i, (name, v) in enumerate(v_by_model(result).items()):
        color, dash = MODEL_LINES[i % len(MODEL_LINES)]
        style: Options = {"dash": dash, "symbol": "circle", "at": AMPLITUDE}
        traces.append(trace(amplitudes_rad(result), v, name, color, **style, unit="dB²"))
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
            traces.append(
                trace(amplitudes_rad(result), y, name, color, **style, unit="dB re 1 rad")
            )
    return {"data": traces, "layout": _amplitude_layout(result, "mean power (dB re 1 rad)")}


def _amplitude_layout(result: Result, title: str) -> dict[str, Any]:
    made = layout("amplitude of a line (rad, rms)", title)
    amplitude = amplitudes_rad(result)
    if amplitude.min() > 0 and amplitude.max() > 3 * amplitude.min():
        made["xaxis"] |= LOG | {"dtick": "D2"}
    return made
