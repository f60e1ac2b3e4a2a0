"""One verdict beside the truth: what was right, what was named, what the intervals covered."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .answers import Answer, Cause
from .claims import Claim, claims

CLEAR = 3.0
"""How many times its detection limit, or the remainder, a cause must show to be asked for."""
CONFIDENT = 0.8
"""From here on a claim that something is present counts as said for sure."""

_CONSTANT_TORQUE = frozenset(("torque_bias", "asymmetric_friction", "gravity"))
_BRINGS = {"backlash": frozenset(("transmission_damping",))}
"""What else of the catalogue a law of the second plant holds: its shaft behind a gap is damped."""
_LEVEL = 0.95  # |sine| of an angle above which gravity hardly changes around it
_ANGLES = ("phase_rad", "angle_rad")


def indistinguishable(cause: Cause, *, rigid: bool) -> frozenset[str]:
    """Return the names that say the same as the true one: equivalences known beforehand.

    A constant torque is asymmetric Coulomb friction while sliding, or gravity at right angles;
    backlash lies within a piecewise stiffness, presliding within LuGre friction; gravity on a rigid
    axis is cogging of one cycle.
    """
    names = {cause.name}
    angle = cause.parameters.get("gravity.angle_rad")
    level = angle is not None and abs(math.sin(angle)) > _LEVEL
    coulomb = "asymmetric_friction.coulomb_nm" in cause.parameters
    if cause.name == "torque_bias" or coulomb or level:
        names |= _CONSTANT_TORQUE
    if cause.name == "backlash":
        names.add("piecewise_stiffness")
    if cause.name == "presliding_friction":
        names.add("lugre_friction")
    if cause.name == "gravity" and rigid:
        names.add("cogging")
    return frozenset(names)


@dataclass(frozen=True)
class Outcome:
    """A method's verdict on a case beside its answer.

    Attributes:
        case: name of the case.
        method: name of the method.
        answer: the truth.
        verdict: what was said; `failed` if nothing.
        claims: causes that were listed.
        error: why it failed.
        seconds: what it took.
    """

    case: str
    method: str
    answer: Answer
    verdict: str
    claims: tuple[Claim, ...]
    error: str
    seconds: float

    @classmethod
    def of(cls, answer: Answer, line: Mapping[str, Any]) -> Outcome:
        """Return the outcome of a line of the raw verdicts."""
        said = line.get("diagnosis")
        return cls(
            line["case"],
            line["method"],
            answer,
            said["verdict"] if said else "failed",
            claims(said) if said else (),
            line.get("error", ""),
            float(line["seconds"]),
        )

    @property
    def failed(self) -> bool:
        """Whether the method gave no verdict."""
        return self.verdict == "failed"

    @property
    def named(self) -> tuple[Claim, ...]:
        """The causes that the verdict names."""
        return tuple(claim for claim in self.claims if claim.named)

    @property
    def asked(self) -> tuple[Cause, ...]:
        """True dominant causes that the catalogue lists."""
        return () if self.answer.kind == "outside" else self.answer.causes

    @property
    def clear(self) -> bool:
        """Whether every dominant cause shows well enough to be asked for."""
        closed = self.answer.world == "closed"
        shown = [c.relative if closed else (c.over_remainder or 0.0) for c in self.asked]
        return bool(shown) and min(shown) >= CLEAR

    def same(self, cause: Cause) -> frozenset[str]:
        """Return the names that say the same as a true cause."""
        return indistinguishable(cause, rigid=math.isinf(self.answer.plant["k0"]))

    def is_right(self, claim: Claim) -> bool:
        """Tell whether a claim's set holds something that is there, weak as it may be."""
        there = (*self.asked, *self.answer.weak)
        names = [self.same(cause) | _BRINGS.get(cause.name, frozenset()) for cause in there]
        return any(claim.names & each for each in names)

    @property
    def wrong_names(self) -> tuple[Claim, ...]:
        """Claims of something that is not there, for sure."""
        return tuple(c for c in self.claims if c.present >= CONFIDENT and not self.is_right(c))

    def found(self, cause: Cause) -> bool:
        """Tell whether a true cause is named or in the set of one that is."""
        if cause.name == self.verdict == "nonstationary":
            return True
        return any(claim.names & self.same(cause) for claim in self.named)

    @property
    def matches(self) -> int:
        """How many dominant causes are among the names, each name counted once."""
        left, found = list(self.named), 0
        for cause in self.asked:
            same = next((claim for claim in left if claim.names & self.same(cause)), None)
            if same is not None:
                left.remove(same)
                found += 1
        return found

    @property
    def said(self) -> int:
        """How many causes are named, true weak ones of the remainder left out."""
        beside = [
            claim
            for claim in self.named
            if not any(claim.names & self.same(cause) for cause in self.asked)
            and self.is_right(claim)
        ]
        return len(self.named) - len(beside)

    @property
    def right(self) -> bool:
        """Whether exactly the dominant causes are named, and nothing that is not there."""
        if self.failed:
            return False
        if self.asked and all(self.found(cause) for cause in self.asked):
            return self.matches == self.said or self.verdict == "nonstationary"
        return not self.asked and self.said == 0

    def covered(self) -> list[bool]:
        """Tell of each parameter of rightly named causes whether its interval holds the truth.

        Only of parameters that mean the same in both plants; angles are compared modulo a turn.
        """
        found = []
        for cause in self.asked:
            for claim in self.named:
                if claim.effect != cause.name:
                    continue
                for name, truth in cause.parameters.items():
                    if name in claim.parameters:
                        found.append(_holds(claim.parameters[name], truth, name))
        return found


def _holds(interval: tuple[float, float, float], truth: float, name: str) -> bool:
    _, low, high = interval
    turns = (-1, 0, 1) if name.endswith(_ANGLES) else (0,)
    return any(low <= truth + turn * 2.0 * math.pi <= high for turn in turns)
