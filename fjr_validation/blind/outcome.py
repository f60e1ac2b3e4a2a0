"""One verdict beside the truth: what was right, what was named, what the intervals covered."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any

from gap_diagnosis.outcome.diagnosis import Diagnosis

from .cases import Answer, Effect

NO_EFFECT = ("no_gap", "parameters_only")
NAMING = ("effect", "ambiguous")
ABSTAINING = ("unexplained", "nonstationary", "bad_data")
VISIBLE = 1.0
"""Relative size below which an effect need not be seen: its detection limit."""
CLEAR = 3.0
"""Relative size above which an effect should be named."""


def indistinguishable(effect: Effect) -> set[str]:
    """Return the names that say the same as the true one: equivalences known beforehand."""
    names = {effect.name}
    constant_torque = {"torque_bias", "asymmetric_friction", "gravity"}
    angle = effect.catalogue.get("gravity.angle_rad")
    if (
        effect.name == "torque_bias"
        or "asymmetric_friction.coulomb_nm" in effect.catalogue
        or (angle is not None and abs(math.sin(angle)) > 0.95)
    ):
        names |= constant_torque
    if effect.name == "backlash":
        names.add("piecewise_stiffness")
    return names


@dataclass(frozen=True)
class Outcome:
    """A method's verdict on a case beside its answer.

    Attributes:
        case: name of the case.
        method: name of the method.
        answer: the truth.
        diagnosis: what was said; None if the method failed.
        error: why it failed.
        seconds: what it took.
    """

    case: str
    method: str
    answer: Answer
    diagnosis: Diagnosis | None
    error: str
    seconds: float

    @classmethod
    def of(cls, answer: Answer, values: dict[str, Any]) -> Outcome:
        """Return the outcome of a verdict file's content."""
        said = values.get("diagnosis")
        diagnosis = None if said is None else Diagnosis.from_json(json.dumps(said), values["case"])
        return cls(
            values["case"],
            values["method"],
            answer,
            diagnosis,
            values.get("error", ""),
            values["seconds"],
        )

    @property
    def kind(self) -> str:
        """Kind of the case."""
        return self.answer.kind

    @property
    def truth(self) -> tuple[str, ...]:
        """Names of the true effects."""
        return tuple(effect.name for effect in self.answer.effects)

    @property
    def relative(self) -> float:
        """How far the (least) true effect shows, over what its detection limit shows."""
        return min((effect.relative for effect in self.answer.effects), default=0.0)

    @property
    def verdict(self) -> str:
        """What was said; `failed` if nothing."""
        return self.diagnosis.verdict if self.diagnosis else "failed"

    @property
    def named(self) -> tuple[str, ...]:
        """Effects that were named, best first; none for a verdict that names none."""
        if self.diagnosis is None or self.verdict not in NAMING:
            return ()
        return tuple(self.diagnosis.effects)

    @property
    def reported(self) -> set[str]:
        """All effects in the reported sets."""
        if not self.named or self.diagnosis is None:
            return set()
        return {*self.named, *(name for group in self.diagnosis.equivalent for name in group)}

    @property
    def abstains(self) -> bool:
        """Whether the verdict says that something is there that has no name."""
        return self.verdict in ABSTAINING

    @property
    def first_strict(self) -> bool:
        """Whether the first name is the true effect."""
        return self.named[:1] == self.truth[:1] and bool(self.truth)

    @property
    def first(self) -> bool:
        """Whether the first name is the true effect or one that says the same."""
        return bool(self.named) and self.named[0] in indistinguishable(self.answer.effects[0])

    @property
    def right(self) -> bool:
        """Whether the verdict as a whole is right: what the confidence speaks of."""
        said_nothing = self.verdict in NO_EFFECT
        if self.kind in ("none", "parameters"):
            return said_nothing
        if said_nothing:
            return self.relative < VISIBLE
        if self.kind == "outside":
            return self.abstains
        if self.kind == "nonstationary":
            return self.verdict == "nonstationary" or self.named == ("nonstationary",)
        if self.verdict == "ambiguous":
            return all(indistinguishable(e) & self.reported for e in self.answer.effects)
        if self.kind == "two":
            return self.matches == len(self.truth) == len(self.named)
        return self.first and len(self.named) == 1

    @property
    def matches(self) -> int:
        """How many true effects are among the named ones, each name counted once."""
        left, found = list(self.named), 0
        for effect in self.answer.effects:
            same = next((name for name in left if name in indistinguishable(effect)), None)
            if same is not None:
                left.remove(same)
                found += 1
        return found

    def deviations(self) -> tuple[list[float], list[float]]:
        """Return how far the truth lies from each value: bare parameters, effect parameters.

        In units of the way to the end of the interval on that side, which holds the truth up to 1.
        Only where the verdict is right, and only of parameters that mean the same in both plants.
        """
        if self.diagnosis is None or not self.right or self.abstains:
            return [], []
        seen = self.answer.plant_seen(self.named)
        bare = [self._deviation(name, value) for name, value in seen.items()]
        known = [
            self._deviation(name, value)
            for effect in self.answer.effects
            if effect.name in self.named
            for name, value in effect.catalogue.items()
        ]
        return [b for b in bare if b is not None], [k for k in known if k is not None]

    def _deviation(self, name: str, value: float) -> float | None:
        estimate = self.diagnosis.parameters.get(name) if self.diagnosis else None
        if estimate is None or not estimate.low < estimate.high:
            return None
        end = estimate.high if value > estimate.value else estimate.low
        off, reach = abs(value - estimate.value), abs(end - estimate.value)
        return off / reach if reach else math.inf if off else 0.0
