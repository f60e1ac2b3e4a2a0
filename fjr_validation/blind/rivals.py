"""The report's table of methods side by side: what each named, how near it came, its time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy import stats

from .answers import WORLDS
from .outcome import CONFIDENT, Outcome
from .score import Score, bootstrapped

MEANT = (
    "The same cases for every method. *Held-out error* is the rms error of the position over its "
    "rms, by the last model of the method on runs, or blocks of runs, that it has not fitted: the "
    "median over the cases in which it has held something out. *Of the datasheet's* is that error "
    "over the error of the datasheet's values in the simulator of the same method, on the same "
    "runs. Shares of cases have 95 % intervals of Wilson, medians bootstrap intervals over cases. "
    "A failure counts as a wrong name and as a cause that was not found, and not in the held-out "
    "error. A method that gives no confidence is taken at its word, with 1."
)
_COLUMNS = (
    f"wrong name at present >= {CONFIDENT:g}", "dominant cause named or in its set",
    "nothing named where no dominant cause is", "held-out error", "of the datasheet's", "failed",
    "median time (s)",
)  # fmt: skip


def wilson(hits: Iterable[bool]) -> Score:
    """Return a share with its 95 % interval of Wilson (1927)."""
    found = [bool(hit) for hit in hits]
    if not found:
        return Score()
    k, n = sum(found), len(found)
    interval = stats.binomtest(k, n).proportion_ci(method="wilson")
    return Score(value=k / n, low=float(interval.low), high=float(interval.high), cases=n)


def side_by_side(
    lines: Sequence[Mapping[str, Any]], outcomes: Sequence[Outcome], methods: Sequence[str]
) -> list[str]:
    """Return the Markdown of the tables, one for each world; empty for a single method.

    Args:
        lines: raw verdicts.
        outcomes: of the same verdicts.
        methods: names of the methods in order.
    """
    if len(methods) < 2:
        return []
    raw = {(line["case"], line["method"]): line for line in lines}
    text = ["## Methods side by side", "", MEANT, ""]
    for world in WORLDS:
        rows = []
        for method in methods:
            mine = [o for o in outcomes if o.method == method and o.answer.world == world]
            if mine:
                own = [raw.get((o.case, method), {}) for o in mine]
                rows.append(f"| {method} | " + " | ".join(_row(mine, own)) + " |")
        if rows:
            header = f"| {world} | " + " | ".join(_COLUMNS) + " |"
            text += [header, "|---" * (len(_COLUMNS) + 1) + "|", *rows, ""]
    return text


def _row(outcomes: Sequence[Outcome], lines: Sequence[Mapping[str, Any]]) -> list[str]:
    asked = [o for o in outcomes if o.clear and o.answer.kind == "single"]
    empty = [o for o in outcomes if o.answer.kind in ("none", "remainder")]
    left = [error for line in lines if (error := held_out(line)) is not None]
    return [
        _percent(wilson(o.failed or bool(o.wrong_names) for o in outcomes)),
        _percent(wilson(o.found(o.asked[0]) for o in asked)),
        _percent(wilson(not o.failed and not o.said for o in empty)),
        _percent(bootstrapped([own for own, _ in left], _median)),
        _percent(bootstrapped([own / before for own, before in left if before], _median)),
        _percent(wilson(o.failed for o in outcomes)),
        _plain(bootstrapped([o.seconds for o in outcomes], _median)),
    ]


def held_out(line: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the held-out error of a verdict's last model and of the datasheet's values.

    Args:
        line: a raw verdict.

    Returns:
        both over the rms of the position; None where nothing was held out, or the last model's
        motion diverged.
    """
    diagnosis = line.get("diagnosis") or {}
    evidence, steps = diagnosis.get("evidence") or {}, diagnosis.get("steps") or []
    if evidence.get("reported_on", "none") == "none" or not steps:
        return None
    errors = [step.get("nrmse_position") for step in (steps[-1], steps[0])]
    if any(not isinstance(error, (int, float)) or not np.isfinite(error) for error in errors):
        return None
    return float(errors[0]), float(errors[1])


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))


def _percent(score: Score) -> str:
    return _cell(score, 100.0, " %")


def _plain(score: Score) -> str:
    return _cell(score, 1.0, "")


def _cell(score: Score, factor: float, unit: str) -> str:
    if score.value is None or score.low is None or score.high is None:
        return "-"
    value, low, high = (f"{factor * part:.3g}" for part in (score.value, score.low, score.high))
    return f"{value}{unit} [{low}, {high}] n={score.cases}"
