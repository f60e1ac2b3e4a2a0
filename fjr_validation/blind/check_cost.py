"""What a blind check will take: `--dry-run`, from its own verdicts once it has some."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .check import BlindCheck

MAKING_S = 7.0
"""Processor time of making a case: mean of six training cases, two of each world."""

SECONDS: Mapping[str, float] = {"fjr": 60.0, "refit": 1.0, "bic": 11.0, "sparse": 8.0}
"""Processor time of a method on a case, no more than its order: ours differ by more than tenfold on
training cases, the others' are those of docs/blind.md."""

_OTHERS_S = 120.0  # where the methods of others end
CASE_BYTES = 13e6
"""Bags of one case: mean of six training cases, two of each world, from 2 to 34 MB."""


@dataclass(frozen=True)
class Estimate:
    """What is still to do of a check.

    Attributes:
        cases: how many there are in all.
        missing: how many of them lack verdicts.
        processor_s: time of one processor.
        measured: whether that rests on verdicts of this check.
    """

    cases: int
    missing: int
    processor_s: float
    measured: bool


def estimate(
    folder: Path, cases: Mapping[str, int], seed: int | None, methods: Sequence[str]
) -> Estimate:
    """Return what is still to do of the check that is ordered; nothing is written.

    Raises:
        InputError: as `BlindCheck.begin`.
    """
    check = BlindCheck.ordered(folder, cases, seed, methods)
    total = missing = sum(cases.values())
    seen: dict[str, list[float]] = defaultdict(list)
    if check is not None:
        missing = len(check.missing())
        for line in check.verdicts():
            seen[line["method"]].append(line["seconds"])
    each_s = MAKING_S + sum(
        float(np.mean(seen[method])) if seen[method] else SECONDS.get(method, _OTHERS_S)
        for method in methods
    )
    return Estimate(total, missing, missing * each_s, all(seen[method] for method in methods))
