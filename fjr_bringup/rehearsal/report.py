"""report.html of a rehearsal: verdict and reasons, histograms, effect of the delay."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from fjr_kit.page import Row, check_rows, render_page
from fjr_kit.plots import SECONDS, Options, Plot, extremes, layout, linked, stack, trace

from .prediction import Prediction
from .result import Rehearsal, milliseconds
from .timing import EDGES_S, LoopTiming

_KINDS = (
    ("delay", "delay", "--excited"),
    ("latency", "latency", "--odd"),
    ("lateness", "lateness", "--even"),
)
_SIGNALS = (("reference", "rad"), ("position", "rad"), ("torque", "N m"))
_WORDS = ("kept", "not\N{NO-BREAK SPACE}kept")


def render(rehearsal: Rehearsal, provenance: Mapping[str, str]) -> str:
    """Return the whole page.

    Args:
        rehearsal: what was found.
        provenance: what made the report, by name, in order.
    """
    origin = {
        "ROS": f"domain {rehearsal.domain}; {rehearsal.reach}",
        "experiment": json.dumps(rehearsal.experiment, ensure_ascii=False, default=str),
        **provenance,
    }
    return render_page(
        "fjr_bringup.rehearsal",
        "rehearsal.html",
        title=f"Rehearsal: {'GO' if rehearsal.go else 'NO-GO'}",
        plots={"overview": _plots(rehearsal), "levels": [{}]},
        provenance=origin,
        rehearsal=rehearsal,
        timing=rehearsal.timing,
        prediction=rehearsal.prediction,
        lead=_lead(rehearsal),
        times=_times(rehearsal.timing),
        signals=_counts(rehearsal.timing),
        processes=[
            (name, each.policy, *map(str, (each.priority, each.nice, each.cores)))
            for name, each in rehearsal.machine.nodes.items()
        ],
        checks=check_rows(rehearsal.checks, _WORDS),
    )


def _lead(rehearsal: Rehearsal) -> str:
    """Return what was played, for how long and how it ended, in a sentence."""
    timing = rehearsal.timing
    lead = (
        f"{rehearsal.drive} drive{' moving hardware' if rehearsal.hardware else ''}, "
        f"{timing.sample_rate_hz:g} Hz, {timing.duration_s:.1f} of {rehearsal.planned_s:.1f} s; "
        f"{rehearsal.ended}."
    )
    if rehearsal.fault:
        words = ", ".join(f"{name} {value}" for name, value in rehearsal.fault.items())
        lead += f" Fault rehearsed: {words}."
    return lead


def _times(timing: LoopTiming) -> list[Row]:
    """Return median, quantiles and worst (ms) of each time of the loop, and its samples."""
    named = {
        "delay: sample instant to torque": timing.delay,
        "lateness: sample instant to position sent": timing.lateness,
        "latency: position sent to torque received": timing.latency,
        "jitter of positions": timing.position.jitter,
        "jitter of torques": timing.torque.jitter,
    }
    return [(name, *milliseconds(spread), spread.count) for name, spread in named.items()]


def _counts(timing: LoopTiming) -> list[Row]:
    """Return messages, rate (Hz), what went wrong how often, and the greatest value by signal."""
    rows: list[Row] = []
    for name, _ in _SIGNALS:
        topic = getattr(timing, name)
        counts = (topic.lost, topic.repeated, topic.unordered, topic.clock_jumps, topic.not_finite)
        rows.append((name, topic.messages, topic.rate_hz, *counts, topic.greatest))
    return rows


def _plots(rehearsal: Rehearsal) -> dict[str, Plot]:
    """Return the plots by place: those that something was recorded for."""
    plots: dict[str, Plot] = {}
    if any(messages.size for messages in rehearsal.signals):
        plots["signals"] = _signals(rehearsal)
    if rehearsal.timing.delay_s.size:
        plots |= {"histogram": _histogram(rehearsal.timing), "course": _course(rehearsal.timing)}
    if rehearsal.prediction is not None:
        plots["bias"] = _bias(rehearsal.prediction)
    return plots


def _signals(rehearsal: Rehearsal) -> Plot:
    traces = []
    for row, (name, unit) in enumerate(_SIGNALS, start=1):
        messages = rehearsal.signals[row - 1]
        t, y = extremes(1e-9 * messages["stamp"], messages["value"])
        style: Options = {"dash": "solid", "width": 1.0, "row": row, "showlegend": False}
        traces.append(trace(t, y, name, "--ink", **style, unit=unit, at=SECONDS))
    titles = [f"{name} ({unit})" for name, unit in _SIGNALS]
    return {"data": traces, "layout": stack(titles, [1.0, 1.0, 1.0], "time (s)")}


def _histogram(timing: LoopTiming) -> Plot:
    traces = []
    centres = 1e3 * np.sqrt(EDGES_S[1:] * EDGES_S[:-1])
    spreads = [getattr(timing, field) for field, _, _ in _KINDS]
    hit = np.flatnonzero(sum(spread.histogram for spread in spreads))
    shown = slice(hit[0], hit[-1] + 1)
    for spread, (_, name, color) in zip(spreads, _KINDS, strict=True):
        counts = spread.histogram[shown]
        share = np.where(counts > 0, counts / max(spread.count, 1), np.nan)
        style: Options = {"symbol": "square", "size": 3, "dash": "solid", "at": "%{x:.3g} ms"}
        traces.append(trace(centres[shown], share, name, color, **style, unit="of the samples"))
        traces[-1]["line"] |= {"shape": "hvh"}
    made = layout("time (ms)", "share of the samples", log_x=True)
    made["yaxis"] |= {"type": "log", "dtick": 1}
    return {"data": traces, "layout": made}


def _course(timing: LoopTiming) -> Plot:
    time_s = np.arange(timing.delay_s.size) / timing.sample_rate_hz
    t, delay = extremes(time_s, 1e3 * timing.delay_s)
    style: Options = {"dash": "solid", "width": 1.0, "showlegend": False}
    made = trace(t, delay, "delay", "--excited", **style, unit="ms", at="%{x:.3f} s")
    return {"data": [made], "layout": layout("answered samples (s)", "delay (ms)")}


def _bias(prediction: Prediction) -> Plot:
    f = prediction.frequency_hz
    rows = (("magnitude", prediction.bias_db, "dB"), ("phase", prediction.bias_deg, "degrees"))
    traces = []
    for row, (name, values, unit) in enumerate(rows, start=1):
        style: Options = {"dash": "solid", "row": row, "showlegend": False}
        traces.append(trace(f, values, name, "--excited", **style, unit=unit))
    titles = [f"{name} ({unit})" for name, _, unit in rows]
    return linked(traces, titles, [1.0, 1.0], f, on_top="first")
