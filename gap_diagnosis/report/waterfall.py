"""The waterfall of a gap: from the nominal through refit and causes to remainder and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from matplotlib.figure import Figure

from fjr_kit.figure_style import EVEN, EXCITED, NOISE, ODD, WIDTH_IN
from fjr_kit.plots import BARRED, Plot, layout, numbers

from ..outcome.cause_words import LEAST_PERCENT, known, percent
from ..outcome.diagnosis import Diagnosis
from ..outcome.verdict_words import explanation

Kind = Literal["whole", "less", "more", "left", "noise"]
WIDE = 30.0
"""Ratio of the greatest gap to the least above which the axis is logarithmic."""
_COLORS = {"whole": "--muted", "less": "--excited", "more": "--odd", "left": "--model",
           "noise": "--noise"}  # fmt: skip
_INKS = {"whole": "#A8ADB5", "less": EXCITED, "more": ODD, "left": EVEN, "noise": NOISE}
_NAMES = {"whole": "nominal", "less": "closed", "more": "opened", "left": "remainder",
          "noise": "noise"}  # fmt: skip
_AXIS = {
    "motion": "rms error of the position, % of its rms",
    "torque": "rms error of the torque, % of its rms",
}
_ROOM = {"t": 36, "r": 76}  # px; a label may begin where the longest bar ends
_LOWEST = 0.5  # of the least gap: where bars begin on a logarithmic axis


@dataclass(frozen=True)
class Bar:
    """One bar of a waterfall.

    Attributes:
        name: what stands beside it.
        kind: what it shows.
        start, end: rms error of what was compared, % of its rms; what floats does not start at 0.
    """

    name: str
    kind: Kind
    start: float
    end: float

    @property
    def label(self) -> str:
        """What is written at its end."""
        arrow = "to " if self.kind in ("less", "more") else ""
        return arrow + percent(0.01 * self.end)


def bars(diagnosis: Diagnosis) -> list[Bar]:
    """Return the bars, top first; empty where nothing was simulated.

    A nominal whose simulation diverges has no bar, and the refit is the first whole one.
    """
    found: list[Bar] = []
    before: float | None = None
    for step in diagnosis.steps:
        missed = diagnosis.missed(step)
        if missed is None or not known(missed):
            continue
        after = 100.0 * missed
        name = {"nominal": "nominal", "refit": "refit"}.get(step.stage, "")
        name = name or f"+ {explanation([step.added or ''])}"
        if before is None:
            found.append(Bar(name, "whole", 0.0, after))
        else:
            found.append(Bar(name, "less" if after <= before else "more", before, after))
        before = after
    if before is None:
        return []
    found.append(Bar("remainder", "left", 0.0, before))
    noise = diagnosis.missed(diagnosis.gap.noise_floor)
    if known(noise):
        found.append(Bar("noise", "noise", 0.0, 100.0 * (noise or 0.0)))
    return found


def _lowest(shown: list[Bar]) -> float:
    """Return where whole bars begin: 0, or the low end of a logarithmic axis.

    What is smaller than `LEAST_PERCENT` has no bar, only its label.
    """
    ends = [max(bar.end, LEAST_PERCENT) for bar in shown if bar.end > 0.0]
    return _LOWEST * min(ends) if ends and max(ends) > WIDE * min(ends) else 0.0


def waterfall_plot(diagnosis: Diagnosis) -> Plot | None:
    """Return the waterfall as an interactive plot; None where nothing was simulated."""
    shown = bars(diagnosis)
    if not shown:
        return None
    lowest = _lowest(shown)
    traces = []
    for kind, color in _COLORS.items():
        chosen = [(place, bar) for place, bar in enumerate(shown) if bar.kind == kind]
        if not chosen:
            continue
        start = [max(min(bar.start, bar.end), lowest) for _, bar in chosen]
        end = [max(bar.start, bar.end, lowest) for _, bar in chosen]
        traces.append({
            "type": "bar", "orientation": "h", "name": _NAMES[kind],
            "y": [float(place) for place, _ in chosen],
            "base": numbers(start),
            "x": numbers([high - low for low, high in zip(start, end, strict=True)]),
            "text": [bar.label for _, bar in chosen],
            "textposition": "outside", "cliponaxis": False, "width": 0.62, "showlegend": False,
            "marker": {"color": color},
            "hovertemplate": "%{text}<extra>%{fullData.name}</extra>",
        })  # fmt: skip
    axes = layout(_AXIS[diagnosis.compared], "", log_x=lowest > 0.0)
    greatest = max(LEAST_PERCENT, *(max(bar.start, bar.end) for bar in shown))
    if lowest:
        axes["xaxis"]["range"] = [math.log10(lowest), math.log10(2.5 * greatest)]
    else:
        axes["xaxis"]["range"] = [0.0, 1.22 * greatest]
    axes["yaxis"] |= {
        "tickvals": list(range(len(shown))),
        "ticktext": [bar.name for bar in shown],
        "range": [len(shown) - 0.4, -0.6],
        "showgrid": False,
    }
    return {"data": traces, "layout": axes | BARRED | {"margin": _ROOM}}


def height(diagnosis: Diagnosis) -> int:
    """Return how high the plot is, px."""
    return 34 * len(bars(diagnosis)) + 90


def draw_waterfall(diagnosis: Diagnosis) -> Figure:
    """Draw the waterfall."""
    shown = bars(diagnosis)
    lowest = _lowest(shown)
    tall = 0.8 + 0.24 * len(shown)
    figure = Figure(figsize=(WIDTH_IN, tall))
    axis = figure.add_axes((0.27, 0.42 / tall, 0.66, 1.0 - 0.74 / tall))
    figure.text(0.02, 1 - 0.14 / tall, "The gap, step by step", va="center", fontsize=11)
    for place, bar in enumerate(shown):
        low, high = (max(end, lowest) for end in sorted((bar.start, bar.end)))
        axis.barh(place, high - low, left=low, height=0.62, color=_INKS[bar.kind])
        axis.annotate(
            bar.label, (high, place), (3, 0), textcoords="offset points", va="center", fontsize=8
        )
    if lowest:
        axis.set_xscale("log")
        axis.set_xlim(left=lowest)
    elif max(bar.end for bar in shown) < LEAST_PERCENT:
        axis.set_xlim(0.0, LEAST_PERCENT)
    axis.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
    axis.set_yticks(range(len(shown)), [bar.name for bar in shown])
    axis.grid(False, axis="y")
    axis.invert_yaxis()
    axis.margins(x=0.12)
    axis.set_xlabel(_AXIS[diagnosis.compared], labelpad=1)
    return figure
