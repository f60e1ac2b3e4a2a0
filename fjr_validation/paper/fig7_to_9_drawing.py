"""Drawings of Figs. 7, 8 and 9."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bla_analyzer.results.summary import decibel
from fjr_kit.plots import Options, layout
from fjr_kit.tasks import Arrays

from . import drawing
from .settings import Settings

G0, BLA, DISTORTION, NOISE = "#1f4fd8", "#000000", "#d62728", "#2ca02c"
PREDICTED, PREDICTION = "predicted BLA", "#8a8f98"


def state(result: Arrays) -> str:
    """Say whether the response is periodic."""
    if bool(result["periodic"]):
        return "The response is periodic."
    return (
        f"The response is not periodic ({float(result['mismatch']):.2g} of y differs from "
        f"period to "
        "period), so what is drawn as noise is not noise."
    )


def _fast_curves(result: Arrays) -> tuple[tuple[str, np.ndarray, str], ...]:
    return (
        ("G0", decibel(result["g_viscous"]), G0),
        ("FRF", decibel(result["g"]), BLA),
        (PREDICTED, decibel(result["predicted"]), PREDICTION),
        (
            "nonlinear distortion variance",
            drawing.decibel_power(result["var_nonlinear"]),
            DISTORTION,
        ),
        ("noise variance", drawing.decibel_power(result["var_noise"]), NOISE),
    )


def fast_plot(result: Arrays) -> dict[str, Any]:
    """Return Fig. 7 or 8 as an interactive plot."""
    frequency = result["frequency_hz"]
    data = [
        drawing.curve(
            frequency, values, name, color, unit=drawing.GAIN_DB, dash=_dash(name, "dot", "solid")
        )
        for name, values, color in _fast_curves(result)
    ]
    labels = ("frequency (Hz)", f"gain, variance ({drawing.GAIN_DB})")
    return {"data": data, "layout": layout(*labels)}


def _dash(name: str, predicted: str, measured: str) -> str:
    return predicted if name == PREDICTED else measured


def fast_figure(result: Arrays, range_db: tuple[float, float]) -> Figure:
    """Draw Fig. 7 or 8 on the paper's axes, lengthened downward where a curve leaves them."""
    figure, axis = drawing.single()
    curves = _fast_curves(result)
    for name, values, color in curves:
        style = _dash(name, ":", "-")
        axis.plot(result["frequency_hz"], values, style, color=color, label=name)
    lowest = min(float(np.nanmin(values)) for _, values, _ in curves if np.isfinite(values).any())
    bottom = min(range_db[0], 50.0 * np.floor(lowest / 50.0))
    axis.set(xlim=(0, 50), ylim=(bottom, range_db[1]), xlabel="frequency (Hz)")
    axis.set_ylabel(f"gain, variance ({drawing.GAIN_DB})")
    axis.legend(loc="center right", bbox_to_anchor=(1.0, 0.33), ncols=2)
    return figure


FIG9 = (("friction", "#000000"), ("transmission", "#2ca02c"), ("both", "#d62728"))


def fig9_plot(results: Mapping[str, Arrays]) -> dict[str, Any]:
    """Return Fig. 9 as an interactive plot, with predictions, distortion and noise."""
    reference = results["fig9_both"]
    f = reference["frequency_hz"]
    data = [drawing.curve(f, decibel(reference["g_viscous"]), "G0", G0, unit=drawing.GAIN_DB)]
    for name, color in FIG9:
        result = results[f"fig9_{name}_noise"]
        gain = decibel(result["g"])
        bla = drawing.curve(
            f, gain, f"BLA, {name}", color, unit=drawing.GAIN_DB, band=_band(result)
        )
        bla["error_y"] |= {"thickness": 0.5, "width": 0}
        data.append(bla)
        predicted, shown = decibel(result["predicted"]), name != "transmission"
        style: Options = {"dash": "dot", "visible": shown or "legendonly"}
        data.append(drawing.curve(f, predicted, f"predicted, {name}", color, **style))
        for key, words in (
            ("var_nonlinear", "distortion variance"),
            ("var_noise", "noise variance"),
        ):
            values = drawing.decibel_power(result[key])
            style = {"dash": "dash", "unit": drawing.GAIN_DB, "visible": "legendonly"}
            data.append(drawing.curve(f, values, f"{words}, {name}", color, **style))
    labels = ("frequency (Hz)", f"gain ({drawing.GAIN_DB})")
    return {"data": data, "layout": layout(*labels)}


def _band(result: Arrays) -> tuple[np.ndarray, np.ndarray]:
    """Return the 95 % interval of |G| in dB, from the confidence disc."""
    gain = np.abs(result["g"])
    lowest = np.maximum(gain - result["radius"], 1e-3 * gain)
    return decibel(lowest), decibel(gain + result["radius"])


FIG9_TITLE = "Fig. 9: robust method"


def fig9_caption(settings: Settings, amplitude_rad: float) -> str:
    """Return the caption of Fig. 9 after its title."""
    s = settings
    return (
        f", friction only (1 mrad, M {s.friction_realizations}), "
        f"transmission only (90 mrad, M {s.transmission_realizations}), both "
        f"({1e3 * amplitude_rad:.2g} mrad, M {s.both_realizations}), P {s.robust_periods}, "
        f"noise of "
        "20 dB SNR. Bars: 95 %. Dotted: predicted by statistical linearisation. Distortion and "
        "noise variances appear at a click in the legend."
    )


def fig9_figure(results: Mapping[str, Arrays]) -> Figure:
    """Draw Fig. 9."""
    figure, axis = drawing.single()
    reference = results["fig9_both"]
    f = reference["frequency_hz"]
    axis.plot(f, decibel(reference["g_viscous"]), color=G0, label="G0")
    labels = {"friction": "friction nonlinearity", "transmission": "transmission nonlinearity"}
    for name, color in FIG9:
        label = f"BLA {labels.get(name, 'both nonlinearities')}"
        result = results[f"fig9_{name}_noise"]
        axis.plot(f, decibel(result["g"]), color=color, label=label, lw=0.9)
        axis.plot(f, decibel(result["predicted"]), ":", color=color, lw=0.8)
        axis.fill_between(f, *_band(result), color=color, alpha=0.2, lw=0)
    axis.plot([], [], "k:", lw=0.8, label="predicted")
    axis.set(xlim=(0, 50), ylim=(-90, 0), xlabel="frequency (Hz)")
    axis.set_ylabel(f"gain ({drawing.GAIN_DB})")
    axis.legend(loc="upper right")
    return figure
