"""Interactive plots of the runs: over time, by band, missing torque, what was tried.

Colours and dashes of the models are those of the plots of steady periods.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fjr_kit.number_text import SIGMA
from fjr_kit.plots import PLAIN, SECONDS, Options, Plot, extremes, layout, numbers, stack, trace

from ..how_far.run_comparison import RunComparison
from ..outcome.cause_words import known, two_digits
from ..outcome.diagnosis import Candidate
from ..outcome.verdict_words import explanation
from .gap_level_plots import MODEL_STYLES

_STEPS = ("--noise", "--model", "--level1", "--level2", "--level3", "--level4")
_MINUS = "\N{MINUS SIGN}"


def run_level_plots(found: RunComparison, noise_known: bool) -> dict[str, Plot]:
    """Return the plots of a level by the identifier of their place in the page."""
    return {
        "run-time": _time(found),
        "run-bands": _bands(found, noise_known),
        "run-torque": _torque(found),
    }


def _time(found: RunComparison) -> Plot:
    """Return y of rig and models, and what each model misses of y and of u.

    Where torques were compared, those of rig and models, what each misses, and y of the rig.
    """
    if found.compared == "torque":
        return _torque_over_time(found)
    t, traces = found.time_s, []
    line: Options = {"dash": "solid", "width": 1.0, "at": SECONDS}
    x, y = extremes(t, found.position["rig"])
    traces.append(trace(x, y, "rig", "--ink", **line, unit="rad"))
    shown = {n: s for n, s in MODEL_STYLES.items() if n in found.position}
    for name, (label, color, dash) in shown.items():
        x, y = extremes(t, found.position[name])
        traces.append(trace(x, y, label, color, **(line | {"dash": dash}), unit="rad"))
    for row, unit, signals in ((2, "rad", found.position), (3, "N m", found.torque)):
        for name, (label, color, _) in shown.items():
            x, y = extremes(t, signals[name] - signals["rig"])
            line |= {"row": row, "showlegend": False}
            traces.append(trace(x, y, label, color, **line, unit=unit))
    titles = ["y (rad)", f"y, model {_MINUS} rig (rad)", f"u, model {_MINUS} rig (N m)"]
    return {"data": traces, "layout": stack(titles, [1.0, 1.0, 1.0], "time (s)")}


def _torque_over_time(found: RunComparison) -> Plot:
    t, traces = found.time_s, []
    line: Options = {"dash": "solid", "width": 1.0, "at": SECONDS}
    x, y = extremes(t, found.torque["rig"])
    traces.append(trace(x, y, "rig", "--ink", **line, unit="N m"))
    for name, (label, color, dash) in MODEL_STYLES.items():
        if name in found.torque:
            x, y = extremes(t, found.torque[name])
            traces.append(trace(x, y, label, color, **(line | {"dash": dash}), unit="N m"))
            x, y = extremes(t, found.torque[name] - found.torque["rig"])
            below: Options = line | {"row": 2, "showlegend": False}
            traces.append(trace(x, y, label, color, **below, unit="N m"))
    x, y = extremes(t, found.position["rig"])
    lowest: Options = line | {"row": 3, "showlegend": False}
    traces.append(trace(x, y, "rig", "--ink", **lowest, unit="rad"))
    titles = ["u (N m)", f"u, model {_MINUS} rig (N m)", "y (rad)"]
    return {"data": traces, "layout": stack(titles, [1.0, 1.0, 1.0], "time, mean (s)")}


def _bands(found: RunComparison, noise_known: bool) -> Plot:
    """Return the rms error in each band after each step."""
    edges = found.edges_hz
    names = ["0 to " + two_digits(edges[1])]
    names += [f"{two_digits(a)} to {two_digits(b)}" for a, b in pairwise(edges[1:])]
    at = np.arange(len(names), dtype=float)
    unit = SIGMA if noise_known else f"of the {found.compared}"
    traces = []
    for order, (name, errors) in enumerate(found.errors.items()):
        label = {"nominal": "nominal", "refit": "refit"}.get(name, f"+ {explanation([name])}")
        color = _STEPS[min(order, len(_STEPS) - 1)]
        options: Options = {"dash": "dot" if order == 0 else "solid", "symbol": "circle"}
        made = trace(at, errors, label, color, **options, size=7, unit=unit)
        made["hovertemplate"] = f"%{{y:.3g}} {unit}<extra>%{{fullData.name}}</extra>"
        traces.append(made)
    if noise_known:
        ends = [-0.4, len(names) - 0.6]
        traces.append(trace(ends, [1.0, 1.0], "noise", "--noise", dash="dash", hoverinfo="skip"))
    title = f"rms error / noise ({SIGMA})" if noise_known else f"rms error / rms {found.compared}"
    axes = layout("band (Hz)", title)
    axes["yaxis"] |= {"type": "log", "tickformat": "~g", "dtick": 1}
    axes["xaxis"] |= {
        "tickvals": at.tolist(),
        "ticktext": names,
        "range": [-0.4, len(names) - 0.6],
    }
    return {"data": traces, "layout": axes}


def _torque(found: RunComparison) -> Plot:
    """Return the torque that refit and best model lack, over velocity and over angle."""
    styles = (("refit", "refit", "--model"), ("explained", "best explanation", "--excited"))
    traces = []
    for row, curves in enumerate((found.over_velocity, found.over_angle), start=1):
        for name, label, color in styles:
            if name not in curves:
                continue
            line: Options = {"dash": "solid", "row": row, "showlegend": row == 1}
            line |= {"unit": "N m", "at": f"{PLAIN} {('rad/s', 'rad')[row - 1]}"}
            made = trace(curves[name].center, curves[name].torque, label, color, **line)
            traces.append(made | {"xaxis": f"x{row}" if row > 1 else "x"})
    axes: Options = {}
    for row, title in enumerate(("motor velocity (rad/s)", "motor position (rad)"), start=1):
        suffix = row if row > 1 else ""
        domain = [0.58, 1.0] if row == 1 else [0.0, 0.4]
        axes[f"xaxis{suffix}"] = {"title": {"text": title}, "anchor": f"y{suffix}"}
        axes[f"yaxis{suffix}"] = {
            "title": {"text": "torque (N m)"}, "domain": domain, "anchor": f"x{suffix}",
        }  # fmt: skip
    return {"data": traces, "layout": axes}


def tried_plot(ranking: Sequence[Candidate]) -> Plot | None:
    """Return what each effect that was tried gains over the step before; None if none was."""
    shown = [c for c in ranking if known(c.delta)]
    if not shown:
        return None
    shown.sort(key=lambda c: (len(c.effects), -(c.delta or 0.0)))
    at = np.arange(len(shown), dtype=float)
    traces = []
    for step in sorted({len(c.effects) for c in shown}):
        chosen = np.array([len(c.effects) == step for c in shown])
        gains = np.array([c.delta for c in shown], float)[chosen]
        color = _STEPS[min(step + 1, len(_STEPS) - 1)]
        note = f"{PLAIN}<extra>%{{fullData.name}}</extra>"
        options: Options = {"symbol": "circle", "size": 9, "hovertemplate": note}
        traces.append(trace(gains, at[chosen], f"step {step}", color, **options))
    axes = layout("gain of log-likelihood of a block that selects (nats)", "")
    axes["xaxis"] |= {"zeroline": True, "zerolinecolor": "--muted", "rangemode": "tozero"}
    axes["yaxis"] |= {
        "tickvals": numbers(at),
        "ticktext": [f"{len(c.effects)}: {explanation(c.effects[-1:])}" for c in shown],
        "range": [len(shown) - 0.3, -0.7],
        "showgrid": False,
    }
    return {"data": traces, "layout": axes}
