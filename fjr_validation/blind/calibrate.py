"""Calibrates confidence and intervals: `python -m fjr_validation.blind.calibrate FOLDER...`.

Each folder is a finished blind check of the method `fjr` whose seed is for training only, such as

    fjr blind run --cases 60 --seed 100 --method fjr --out training/100

It prints the tables for `gap_diagnosis.which.confidence` and `gap_diagnosis.which.estimates` with
what they rest on. Each group of verdicts has a logistic regression with a Gaussian prior, so that
few misses do not make one certain; the expected calibration error is that of leaving each case out
in turn.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.which.confidence import COEFFICIENTS, NAMES, Group, features, group
from gap_diagnosis.which.estimates import WIDENING

from .check import BlindCheck
from .outcome import Outcome
from .score import calibration_error

_MEAN, _STD = 2.0, 1.5  # prior of the intercept: 88 % right
_SLOPE_STD = 1.0
_COVERAGE = 0.95

Case = tuple[Diagnosis, bool]
"""A diagnosis, and whether its verdict was right."""


def outcomes_of(folder: Path) -> list[Outcome]:
    """Return what the project's own method said in a finished check, beside the truth."""
    check = BlindCheck.open(folder)
    answers = check.unseal()
    return [
        Outcome.of(answers[index], values)
        for (method, index), values in check.read_verdicts().items()
        if method == check.methods[0]
    ]


def calibrated(cases: Sequence[Case]) -> dict[Group, tuple[float, ...]]:
    """Return the coefficients of every group."""
    return {kind: _fitted(kind, [c for c in cases if group(c[0]) == kind]) for kind in COEFFICIENTS}


def _fitted(kind: Group, cases: Sequence[Case]) -> tuple[float, ...]:
    size = len(NAMES[kind])
    mean = np.array([_MEAN] + [0.0] * (size - 1))
    std = np.array([_STD] + [_SLOPE_STD] * (size - 1))
    x = np.array([features(diagnosis) for diagnosis, _ in cases]).reshape(-1, size)
    sign = np.array([1.0 if right else -1.0 for _, right in cases])

    def cost(beta: np.ndarray) -> float:
        prior = 0.5 * float(np.sum(((beta - mean) / std) ** 2))
        return prior + float(np.sum(np.logaddexp(0.0, -sign * (x @ beta))))

    return tuple(round(float(b), 3) for b in minimize(cost, mean).x)


def left_out(cases: Sequence[Case]) -> list[tuple[float, bool]]:
    """Return (confidence, right) of each case by a calibration on all the others."""
    pairs = []
    for index, (diagnosis, right) in enumerate(cases):
        kind = group(diagnosis)
        others = [c for i, c in enumerate(cases) if i != index and group(c[0]) == kind]
        score = float(np.dot(_fitted(kind, others), features(diagnosis)))
        pairs.append((1.0 / (1.0 + np.exp(-score)), right))
    return pairs


def widening(outcomes: Sequence[Outcome]) -> tuple[float, ...]:
    """Return the factors with which the intervals of bare parameters would hold 95 % of the truths.

    Never narrower than the theory says; unchanged where no case tells.
    """
    found = []
    for count, present in enumerate(WIDENING):
        mine = [
            deviation
            for outcome in outcomes
            if min(len(outcome.named), len(WIDENING) - 1) == count
            for deviation in outcome.deviations()[0]
        ]
        factor = float(np.quantile(mine, _COVERAGE, method="higher")) if mine else 1.0
        found.append(round(max(present * factor, 1.0), 2))
    return tuple(found)


def summary(cases: Sequence[Case]) -> Iterable[str]:
    """Yield the lines of the table of confidence."""
    for kind, beta in calibrated(cases).items():
        mine = [right for diagnosis, right in cases if group(diagnosis) == kind]
        yield f'    "{kind}": {beta},  # {sum(mine)} of {len(mine)} right'
    yield f"calibration error, each case left out: {calibration_error(left_out(cases)):.3f}"


if __name__ == "__main__":
    every = [outcome for folder in sys.argv[1:] for outcome in outcomes_of(Path(folder))]
    for line in summary([(o.diagnosis, o.right) for o in every if o.diagnosis is not None]):
        print(line)
    print(f"WIDENING = {widening(every)}")
