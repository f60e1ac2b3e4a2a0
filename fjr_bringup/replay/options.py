"""What the options of `fjr replay` ask for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fjr_interface.errors import InputError

MAX = "max"
"""Names the rate that only the readers limit."""


@dataclass(frozen=True)
class Publishing:
    """How a bag is published.

    Attributes:
        rate: times real time; infinite: as fast as the readers take it.
        topics: the topics to publish, by their last words; empty for all.
        start_offset_s: how far into the bag it begins (s).
        loop: whether it begins again at the end.
        wait_for: nodes that must read one of the topics before it begins.
    """

    rate: float = 1.0
    topics: tuple[str, ...] = ()
    start_offset_s: float = 0.0
    loop: bool = False
    wait_for: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        rate: str | None,
        topics: Sequence[str] | None,
        start_offset_s: float | None,
        loop: bool,
        wait_for: Sequence[str] | None,
    ) -> Publishing:
        """Return what the options ask for; raise InputError for a rate that is none."""
        return cls(
            1.0 if rate is None else _rate(rate),
            tuple(topics or ()),
            start_offset_s or 0.0,
            loop,
            tuple(wait_for or ()),
        )


def _rate(text: str) -> float:
    if text == MAX:
        return math.inf
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not 0.0 < rate < math.inf:
        raise InputError(f"--rate {text}: give a factor greater than zero, or {MAX}.")
    return rate


@dataclass(frozen=True)
class IntoGraph:
    """What a bag is played into, and how: see `plan.plan_replay`.

    Attributes:
        into: what; None to publish only.
        rig: simulated rig.
        settings: `node.parameter=value`.
        out: folder of the results.
    """

    into: str | None = None
    rig: str | None = None
    settings: tuple[str, ...] = ()
    out: Path | None = None
