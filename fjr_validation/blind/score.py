"""Scores of a blind check, each with an interval, side by side for all methods."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field
from scipy import stats

from fjr_kit.result_types import Document, OptionalNumber, ResultModel

from .outcome import CLEAR, NO_EFFECT, Outcome

BINS = (0.0, 0.7, 1.4, 2.8, 5.6, np.inf)
"""Bins of relative size, around half, one, two, four and eight times the detection limit."""
CONFIDENT = 0.8
_BOOTSTRAPS = 2000
_CALIBRATION_BINS = 10


class Score(ResultModel):
    """A number with its 95 % interval.

    Attributes:
        value: the number; None if no case tells.
        low: lower end.
        high: upper end.
        cases: how many cases it rests on.
    """

    value: OptionalNumber = None
    low: OptionalNumber = None
    high: OptionalNumber = None
    cases: int = 0


class SizeBin(ResultModel):
    """What was made of single effects within a bin of relative size.

    Attributes:
        low, high: ends of the bin; None for the last one's upper end.
        first_right, wrong_name, said_nothing: shares of its cases.
    """

    low: float
    high: OptionalNumber
    first_right: Score
    wrong_name: Score
    said_nothing: Score


class MethodScores(ResultModel):
    """All scores of one method: by name, and of single effects by their size."""

    scores: dict[str, Score]
    by_size: list[SizeBin]


class Scores(Document):
    """What `scores.json` holds: the scores of each method by its name."""

    schema_name: Literal["fjr_rig/scores/1"] = Field("fjr_rig/scores/1", alias="schema")
    methods: dict[str, MethodScores]


def rate(hits: Iterable[bool]) -> Score:
    """Return a share with its Clopper-Pearson interval."""
    found = [bool(hit) for hit in hits]
    k, n = sum(found), len(found)
    if not n:
        return Score()
    interval = stats.binomtest(k, n).proportion_ci()
    return Score(value=k / n, low=float(interval.low), high=float(interval.high), cases=n)


def bootstrapped(cases: Sequence[Any], statistic: Callable[[Sequence[Any]], float]) -> Score:
    """Return a statistic with its bootstrap interval over cases, seeded."""
    if not cases:
        return Score()
    rng = np.random.default_rng(0)
    drawn = [
        statistic([cases[i] for i in rng.integers(len(cases), size=len(cases))])
        for _ in range(_BOOTSTRAPS)
    ]
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Score(value=statistic(cases), low=low, high=high, cases=len(cases))


def calibration_error(pairs: Sequence[tuple[float, bool]]) -> float:
    """Return the expected calibration error of (confidence, right), ten bins of equal width."""
    confidence = np.array([c for c, _ in pairs])
    right = np.array([float(r) for _, r in pairs])
    index = np.minimum((confidence * _CALIBRATION_BINS).astype(int), _CALIBRATION_BINS - 1)
    gaps = [
        abs(confidence[index == i].mean() - right[index == i].mean()) * np.mean(index == i)
        for i in np.unique(index)
    ]
    return float(np.sum(gaps))


def _f1(outcomes: Sequence[Outcome]) -> float:
    """Return F1 of named against true effects, pooled over cases."""
    found = sum(outcome.matches for outcome in outcomes)
    said = sum(len(outcome.named) for outcome in outcomes)
    true = sum(len(outcome.truth) for outcome in outcomes)
    return 2.0 * found / (said + true)


def _of(outcomes: Sequence[Outcome], *kinds: str) -> list[Outcome]:
    return [outcome for outcome in outcomes if outcome.kind in kinds]


def scores(outcomes: Sequence[Outcome]) -> dict[str, Score]:
    """Return all scores of one method's outcomes by name."""
    empty = _of(outcomes, "none", "parameters")
    clear = [o for o in _of(outcomes, "single") if o.relative >= CLEAR]
    outside = [o for o in _of(outcomes, "outside") if o.relative >= 1.0]
    sets = [len(o.reported) for o in clear if o.named]
    closed = [
        o.diagnosis.gap_closed
        for o in clear
        if o.diagnosis and o.first and o.diagnosis.gap_closed is not None
    ]
    pairs = [(o.diagnosis.confidence, o.right) for o in outcomes if o.diagnosis]
    deviations = [o.deviations() for o in outcomes]
    return {
        "false_alarm": rate(bool(o.named) for o in empty),
        "abstained_without_effect": rate(o.verdict not in (*NO_EFFECT,) and not o.named
                                         for o in empty),
        "first_right_clear": rate(o.first for o in clear),
        "first_right_clear_strict": rate(o.first_strict for o in clear),
        "in_set_clear": rate(bool(o.named) and o.truth[0] in o.reported for o in clear),
        "set_size_median": bootstrapped(sets, lambda s: float(np.median(s))),
        "two_effects_f1": bootstrapped(_of(outcomes, "two"), _f1),
        "outside_abstained": rate(o.abstains for o in outside),
        "outside_confident_name": rate(_confidently_named(o) for o in outside),
        "nonstationary_found": rate(o.right for o in _of(outcomes, "nonstationary")),
        "gap_closed_median": bootstrapped(closed, lambda c: float(np.median(c))),
        "calibration_error": bootstrapped(pairs, calibration_error),
        "coverage_bare": bootstrapped([bare for bare, _ in deviations if bare], _covered),
        "coverage_effect": bootstrapped([effect for _, effect in deviations if effect], _covered),
        "verdict_right": rate(o.right for o in outcomes),
        "seconds_median": bootstrapped([o.seconds for o in outcomes],
                                       lambda s: float(np.median(s))),
    }  # fmt: skip


def _covered(deviations: Sequence[Sequence[float]]) -> float:
    return float(np.mean([deviation <= 1.0 for case in deviations for deviation in case]))


def _confidently_named(outcome: Outcome) -> bool:
    return bool(outcome.named) and outcome.diagnosis is not None and (
        outcome.diagnosis.confidence >= CONFIDENT
    )  # fmt: skip


def by_size(outcomes: Sequence[Outcome]) -> list[SizeBin]:
    """Return, for each bin of relative size, what was made of single effects."""
    rows = []
    for low, high in itertools.pairwise(BINS):
        inside = [o for o in _of(outcomes, "single") if low <= o.relative < high]
        rows.append(
            SizeBin(
                low=low,
                high=high,
                first_right=rate(o.first for o in inside),
                wrong_name=rate(bool(o.named) and not o.first for o in inside),
                said_nothing=rate(o.verdict in NO_EFFECT for o in inside),
            )
        )
    return rows


def all_scores(outcomes: Sequence[Outcome], methods: Sequence[str]) -> Scores:
    """Return what `scores.json` holds."""
    by_method = {m: [o for o in outcomes if o.method == m] for m in methods}
    return Scores(
        methods={
            m: MethodScores(scores=scores(mine), by_size=by_size(mine))
            for m, mine in by_method.items()
        }
    )


TARGETS: dict[str, tuple[str, float | tuple[float, float]]] = {
    "false_alarm": ("<=", 0.02),
    "first_right_clear": (">=", 0.9),
    "in_set_clear": (">=", 0.97),
    "set_size_median": ("<=", 1.5),
    "two_effects_f1": (">=", 0.8),
    "outside_abstained": (">=", 0.85),
    "outside_confident_name": ("<=", 0.05),
    "gap_closed_median": (">=", 0.9),
    "calibration_error": ("<=", 0.05),
    "coverage_bare": ("in", (0.9, 0.98)),
    "coverage_effect": ("in", (0.9, 0.98)),
}
"""What is aimed at."""


def met(name: str, value: float | None) -> bool | None:
    """Tell whether a score meets its target; None if it has none, or no value."""
    if name not in TARGETS or value is None:
        return None
    sense, bound = TARGETS[name]
    if isinstance(bound, tuple):
        return bound[0] <= value <= bound[1]
    return value <= bound if sense == "<=" else value >= bound
