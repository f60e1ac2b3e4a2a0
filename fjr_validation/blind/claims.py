"""What a diagnosis claims: causes with how surely they are present, of any schema so far."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

NAMING = ("effect", "ambiguous", "partly_explained")

Interval = tuple[float, float, float]
"""Value, low end and high end."""


@dataclass(frozen=True)
class Claim:
    """One cause that a diagnosis lists, or one that it doubts.

    Attributes:
        effect: what it is called.
        names: that, and everything that the data cannot tell from it.
        present: how surely it is there.
        named: whether the verdict names it.
        parameters: intervals by full name, `effect.parameter`.
    """

    effect: str
    names: frozenset[str]
    present: float
    named: bool
    parameters: Mapping[str, Interval]


def claims(diagnosis: Mapping[str, Any]) -> tuple[Claim, ...]:
    """Return what a diagnosis claims, as it orders it, and then what it doubts.

    Where it lists no `causes` (schema 1), each named effect is one, as surely present as the
    verdict is right.
    """
    named = list(diagnosis.get("effects", ())) if diagnosis["verdict"] in NAMING else []
    estimates = diagnosis.get("parameters", {})
    causes = diagnosis.get("causes")
    if causes is None:
        return tuple(
            Claim(
                effect,
                frozenset((effect, *group)),
                float(diagnosis["confidence"]),
                True,
                _intervals(effect, estimates),
            )
            for effect, group in _with_sets(named, diagnosis.get("equivalent") or [])
        )
    doubted = (
        Claim(one["effect"], frozenset((one["effect"],)), float(one["present"]), False, {})
        for one in diagnosis.get("doubted", ())
    )
    listed = (
        Claim(
            cause["effect"],
            frozenset((cause["effect"], *(cause.get("or") or ()))),
            float(cause["present"]),
            cause["effect"] in named,
            _intervals(cause["effect"], estimates)
            | _intervals(cause["effect"], cause.get("parameters") or {}),
        )
        for cause in causes
    )
    return (*listed, *doubted)


def _with_sets(named: list[str], sets: list[list[str]]) -> list[tuple[str, list[str]]]:
    """Return each name with its set, whose order is that of the names."""
    return [(name, sets[i] if i < len(sets) else []) for i, name in enumerate(named)]


def _intervals(effect: str, estimates: Mapping[str, Any]) -> dict[str, Interval]:
    found: dict[str, Interval] = {}
    for name, estimate in estimates.items():
        full = name if "." in name else f"{effect}.{name}"
        if not full.startswith(f"{effect}.") or not isinstance(estimate, Mapping):
            continue
        value, low, high = (_finite(estimate.get(part)) for part in ("value", "low", "high"))
        if value is not None and low is not None and high is not None:
            found[full] = (value, low, high)
    return found


def _finite(number: Any) -> float | None:
    """Return a finite number; None for anything else, such as an end at infinity."""
    if isinstance(number, (int, float)) and math.isfinite(number):
        return float(number)
    return None
