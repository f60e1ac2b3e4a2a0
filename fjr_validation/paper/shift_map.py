"""The map that the paper's introduction promises: resonances against the level of excitation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bla_analyzer.results.summary import decibel
from fjr_kit.plots import BARRED, LOG, Options, layout
from fjr_kit.tasks import Arrays

from . import drawing
from .fig4 import sweep
from .part import Part, PlotPlace, Statement, Table
from .resonance import fit_level
from .settings import COLORS, NAMES, Settings
from .two_inertia import Resonances

MAPPED = ("both", "transmission", "friction")
LINEAR_HZ = (11.254, 17.794)
KINDS = ("antiresonance", "resonance")


def part(results: Mapping[str, Arrays], settings: Settings, _amplitude_rad: float) -> Part:
    """Return the maps of all three cases."""
    found = {case: _fits(results, settings, case) for case in MAPPED}
    text = (
        "Antiresonance and resonance are the natural frequencies of the two-inertia model that "
        "fits "
        "each BLA best (both inertias, both dampings, stiffness), with 95 % intervals from the "
        "total "
        "variance of the BLA; they are known even where damping masks the dip and the peak of |G|. "
        "Lines: predicted by statistical linearisation, k0 + 3 k1 s\N{SUPERSCRIPT TWO}. Hollow: "
        "not every realization is periodic, so that the fit is one to a mean of responses, no BLA.",
    )
    plots = [_plot(found, settings, kind) for kind in KINDS]
    plots += [_heat(results, settings, case) for case in MAPPED]
    numbers = {
        case: {
            "amplitude_rad": settings.amplitudes.tolist(),
            "antiresonance_hz": [fit.antiresonance_hz for fit in fits],
            "antiresonance_half_hz": [fit.antiresonance_half_hz for fit in fits],
            "resonance_hz": [fit.resonance_hz for fit in fits],
            "resonance_half_hz": [fit.resonance_half_hz for fit in fits],
            "masked": [not np.isfinite(fit.peak_hz) for fit in fits],
            "periodic": periodic.tolist(),
        }
        for case, (fits, _, periodic) in found.items()
    }
    return Part(
        "Shift of resonances with amplitude",
        text,
        (_statement(found, settings),),
        tuple(plots),
        (_table(found, settings),),
        {"shift_map": _figure(found, settings)},
        numbers,
    )


Fits = tuple[list[Resonances], np.ndarray, np.ndarray]
"""The fits of a case, (L, 2) predicted frequencies in Hz, and bool (L,), whether periodic."""


def _fits(results: Mapping[str, Arrays], settings: Settings, case: str) -> Fits:
    one = sweep(results, settings, case)
    fits = [fit_level(level) for level in one.levels]
    predicted = [fit_level({**level, "g": level["predicted"]}) for level in one.levels]
    frequencies = np.array([[fit.antiresonance_hz, fit.resonance_hz] for fit in predicted])
    return fits, frequencies, one.periodic == 1.0


def _values(fits: list[Resonances], kind: str) -> tuple[np.ndarray, np.ndarray]:
    value = np.array([getattr(fit, f"{kind}_hz") for fit in fits])
    return value, np.array([getattr(fit, f"{kind}_half_hz") for fit in fits])


def _plot(found: Mapping[str, Fits], settings: Settings, kind: str) -> PlotPlace:
    data = []
    for case, (fits, predicted, periodic) in found.items():
        value, half = _values(fits, kind)
        color = COLORS[case]
        for chosen, symbol in ((periodic, "circle"), (~periodic, "circle-open")):
            y, reach = value[chosen], half[chosen]
            style: Options = {"symbol": symbol, "unit": "Hz", "legendgroup": case}
            style |= {"band": (y - reach, y + reach), "showlegend": symbol == "circle"}
            data.append(drawing.curve(settings.amplitudes[chosen], y, NAMES[case], color, **style))
        line = predicted[:, KINDS.index(kind)]
        data += [
            drawing.curve(settings.amplitudes, line, "predicted", color, showlegend=False,
                          legendgroup=case, unit="Hz"),
        ]  # fmt: skip
    caption = f" against amplitude; linear plant {_linear(kind):.2f} Hz."
    labels = ("amplitude of a line (rad)", f"{kind} (Hz)")
    plot = {"data": data, "layout": layout(*labels, log_x=True)}
    return PlotPlace(f"map-{kind}", kind.capitalize(), caption, plot, 380)


def _linear(kind: str) -> float:
    return LINEAR_HZ[KINDS.index(kind)]


def _heat(results: Mapping[str, Arrays], settings: Settings, case: str) -> PlotPlace:
    """Return |G_BLA| over amplitude and frequency."""
    levels = sweep(results, settings, case).levels
    frequency = levels[0]["frequency_hz"]
    chosen = (frequency >= 5.0) & (frequency <= 35.0)
    gain = np.array([decibel(level["g"])[chosen] for level in levels])
    surface: dict[str, Any] = {
        "type": "heatmap",
        "x": np.round(frequency[chosen], 2).tolist(),
        "y": settings.amplitudes.tolist(),
        "z": np.round(gain, 2).tolist(),
        "colorscale": "Viridis",
        "colorbar": {"title": {"text": drawing.GAIN_DB, "side": "right"}, "thickness": 12},
        "hovertemplate": "%{x:.1f} Hz, %{y:.4g} rad<br>%{z:.1f} dB<extra></extra>",
    }
    made = layout("frequency (Hz)", "amplitude of a line (rad)") | BARRED
    made["yaxis"] |= LOG
    title, caption = "|G| of the BLA as a map", f", {NAMES[case]}."
    return PlotPlace(f"map-{case}", title, caption, {"data": [surface], "layout": made}, 340)


def _statement(found: Mapping[str, Fits], settings: Settings) -> Statement:
    words = []
    for case in MAPPED:
        fits, _, periodic = found[case]
        highest = int(np.flatnonzero(periodic)[-1])
        last = fits[highest]
        words.append(
            f"{case}, to {1e3 * settings.amplitudes[highest]:.0f} mrad: "
            f"{fits[0].antiresonance_hz:.2f} to {last.antiresonance_hz:.2f} and "
            f"{fits[0].resonance_hz:.2f} to {last.resonance_hz:.2f} Hz"
        )
    fits, _, periodic = found["transmission"]
    rising = np.diff(_values(fits, "resonance")[0][periodic])
    return Statement(
        "introduction",
        "resonance and antiresonance frequencies are mapped to excitation levels (announced, not "
        "shown), and shift to the right with a stiffening transmission",
        f"from {1e3 * settings.amplitudes[0]:.0f} mrad to the highest amplitude with a periodic "
        "response: " + "; ".join(words),
        "repeats" if bool((rising > 0).all()) else "differs",
        "fjr paper",
    )


def _table(found: Mapping[str, Fits], settings: Settings) -> Table:
    rows = []
    for index, amplitude in enumerate(settings.amplitudes):
        cells = [f"{1e3 * amplitude:.2f}"]
        for case in MAPPED:
            fit = found[case][0][index]
            for kind in KINDS:
                value, half = getattr(fit, f"{kind}_hz"), getattr(fit, f"{kind}_half_hz")
                cells.append(f"{value:.2f} \N{PLUS-MINUS SIGN} {half:.2f}")
            seen = "-" if np.isfinite(fit.peak_hz) else "masked"
            cells.append(seen if found[case][2][index] else "not periodic")
        rows.append(tuple(cells))
    heads = ["mrad"]
    for case in MAPPED:
        heads += [f"{case}: antiresonance (Hz)", "resonance (Hz)", "peak of |G|"]
    return Table("Natural frequencies with 95 % intervals.", tuple(heads), tuple(rows))


def _figure(found: Mapping[str, Fits], settings: Settings) -> Figure:
    figure = Figure(figsize=(drawing.WIDTH_IN, 4.4))
    axes = figure.subplots(2, 1, sharex=True)
    for axis, kind in zip(axes, reversed(KINDS), strict=True):
        for case, (fits, predicted, periodic) in found.items():
            value, half = _values(fits, kind)
            color = COLORS[case]
            for chosen, fill in ((periodic, color), (~periodic, "white")):
                axis.errorbar(
                    settings.amplitudes[chosen], value[chosen], half[chosen], fmt="o", ms=3,
                    lw=0.8, color=color, mfc=fill, label=NAMES[case] if fill == color else None,
                )  # fmt: skip
            axis.plot(
                settings.amplitudes, predicted[:, KINDS.index(kind)], "-", lw=0.7, color=color
            )
        axis.axhline(_linear(kind), color="#7a7f87", ls=":", lw=0.8)
        axis.set_ylabel(f"{kind} (Hz)")
    drawing.amplitude_axis(axes[1], settings.amplitudes[0] / 1.1, settings.amplitudes[-1] * 1.1)
    axes[0].legend(loc="upper left")
    figure.tight_layout()
    return figure
