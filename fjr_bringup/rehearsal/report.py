"""report.html of a rehearsal: verdict and reasons, histograms, what the delay does."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape

import numpy as np

from bla_analyzer.page import Cell, bullets, figure, page, table
from bla_analyzer.plot_parts import Plot, extremes, frequency_layout, hover, stack, trace

from .prediction import Prediction
from .result import Rehearsal, milliseconds
from .timing import EDGES_S, LoopTiming

_KINDS = (
    ("delay", "delay", "--excited"),
    ("latency", "latency", "--odd"),
    ("lateness", "lateness", "--even"),
)


def render(rehearsal: Rehearsal, provenance: Mapping[str, str]) -> str:
    """Return the whole page.

    Args:
        rehearsal: what was found.
        provenance: what made the report, by name, in order.
    """
    body = "\n".join(
        [
            _top(rehearsal),
            _numbers(rehearsal.timing),
            _figures(rehearsal),
            _checks(rehearsal),
            _origin(rehearsal, provenance),
        ]
    )
    plots: dict[str, Plot] = {}
    if rehearsal.timing.delay_s.size:
        plots = {"histogram": _histogram(rehearsal.timing), "course": _course(rehearsal.timing)}
    if rehearsal.prediction is not None:
        plots["bias"] = _bias(rehearsal.prediction)
    return page(f"Rehearsal: {_verdict(rehearsal)}", body, {"overview": plots, "levels": [{}]})


def _verdict(rehearsal: Rehearsal) -> str:
    return "GO" if rehearsal.go else "NO-GO"


def _top(rehearsal: Rehearsal) -> str:
    timing = rehearsal.timing
    lead = (
        f"{rehearsal.drive} drive{' moving hardware' if rehearsal.hardware else ''}, "
        f"{timing.sample_rate_hz:g} Hz, {timing.duration_s:.1f} of {rehearsal.planned_s:.1f} s; "
        f"{rehearsal.ended}."
    )
    if rehearsal.fault:
        lead += f" Fault rehearsed: {json.dumps(dict(rehearsal.fault))}."
    bag = rehearsal.bag_damage or f"Bag: {rehearsal.bag}."
    return f"""<header>
<h1>Rehearsal: {_verdict(rehearsal)}</h1>
<p class="lead">{escape(lead)}</p>
<div class="verdict{"" if rehearsal.go else " bad"}">
<strong>{escape(rehearsal.headline)}</strong>
{bullets(map(escape, rehearsal.reasons))}</div>
<p>{escape(bag)}</p></header>"""


def _numbers(timing: LoopTiming) -> str:
    heads = [("time", ""), ("median", "ms"), ("99 %", "ms"), ("99.9 %", "ms"), ("worst", "ms")]
    heads.append(("samples", ""))
    named = {
        "delay: sample instant to torque": timing.delay,
        "lateness: sample instant to position sent": timing.lateness,
        "latency: position sent to torque received": timing.latency,
        "jitter of positions": timing.position.jitter,
        "jitter of torques": timing.torque.jitter,
    }
    rows: list[tuple[int | None, list[Cell]]] = []
    for name, spread in named.items():
        cells: list[Cell] = [(value, ".3f") for value in milliseconds(spread)]
        rows.append((None, [name, *cells, (spread.count, ".0f")]))
    times = table(heads, rows, "Times of the loop.")
    heads = [("signal", ""), ("messages", ""), ("rate", "Hz"), ("lost", ""), ("repeated", "")]
    heads += [("out of order", ""), ("clock jumps", ""), ("not finite", ""), ("greatest", "SI")]
    rows = []
    for name in ("reference", "position", "torque"):
        topic = getattr(timing, name)
        counts = (topic.lost, topic.repeated, topic.unordered, topic.clock_jumps, topic.not_finite)
        cells = [(topic.messages, ".0f"), (topic.rate_hz, ".3f"), *((n, ".0f") for n in counts)]
        rows.append((None, [name, *cells, topic.greatest]))
    signals = table(
        heads,
        rows,
        f"Signals. {timing.late} torques came later than one sample period, {timing.unanswered} "
        f"positions got none, {timing.late_references} references came after their position.",
    )
    return f"<section>\n<h2>Numbers</h2>\n{times}{signals}</section>"


def _figures(rehearsal: Rehearsal) -> str:
    places = ""
    if rehearsal.timing.delay_s.size:
        places += figure(
            "histogram",
            360,
            "<b>Times of the loop.</b> Share of the samples in each bin; 20 bins a decade.",
        )
        places += figure("course", 300, "<b>Delay in the course of the rehearsal.</b>")
    p = rehearsal.prediction
    if p is not None:
        text = (
            f"<b>Bias of the BLA by the measured delay</b> (torque to position). Delay margin of "
            f"the loop: {_ms(p.delay_margin_s)} with viscous friction only, "
            f"{_ms(p.delay_margin_equivalent_s)} at this amplitude by statistical linearisation, "
            f"{_ms(p.delay_margin_frictionless_s)} without friction; the delay (99 %: "
            f"{_ms(p.delay_p99_s)}) uses {100.0 * p.margin_share:.0f} % of the first. A delay "
            "before the position is sent that was there all the time is not seen; it adds to this."
        )
        places += figure("bias", 420, text)
    return f"<section>\n<h2>Delay</h2>\n{places}</section>" if places else ""


def _ms(seconds: float) -> str:
    return f"{seconds * 1e3:.2f} ms" if np.isfinite(seconds) else "\N{EN DASH}"


def _histogram(timing: LoopTiming) -> Plot:
    traces = []
    centres = 1e3 * np.sqrt(EDGES_S[1:] * EDGES_S[:-1])
    spreads = [getattr(timing, field) for field, _, _ in _KINDS]
    hit = np.flatnonzero(sum(spread.histogram for spread in spreads))
    shown = slice(hit[0], hit[-1] + 1)
    for spread, (_, name, color) in zip(spreads, _KINDS, strict=True):
        counts = spread.histogram[shown]
        share = np.where(counts > 0, counts / max(spread.count, 1), np.nan)
        note = {"hovertemplate": hover("of the samples", "%{x:.3g} ms")}
        marks = {"symbol": "square", "size": 3, "dash": "solid"}
        traces.append(trace(centres[shown], share, name, color, **marks, **note))
        traces[-1]["line"] |= {"shape": "hvh"}
    layout = stack(["share of the samples"], [1.0], "time (ms)")
    layout["xaxis"] |= {"type": "log", "dtick": 1, "tickformat": "~g"}
    layout["yaxis"] |= {"type": "log", "dtick": 1}
    return {"data": traces, "layout": layout}


def _course(timing: LoopTiming) -> Plot:
    time_s = np.arange(timing.delay_s.size) / timing.sample_rate_hz
    t, delay = extremes(time_s, 1e3 * timing.delay_s)
    note = {"hovertemplate": hover("ms", "%{x:.3f} s"), "showlegend": False}
    traces = [trace(t, delay, "delay", "--excited", dash="solid", **note)]
    traces[-1]["line"]["width"] = 1
    return {"data": traces, "layout": stack(["delay (ms)"], [1.0], "answered samples (s)")}


def _bias(prediction: Prediction) -> Plot:
    f = prediction.frequency_hz
    rows = (("magnitude", prediction.bias_db, "dB"), ("phase", prediction.bias_deg, "degrees"))
    traces = []
    for row, (name, values, unit) in enumerate(rows, start=1):
        note = {"hovertemplate": hover(unit), "showlegend": False}
        traces.append(trace(f, values, name, "--excited", dash="solid", row=row, **note))
    titles = [f"{name} ({unit})" for name, _, unit in rows]
    return {"data": traces, "layout": frequency_layout(titles, [1.0, 1.0], f)}


def _checks(rehearsal: Rehearsal) -> str:
    heads = [("check", ""), ("", ""), ("value", ""), ("limit", ""), ("finding", "")]
    rows: list[tuple[int | None, list[Cell]]] = []
    for check in sorted(rehearsal.checks, key=lambda each: each.passed):
        kind, word = ("pass", "kept") if check.passed else ("fail", "not kept")
        mark = f'<span class="{kind}">{word.replace(" ", "&nbsp;")}</span>'
        cells: list[Cell] = [escape(check.name), mark, check.value, check.limit]
        rows.append((None, [*cells, escape(check.sentence)]))
    return f"<section>\n<h2>Limits</h2>\n{table(heads, rows, 'In SI units.')}</section>"


def _origin(rehearsal: Rehearsal, provenance: Mapping[str, str]) -> str:
    pairs = {
        "ROS": f"domain {rehearsal.domain}; {rehearsal.reach}",
        "experiment": json.dumps(rehearsal.experiment, ensure_ascii=False, default=str),
        **provenance,
    }
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>\n" for k, v in pairs.items())
    return f"<section>\n<h2>Provenance</h2>\n<dl>\n{items}</dl></section>"
