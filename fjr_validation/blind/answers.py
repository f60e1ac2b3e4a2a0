"""The truth of a case, which is sealed while methods look at its bags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

World = Literal["closed", "open", "records"]
WORLDS: tuple[World, ...] = ("closed", "open", "records")

Kind = Literal["none", "single", "two", "remainder", "outside"]
"""What a case holds: nothing, one dominant cause, two, only a remainder, or one cause that no
catalogue lists."""


@dataclass(frozen=True)
class Cause:
    """A true cause.

    Attributes:
        name: identifier of the catalogue, or a name of ours outside it.
        relative: how far it shows, over what its detection limit shows; see `visibility`.
        over_remainder: rms of the change that it makes beside all else, over that of the
            remainder, both after a linear refit; None without a remainder.
        over_remainder_direct: the same without a refit.
        share: rms of that change over the gap between the rig and its bare plant, after the refit.
        parameters: true values of the catalogue's parameters, as far as both plants mean the same.
    """

    name: str
    relative: float
    over_remainder: float | None
    over_remainder_direct: float | None
    share: float
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Answer:
    """The truth of a case.

    Attributes:
        world: closed, open or records.
        kind: what it holds.
        causes: the dominant ones; of `outside` the one that no catalogue lists.
        weak: effects of the catalogue within the remainder.
        laws: laws outside the catalogue within the remainder.
        plant: true values of the bare parameters (of friction: the mean over the runs).
        nominal: the datasheet.
        settings: of the second plant.
        noise_rad: standard deviation of the encoder's noise.
        scatter: standard deviation of friction from run to run, relative.
        remainder: its rms over that of the position, after a linear refit.
        excitation: multisine, chirp, noise, trapezoid or steps.
        controller_known: whether the bags describe the controller.
        facts: what was drawn besides, for whoever looks at a miss.
    """

    world: World
    kind: Kind
    causes: tuple[Cause, ...]
    weak: tuple[Cause, ...]
    laws: tuple[str, ...]
    plant: Mapping[str, float]
    nominal: Mapping[str, float]
    settings: Mapping[str, float]
    noise_rad: float
    scatter: float
    remainder: float
    excitation: str
    controller_known: bool
    facts: Mapping[str, float]

    def to_json(self) -> dict[str, Any]:
        """Return what is sealed; an infinite stiffness is written as a text."""
        return _texts(asdict(self))

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Answer:
        """Return the answer that was sealed."""
        plain = _numbers(dict(values))
        for name in ("causes", "weak"):
            plain[name] = tuple(Cause(**cause) for cause in plain[name])
        return cls(**{**plain, "laws": tuple(plain["laws"])})


def _texts(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _texts(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_texts(part) for part in value]
    return "inf" if value == float("inf") else value


def _numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _numbers(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_numbers(part) for part in value]
    return float("inf") if value == "inf" else value
