"""Scores of a blind check, each with an interval, by method and world, beside its targets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field
from scipy import stats

from fjr_kit.result_types import Document, OptionalNumber, ResultModel

from .answers import WORLDS, World
from .outcome import Outcome

_BOOTSTRAPS = 2000


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


class Scores(Document):
    """What `scores.json` holds.

    Attributes:
        frozen: SHA-256 of the sources that made and scored the cases, see `frozen`.
        methods: scores by method, world and name.
    """

    schema_name: Literal["fjr_rig/scores/2"] = Field("fjr_rig/scores/2", alias="schema")
    frozen: str
    methods: dict[str, dict[str, dict[str, Score]]]


def rate(hits: Iterable[bool]) -> Score:
    """Return a share with its Clopper-Pearson interval."""
    found = [bool(hit) for hit in hits]
    k, n = sum(found), len(found)
    if not n:
        return Score()
    interval = stats.binomtest(k, n).proportion_ci()
    return Score(value=k / n, low=float(interval.low), high=float(interval.high), cases=n)


def bootstrapped(cases: Sequence[Any], statistic: Callable[[Sequence[Any]], float | None]) -> Score:
    """Return a statistic with its percentile bootstrap interval over cases, seeded.

    Where cases that were drawn tell nothing, they are left out of the interval.
    """
    value = statistic(cases) if cases else None
    if value is None:
        return Score(cases=len(cases))
    rng = np.random.default_rng(0)
    drawn = [
        statistic([cases[i] for i in rng.integers(len(cases), size=len(cases))])
        for _ in range(_BOOTSTRAPS)
    ]
    low, high = np.percentile([each for each in drawn if each is not None], [2.5, 97.5])
    return Score(value=value, low=float(low), high=float(high), cases=len(cases))


Claimed = Sequence[tuple[float, bool]]
"""How surely each cause that one case lists is present, and whether it is there."""


def auroc(cases: Sequence[Claimed]) -> float | None:
    """Return the area under the ROC curve of `present`; None if all are right, or none is.

    The chance that a right claim is held for surer than a wrong one, ties counting half (Mann,
    Whitney 1947).
    """
    right = [present for case in cases for present, there in case if there]
    wrong = [present for case in cases for present, there in case if not there]
    if not right or not wrong:
        return None
    ranks = stats.rankdata(right + wrong)
    above = ranks[: len(right)].sum() - len(right) * (len(right) + 1) / 2.0
    return float(above / (len(right) * len(wrong)))


def _f1(outcomes: Sequence[Outcome]) -> float | None:
    """Return F1 of named against true causes, pooled over cases."""
    found = sum(outcome.matches for outcome in outcomes)
    said = sum(outcome.said for outcome in outcomes)
    true = sum(len(outcome.asked) for outcome in outcomes)
    return 2.0 * found / (said + true)


def _covered(cases: Sequence[Sequence[bool]]) -> float | None:
    return float(np.mean([held for case in cases for held in case]))


def _median(cases: Sequence[float]) -> float | None:
    return float(np.median(cases))


def scores(outcomes: Sequence[Outcome]) -> dict[str, Score]:
    """Return all scores of one method's outcomes in one world, by name.

    A case on which the method failed counts as a miss wherever it is asked for anything.
    """
    clear = [o for o in outcomes if o.clear]
    pairs = [o for o in clear if o.answer.kind == "two"]
    singles = [o for o in clear if o.answer.kind == "single"]
    empty = [o for o in outcomes if o.answer.kind in ("none", "remainder")]
    outside = [o for o in outcomes if o.answer.kind == "outside"]
    listed = [[(c.present, o.is_right(c)) for c in o.claims] for o in outcomes]
    held = [covered for o in outcomes if (covered := o.covered())]
    return {
        "wrong_name": rate(o.failed or bool(o.wrong_names) for o in outcomes),
        "dominant_named": rate(o.found(o.asked[0]) for o in singles),
        "two_causes_f1": bootstrapped(pairs, _f1),
        "nothing_named": rate(not o.failed and not o.said for o in empty),
        "outside_not_named": rate(not o.failed and not o.said for o in outside),
        "interval_holds": bootstrapped(held, _covered),
        "auroc_present": bootstrapped(listed, auroc),
        "verdict_right": rate(o.right for o in outcomes),
        "failed": rate(o.failed for o in outcomes),
        "seconds_median": bootstrapped([o.seconds for o in outcomes], _median),
    }


def all_scores(outcomes: Sequence[Outcome], methods: Sequence[str], frozen: str) -> Scores:
    """Return what `scores.json` holds."""
    found: dict[str, dict[str, dict[str, Score]]] = {}
    for method in methods:
        mine = [o for o in outcomes if o.method == method]
        worlds = [world for world in WORLDS if any(o.answer.world == world for o in mine)]
        found[method] = {
            world: scores([o for o in mine if o.answer.world == world]) for world in worlds
        }
    return Scores(frozen=frozen, methods=found)


Target = tuple[Literal["<=", ">=", "in"], float | tuple[float, float]]

TARGETS: dict[str, dict[World, Target]] = {
    "wrong_name": {"closed": ("<=", 0.01), "open": ("<=", 0.03), "records": ("<=", 0.03)},
    "dominant_named": {"closed": (">=", 0.97), "open": (">=", 0.85), "records": (">=", 0.8)},
    "two_causes_f1": {"closed": (">=", 0.9), "open": (">=", 0.75)},
    "nothing_named": {"open": (">=", 0.95), "records": (">=", 0.95)},
    "interval_holds": {
        "closed": ("in", (0.9, 0.98)),
        "open": ("in", (0.85, 0.98)),
        "records": ("in", (0.8, 0.98)),
    },
    "auroc_present": {"closed": (">=", 0.9), "open": (">=", 0.85), "records": (">=", 0.85)},
    "seconds_median": {"closed": ("<=", 8.0), "open": ("<=", 20.0), "records": ("<=", 20.0)},
}
"""What is aimed at, by score and world."""


def met(name: str, world: World, value: float | None) -> bool | None:
    """Tell whether a score meets its target; None if it has none, or no value."""
    target = TARGETS.get(name, {}).get(world)
    if target is None or value is None:
        return None
    sense, bound = target
    if isinstance(bound, tuple):
        return bound[0] <= value <= bound[1]
    return value <= bound if sense == "<=" else value >= bound
