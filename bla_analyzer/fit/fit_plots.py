"""Interactive plots of a fit: plotly figures as plain dicts."""

from __future__ import annotations

import numpy as np

from fjr_kit.plots import PLAIN, Options, Plot, Trace, layout, linked, trace

from ..results.summary import decibel, phase_deg
from .fit_types import LevelFit, OutputFit, Root
from .fit_words import OUTPUT_WORDS

COLOURS = (("--excited", "--odd"), ("--even", "--nonlinear"))
"""BLA and residual of the motor, and of the link."""
AROUND = np.linspace(0.0, 2.0 * np.pi, 49)


def fit_plots(fit: LevelFit) -> dict[str, Plot]:
    """Return the plots of a level by the identifier of their place in the page."""
    return {"fit": _bode(fit), "plane": _plane(fit), "white": _white(fit)}


def _bode(fit: LevelFit) -> Plot:
    """Return BLA, model, residual and disc of every output."""
    traces: list[Trace] = []
    for one, (colour, residual) in zip(fit.outputs, COLOURS, strict=False):
        traces += _of_output(one, colour, residual)
    titles = ["magnitude (dB re 1 rad/(N m))", "phase (degrees)"]
    return linked(traces, titles, [2.2, 1.0], fit.outputs[0].frequency_hz)


def _of_output(one: OutputFit, colour: str, residual: str) -> list[Trace]:
    f, size, what = one.frequency_hz, np.abs(one.g), OUTPUT_WORDS[one.output]
    with np.errstate(divide="ignore", invalid="ignore"):
        low = decibel(np.maximum(size - one.radius_95, 0.1 * size))
    band = (low, decibel(size + one.radius_95))
    at, curve = one.curve.frequency_hz, phase_deg(one.curve.g)
    turned = np.interp(f, at, curve)
    lower: Options = {"row": 2, "showlegend": False, "unit": "degrees"}
    return [
        trace(f, decibel(one.radius_95), f"95 % disc, {what}", "--radius", dash="solid", unit="dB"),
        trace(
            f,
            decibel(one.g - one.model),
            f"residual, {what}",
            residual,
            symbol="diamond",
            unit="dB",
        ),
        trace(at, decibel(one.curve.g), f"model, {what}", "--ink", dash="solid", unit="dB"),
        trace(f, decibel(one.g), f"BLA, {what}", colour, symbol="circle", unit="dB", band=band),
        trace(at, curve, f"model, {what}", "--ink", dash="solid", **lower),
        trace(
            f,
            turned + np.angle(one.g / np.exp(1j * np.radians(turned)), deg=True),
            f"BLA, {what}",
            colour,
            symbol="circle",
            **lower,
        ),
    ]


def _plane(fit: LevelFit) -> Plot:
    """Return poles and zeros with their ellipses."""
    unit = fit.poles[0].unit if fit.poles else "rad/s"
    kinds = [("poles", fit.poles, "--excited", "x")]
    for one, (_, colour) in zip(fit.outputs, COLOURS, strict=False):
        kinds.append((f"zeros, {OUTPUT_WORDS[one.output]}", one.zeros, colour, "circle-open"))
    traces: list[Trace] = []
    for name, roots, colour, symbol in kinds:
        if roots:
            traces += [_ellipses(roots, f"95 % ellipses, {name}", colour)]
            re, im = [root.re for root in roots], [root.im for root in roots]
            mark: Options = {"symbol": symbol, "size": 8, "at": PLAIN, "unit": unit}
            traces.append(trace(re, im, name, colour, **mark))
    made = layout(f"real part ({unit})", f"imaginary part ({unit})")
    return {"data": traces, "layout": made}


def _ellipses(roots: tuple[Root, ...], name: str, colour: str) -> Trace:
    outlines = []
    for root in roots:
        turn = np.exp(1j * np.radians(root.ellipse_angle_deg))
        around = root.ellipse_major * np.cos(AROUND) + 1j * root.ellipse_minor * np.sin(AROUND)
        outlines.append(np.append(root.re + 1j * root.im + turn * around, np.nan))
    outline = np.concatenate(outlines)
    return trace(outline.real, outline.imag, name, colour, dash="solid", width=1.0, at=PLAIN)


def _white(fit: LevelFit) -> Plot:
    """Return the autocorrelation of the normalised residual."""
    white = fit.whiteness
    lags = np.arange(1, white.correlation.size + 1)
    bound = np.full(lags.size, white.bound)
    traces = [
        trace(lags, bound, "95 % bound", "--noise", dash="dash", at=PLAIN),
        trace(
            lags, np.abs(white.correlation), "autocorrelation", "--excited", symbol="circle",
            at=PLAIN,
        ),
    ]  # fmt: skip
    return {"data": traces, "layout": layout("lag (lines)", "magnitude")}
