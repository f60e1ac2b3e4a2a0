"""The telltale of each named cause: the words of its entry, and the plot it asks for."""

from __future__ import annotations

from typing import Any

import numpy as np

from fjr_kit.plots import PLAIN, Options, Plot, layout, linked, numbers, trace
from fjr_sim_node.effects import EFFECTS, QUANTITIES

from ..investigation import Fitted, Investigation
from ..outcome.cause import Cause
from ..outcome.verdict_words import explanation
from ..where.telltale import Shown, shown, why_not

_ROOM = 2.5  # times the greatest median: samples beyond that are not seen at first
_POINT: Options = {"symbol": "circle", "size": 5}


def telltales(investigation: Investigation) -> tuple[list[dict[str, Any]], dict[str, Plot]]:
    """Return what the page says of each named cause, and the plots by their places."""
    fitted = investigation.fitted
    if fitted is None:
        return [], {}
    said: list[dict[str, Any]] = []
    plots: dict[str, Plot] = {}
    for cause in investigation.diagnosis.causes:
        plot, reason = _plot(fitted, cause.effect)
        place = f"telltale-{cause.effect}" if plot else ""
        plots |= {place: plot} if plot else {}
        said.append(_words(cause) | {"place": place, "reason": reason})
    return said, plots


def _words(cause: Cause) -> dict[str, Any]:
    """Return the name of a cause, the telltales of its set, and what its plot shows."""
    telltale = EFFECTS[cause.effect].telltale
    name = explanation([cause.effect])
    what = {
        "torque": "medians of the torque (grey: single samples) that",
        "lacking": "lacks",
        "added": f"what {name} adds",
    }
    if telltale.over == "frequency":
        what = {
            "torque": "rms error of the position, line by line, that",
            "lacking": "leaves",
            "added": f"how far {name} moves the position",
        }
    folded = telltale.along and QUANTITIES[telltale.along][0]
    return what | {
        "name": name,
        "words": telltale.words,
        "quantity": QUANTITIES[telltale.over][0],
        "folded": folded,
        "others": [
            f"{explanation([other])}: {EFFECTS[other].telltale.words}" for other in cause.others
        ],
    }


def _plot(fitted: Fitted, effect: str) -> tuple[Plot | None, str]:
    """Return the plot of a cause, or None and why there is none."""
    if reason := why_not(fitted.evidence, effect):
        return None, reason
    found = shown(fitted.evidence, effect, fitted.found.best.model)
    if found is None:
        return None, "the simulation without it diverges"
    return drawn(found, effect), ""


def drawn(found: Shown, effect: str) -> Plot:
    """Return what shows a cause as an interactive plot.

    Args:
        found: from `shown`.
        effect: identifier of the cause.
    """
    over = EFFECTS[effect].telltale.over
    quantity, unit = QUANTITIES[over]
    frequency = over == "frequency"
    shared: Options = {"unit": "rad" if frequency else "N m", "at": f"{PLAIN} {unit}"}
    name = explanation([effect])
    lacks, adds = ("left", "moved") if frequency else ("lacking", "added")
    x, line = found.center, shared | {"dash": "solid"}
    traces = [
        trace(x, found.left, f"{lacks} with {name}", "--noise", **(line | {"dash": "dot"})),
        trace(x, found.added, f"{adds} by {name}", "--excited", **line),
        trace(x, found.without, f"{lacks} without {name}", "--model", **shared, **_POINT),
    ]
    if frequency:
        plot = linked(traces, ["rms of a line (rad)"], [1.0], x)
        ends = 0.5 * np.min([found.without, found.left]), 2.0 * np.max(found.without)
        plot["layout"]["yaxis"] |= {"type": "log", "dtick": 1, "range": numbers(np.log10(ends))}
        return plot
    dot: Options = {"symbol": "circle", "size": 3, "opacity": 0.45, "showlegend": False}
    traces.insert(0, trace(found.at, found.lacking, "sample", "--noise", **shared, **dot))
    medians = np.concatenate([found.without, found.added, found.left])
    most = _ROOM * float(np.abs(medians).max())
    low, high = (float(end(found.lacking)) for end in (np.min, np.max))
    low, high = min(max(low, -most), medians.min()), max(min(high, most), medians.max())
    titles = f"{quantity} ({unit})", "torque (N m)"
    axes = layout(*titles, log_x=over == "travel", y_range=(low, high))
    return {"data": traces, "layout": axes | {"legend": {"traceorder": "reversed"}}}
