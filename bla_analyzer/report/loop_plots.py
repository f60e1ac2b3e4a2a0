"""Interactive plots of coherence, Nyquist and sensitivity of a level."""

from __future__ import annotations

import numpy as np

from fjr_kit.plots import Options, Plot, Trace, area, filled, linked, numbers, plane, trace

from ..results.loop import loop_discs, peak
from ..results.result import BlaEstimate, OutputBla, Sensitivity
from ..results.summary import decibel, magnitude_band_db

CORNERS = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 25))
MOST_DISCS = 150
"""Discs that a plot of the complex plane shows; of more lines every n-th has one."""
CIRCLE = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 97))
WINDOW = (-3.5, 1.5, -2.5, 2.5)
"""What is seen of the loop at first: the neighbourhood of -1."""
_EDGE = 0.05  # of what is seen of G
OTHER = "|T| = |1 \N{MINUS SIGN} S|"
POINT = "%{customdata:.4g} Hz<br>%{x:.4g}, %{y:.4g} i"


def loop_plots(bla: BlaEstimate) -> dict[str, Plot]:
    """Return the plots that the BLA of a level allows, by the identifier of their place."""
    plots = {"nyquist": _nyquist(bla)}
    if np.isfinite(bla.coherence).any():
        plots["coherence"] = _coherence(bla)
    if bla.sensitivity is not None:
        plots["sensitivity"] = _sensitivity(bla, bla.sensitivity)
        plots["loop"] = _loop(bla, bla.sensitivity)
    return plots


def _outputs(bla: BlaEstimate) -> list[tuple[OutputBla, str, str]]:
    made: list[tuple[OutputBla, str, str]] = [(bla, "motor position", "--excited")]
    return made if bla.link is None else [(bla.link, "link position", "--even"), *made]


def _coherence(bla: BlaEstimate) -> Plot:
    traces = [
        trace(bla.frequency_hz, one.coherence, name, color, dash="solid", symbol="circle", size=4)
        for one, name, color in _outputs(bla)
    ]
    return linked(traces, ["coherence"], [1.0], bla.frequency_hz)


def _sensitivity(bla: BlaEstimate, found: Sensitivity) -> Plot:
    """Return |S| with its band and its peak, beside |T| = |1 - S|."""
    f, note = bla.frequency_hz, "dB"
    low, high = magnitude_band_db(found.s, found.s_radius_95)
    traces = [
        trace(f, decibel(1.0 - found.s), OTHER, "--model", dash="dash", unit=note),
        area(f, low, high, "95 % band of |S|", "--excited"),
        trace(f, decibel(found.s), "|S|", "--excited", dash="solid", symbol="circle", unit=note),
    ]
    top = peak(bla)
    if top is not None:
        mark: Options = {"symbol": "diamond", "size": 11, "unit": "dB"}
        y = decibel(np.array([top.ms]))
        traces.append(trace([top.frequency_hz], y, f"Ms = {top.ms:.3g}", "--odd", **mark))
    return linked(traces, ["magnitude (dB)"], [1.0], f)


def _nyquist(bla: BlaEstimate) -> Plot:
    """Return G of each output in the complex plane, with discs of the reliable lines."""
    traces: list[Trace] = []
    for one, name, color in _outputs(bla):
        radius = np.where(bla.reliable, one.radius_95, np.nan)
        discs = one.g[:, None] + radius[:, None] * CORNERS
        traces.append(_discs(bla.frequency_hz, discs, f"95 % discs, {name}", color))
        traces.append(_curve(bla.frequency_hz, one.g, f"G, {name}", color, "rad/(N m)"))
    return plane(traces, "real part (rad/(N m))", "imaginary part (rad/(N m))", _around(bla))


def _around(bla: BlaEstimate) -> tuple[float, float, float, float] | None:
    """Return what holds G and the discs of the reliable lines."""
    parts = [(one.g[bla.reliable], one.radius_95[bla.reliable]) for one, *_ in _outputs(bla)]
    g, radius = (np.concatenate(part) for part in zip(*parts, strict=True))
    if not g.size:
        return None
    reach = np.nan_to_num(radius)
    spans = [(float((at - reach).min()), float((at + reach).max())) for at in (g.real, g.imag)]
    (left, right), (low, high) = spans
    edge = _EDGE * max(right - left, high - low)
    return left - edge, right + edge, low - edge, high + edge


def _loop(bla: BlaEstimate, found: Sensitivity) -> Plot:
    """Return the loop L = G C = 1/S - 1 beside -1 and the circle that Ms keeps it out of."""
    f, top = bla.frequency_hz, peak(bla)
    curve, outlines = loop_discs(found, CORNERS)
    traces = [_discs(f, outlines, "95 % discs", "--excited")]
    if top is not None:
        around = CIRCLE / top.ms - 1.0
        name = f"distance 1/Ms = {1.0 / top.ms:.3g}"
        line: Options = {"dash": "dot", "at": "%{x:.3g}", "width": 1.2}
        traces.append(trace(around.real, around.imag, name, "--odd", **line))
    mark: Options = {"symbol": "x", "size": 9, "at": "%{x:.3g}"}
    traces.append(trace([-1.0], [0.0], "\N{MINUS SIGN}1", "--odd", **mark))
    traces.append(_curve(f, curve, "L = G C", "--excited", ""))
    return plane(traces, "real part", "imaginary part", WINDOW)


def _curve(f: np.ndarray, g: np.ndarray, name: str, color: str, unit: str) -> Trace:
    style: Options = {"dash": "solid", "symbol": "circle", "size": 4, "width": 1.0}
    made = trace(g.real, g.imag, name, color, **style, customdata=numbers(f))
    return made | {"hovertemplate": f"{POINT} {unit}<extra>%{{fullData.name}}</extra>"}


def _discs(f: np.ndarray, corners: np.ndarray, name: str, color: str) -> Trace:
    """Return the outlines, complex (F, corners), that are finite, as areas."""
    step = -(-f.size // MOST_DISCS)
    kept = [i for i in range(0, f.size, step) if np.isfinite(corners[i]).all()]
    outlines = [(corners[i].real, corners[i].imag) for i in kept]
    at = [[f[i]] * corners.shape[1] + [np.nan] for i in kept]
    return filled(outlines, name, color, customdata=numbers(np.concatenate(at or [[np.nan]])))
