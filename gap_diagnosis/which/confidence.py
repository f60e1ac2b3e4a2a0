"""Confidence of a verdict: a logistic regression on the figures of the diagnosis.

One regression for each kind of verdict, on a few figures of the ranking. The coefficients are not
set by hand: they were fitted, with a weak prior, to 240 blind cases whose answers are open, those
of the seeds 102 (48), 103 (72) and 105 (120) of the check that docs/blind/one_rig.md reports; so
few were missed that the prior still counts.
"""

from __future__ import annotations

import math
from typing import Literal

from ..outcome.diagnosis import Candidate, Diagnosis

Group = Literal["named", "nothing", "abstained", "gate"]

COEFFICIENTS: dict[Group, tuple[float, ...]] = {
    "named": (2.384, 0.747, -0.82, 0.064, 0.693),  # 124 of 128 right
    "nothing": (3.516, 0.002),  # 57 of 58 right
    "abstained": (2.273, 0.195, -0.849),  # 39 of 43 right
    "gate": (2.206,),  # 10 of 11 right
}
"""Intercept and slopes of `features`."""
NAMES: dict[Group, tuple[str, ...]] = {
    "named": ("intercept", "lead over what is not in the set", "misfit left", "second effect",
              "ambiguous"),
    "nothing": ("intercept", "gain of the best effect"),
    "abstained": ("intercept", "misfit left", "gain of the best"),
    "gate": ("intercept",),
}  # fmt: skip
UNTESTED = 0.5
"""Most that is stated where nothing was held out: all calibration cases had held-out records, so
nothing says that a fit judged by its own data is right more often than not."""
_MOST = 3.0  # features are logarithms, of which more than this says no more


def confidence(diagnosis: Diagnosis) -> float:
    """Return the probability that a verdict is right, in [0, 1]; its own field is not looked at."""
    values = features(diagnosis)
    score = sum(c * v for c, v in zip(COEFFICIENTS[group(diagnosis)], values, strict=True))
    calibrated = 1.0 / (1.0 + math.exp(-score))
    tested = diagnosis.reported_on == "records" or group(diagnosis) == "gate"
    return calibrated if tested else min(calibrated, UNTESTED)


def group(diagnosis: Diagnosis) -> Group:
    """Return what kind of verdict it is."""
    if diagnosis.verdict in ("effect", "ambiguous"):
        return "named"
    if diagnosis.verdict in ("no_gap", "parameters_only"):
        return "nothing"
    return "abstained" if diagnosis.verdict == "unexplained" else "gate"


def features(diagnosis: Diagnosis) -> tuple[float, ...]:
    """Return what the regression of a diagnosis' group takes, 1 first; the rest logarithms."""
    kind = group(diagnosis)
    if kind == "gate":
        return (1.0,)
    refit, left = _misfit(diagnosis, "refit"), _misfit(diagnosis, "explained")
    ranked = [c for c in diagnosis.ranking if c.converged and c.held_out_chi2 is not None]
    best = min((_floored(c) for c in ranked), default=refit)
    if kind == "nothing":
        return 1.0, _log(refit / best)
    if kind == "abstained":
        return 1.0, _log(left), _log(refit / best)
    lead = min((_floored(c) for c in ranked if not _in_set(c, diagnosis)), default=refit) / left
    second = float(len(diagnosis.effects) > 1)
    return 1.0, _log(lead), _log(left), second, float(diagnosis.verdict == "ambiguous")


def _misfit(diagnosis: Diagnosis, stage: Literal["refit", "explained"]) -> float:
    gap = getattr(diagnosis.gap, stage)
    return max(gap.chi2_per_dof, 1.0) if gap is not None and gap.chi2_per_dof else 1.0


def _floored(candidate: Candidate) -> float:
    """Return a misfit, never below that of noise, so that chance does not count."""
    return max(candidate.held_out_chi2 or 0.0, 1.0)


def _log(ratio: float) -> float:
    return max(-_MOST, min(_MOST, math.log(ratio)))


def _in_set(candidate: Candidate, diagnosis: Diagnosis) -> bool:
    """Tell whether a candidate is the named one, equivalent to it, or contains it."""
    names = {name for members in diagnosis.equivalent for name in members}
    same = len(candidate.effects) == len(diagnosis.effects) and set(candidate.effects) <= names
    return same or set(diagnosis.effects) < set(candidate.effects)
