"""The outcome of a rehearsal as one value, and as rehearsal.json (docs/rehearsal.md)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bla_analyzer.result import Check
from bla_analyzer.result_json import pretty

from .limits import go
from .prediction import Prediction
from .timing import EDGES_S, Distribution, LoopTiming

SCHEMA = "fjr_rig/rehearsal/1"


@dataclass(frozen=True)
class Rehearsal:
    """What a rehearsal found.

    Attributes:
        drive: `simulated` or `external`.
        hardware: whether the drive was said to move hardware.
        domain: ROS domain.
        reach: how far discovery reached, in words.
        planned_s: how long it should have lasted (s).
        ended: how it ended, in words.
        fault: kind and parameters of the fault that was rehearsed, empty without one.
        fault_seed: seed of the fault.
        timing: what was measured.
        prediction: what the measured delay does; None if nothing was answered.
        checks: one for each limit.
        limits: the limits, by name.
        bag: path of the bag, relative to the folder; None if it is not whole.
        bag_damage: why there is none.
        experiment: description of what was played, as plain data.
    """

    drive: str
    hardware: bool
    domain: int
    reach: str
    planned_s: float
    ended: str
    fault: Mapping[str, Any]
    fault_seed: int
    timing: LoopTiming
    prediction: Prediction | None
    checks: tuple[Check, ...]
    limits: Mapping[str, Any]
    bag: str | None
    bag_damage: str | None
    experiment: Mapping[str, Any]

    @property
    def go(self) -> bool:
        """Whether every check passed."""
        return go(self.checks)

    @property
    def headline(self) -> str:
        """The verdict in one sentence."""
        if self.go:
            return f"GO: all {len(self.checks)} limits are kept."
        return f"NO-GO: {len(self.reasons)} of {len(self.checks)} limits are not kept."

    @property
    def reasons(self) -> list[str]:
        """Why it is NO-GO: the sentences of the checks that failed."""
        return [check.sentence for check in self.checks if not check.passed]


def to_json(rehearsal: Rehearsal) -> str:
    """Return rehearsal.json; a number that is not finite is null."""
    found = {
        "schema": SCHEMA,
        "verdict": "GO" if rehearsal.go else "NO-GO",
        "reasons": rehearsal.reasons,
        **{
            field.name: getattr(rehearsal, field.name)
            for field in dataclasses.fields(rehearsal)
            if field.name not in ("timing", "prediction", "checks")
        },
        "timing": _timing(rehearsal.timing),
        "prediction": rehearsal.prediction and _prediction(rehearsal.prediction),
        "checks": [
            {name: getattr(check, name) for name in _CHECK_FIELDS} for check in rehearsal.checks
        ],
    }
    return pretty(_plain(found)) + "\n"


_CHECK_FIELDS = ("name", "passed", "value", "limit", "sentence")


def _timing(timing: LoopTiming) -> dict[str, Any]:
    found = dataclasses.asdict(timing)
    del found["delay_s"]
    return found | {"histogram_edges_s": EDGES_S}


def _prediction(prediction: Prediction) -> dict[str, Any]:
    shares = ("margin_share", "worst_bias_db", "worst_bias_deg")
    found = dataclasses.asdict(prediction)
    return found | {name: getattr(prediction, name) for name in shares}


def _plain(value: Any) -> Any:
    """Return nested data of JSON's own types."""
    if isinstance(value, Mapping):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def milliseconds(distribution: Distribution) -> list[float]:
    """Return median, p99, p99.9 and worst in ms."""
    parts = (distribution.p50, distribution.p99, distribution.p999, distribution.worst)
    return [1e3 * part for part in parts]
