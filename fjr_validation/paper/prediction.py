"""Ground truth by theory: every measured BLA beside the one of statistical linearisation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bla_analyzer.compare.metrics import LOW_LINES_HZ, squared_error_db
from fjr_kit.figure_style import log_values
from fjr_kit.number_text import SIGMA
from fjr_kit.plots import layout
from fjr_kit.tasks import Arrays

from . import drawing
from .fig4 import sweep
from .part import Part, PlotPlace, Statement, Table, met
from .settings import CASES, COLORS, NAMES, Settings

TARGET_DB2 = 0.05
HOLDS_DB2 = 0.5
"""The prediction counts as holding while it is nearer than this to the BLA (mean from 1 Hz on)."""


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return what remains between prediction and measurement."""
    found = {case: _remains(results, settings, case) for case in CASES}
    value, _, own = difference(results["fig9_both"])
    text = (
        "The prediction is made from the rig's parameters without simulation: each friction "
        f"becomes the damping fs \N{SQUARE ROOT}(2/\N{GREEK SMALL LETTER PI}) / {SIGMA}(v), the "
        f"cubic spring the stiffness 3 k1 {SIGMA}(d)\N{SUPERSCRIPT TWO}, where {SIGMA} are the "
        "standard deviations of velocity v and deflection d in the linear closed loop with these "
        "values. "
        "Difference: mean over lines from 1 Hz on of the squared dB distance; in sigma: median "
        "of |G \N{MINUS SIGN} prediction|\N{SUPERSCRIPT TWO} over the variance of the BLA, "
        "which is "
        "0.7 if the prediction is exact.",
        _where(found, settings),
    )
    statement = Statement(
        "theory",
        "target: prediction within 0.05 dB² of the BLA at the optimum amplitude from 1 Hz on",
        f"{value:.3f} dB² ({np.sqrt(value):.2f} dB rms) at {1e3 * amplitude_rad:.2g} mrad with M "
        f"{settings.both_realizations}, of "
        f"which {own:.3f} dB² is the variance of the BLA itself",
        met(bool(value <= TARGET_DB2)),
        "fjr paper",
    )
    return Part(
        "Ground truth by statistical linearisation",
        text,
        (statement,),
        (_plot(found, settings, 0), _plot(found, settings, 1)),
        (_table(found, settings),),
        {"prediction": _figure(found, settings)},
        {case: values[:, 0].tolist() for case, values in found.items()},
    )


def _remains(results: Mapping[str, Arrays], settings: Settings, case: str) -> np.ndarray:
    """Return (L, 3) of `_difference`; NaN where the response is not periodic."""
    one = sweep(results, settings, case)
    rows = [
        difference(level) if periodic == 1.0 else (np.nan,) * 3
        for level, periodic in zip(one.levels, one.periodic, strict=True)
    ]
    return np.array(rows)


def difference(level: Arrays) -> tuple[float, float, float]:
    """Return the difference (dB^2), in sigma, and the part that the BLA's variance explains."""
    above = level["frequency_hz"] >= LOW_LINES_HZ * (1.0 - 1e-9)
    g, predicted = level["g"][above], level["predicted"][above]
    variance = level["var_total"][above]
    with np.errstate(divide="ignore", invalid="ignore"):
        sigma = float(np.median(np.abs(g - predicted) ** 2 / variance))
    own = float(np.mean((20.0 / np.log(10.0)) ** 2 * 0.5 * variance / np.abs(g) ** 2))
    return float(np.mean(squared_error_db(g, predicted))), sigma, own


def _where(found: Mapping[str, np.ndarray], settings: Settings) -> str:
    words = []
    for case, values in found.items():
        holds = values[:, 0] < HOLDS_DB2
        if holds.any():
            low, high = settings.amplitudes[np.flatnonzero(holds)[[0, -1]]]
            words.append(f"{NAMES[case]} from {1e3 * low:.3g} to {1e3 * high:.3g} mrad")
    return (
        f"It stays within {HOLDS_DB2:g} dB\N{SUPERSCRIPT TWO} for {'; '.join(words)}. Below, the "
        "sides stick for long and velocity is not Gaussian; above, the deflection is not: the "
        "stiffening spring resonates at a frequency that depends on the amplitude of the moment, "
        "and the loop comes near to jumps and chaos."
    )


def _plot(found: Mapping[str, np.ndarray], settings: Settings, column: int) -> PlotPlace:
    name, unit = (("difference", "dB²"), ("difference in sigma", ""))[column]
    style = {"dash": "solid", "symbol": "circle", "unit": unit}
    data = [
        drawing.curve(settings.amplitudes, values[:, column], NAMES[case], COLORS[case], **style)
        for case, values in found.items()
    ]
    labels = ("amplitude of a line (rad)", f"{name} ({unit})" if unit else name)
    made = layout(*labels, log_x=True)
    made["yaxis"] |= {"type": "log", "tickformat": "~g"}
    captions = (
        ("Difference between measured and predicted BLA", ", from 1 Hz on."),
        ("The same over the variance of the BLA", ": 0.7 where nothing but chance remains."),
    )
    plot = {"data": data, "layout": made}
    return PlotPlace(f"prediction-{column}", *captions[column], plot, 360)


def _table(found: Mapping[str, np.ndarray], settings: Settings) -> Table:
    rows = [
        (
            f"{1e3 * amplitude:.2f}",
            *(
                f"{values[i, 0]:.3g} ({np.sqrt(values[i, 0]):.2g} dB) / {values[i, 1]:.2g}"
                if np.isfinite(values[i, 0])
                else "-"
                for values in found.values()
            ),
        )
        for i, amplitude in enumerate(settings.amplitudes)
    ]
    return Table(
        "Difference in dB² (rms in dB) / in sigma; a dash: not periodic.",
        ("mrad", *(NAMES[case] for case in found)),
        tuple(rows),
    )


def _figure(found: Mapping[str, np.ndarray], settings: Settings) -> Figure:
    figure, axis = drawing.single()
    for case, values in found.items():
        axis.plot(settings.amplitudes, values[:, 0], "o-", color=COLORS[case], label=NAMES[case])
    axis.axhline(TARGET_DB2, color="#7a7f87", ls=":", lw=0.8)
    drawing.amplitude_axis(axis)
    log_values(axis)
    axis.set_ylabel("measured to predicted BLA (dB²)", labelpad=0)
    axis.legend(loc="lower center")
    return figure
