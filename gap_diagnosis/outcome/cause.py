"""A cause of the gap: how surely it is there, how much it closes and where it shows."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fjr_kit.result_types import Number, OptionalNumber, ResultModel, Unit

from .gap_size import Estimate, Figure

LEAST_PRESENT = 0.5
"""A cause that is there less often than not is not called present."""

LineKind = Literal["excited", "odd", "even", "dc", "slow", "all"]


class Place(ResultModel):
    """Where the gap lies: a band of one level, one kind of line, one signal.

    Records that are not periodic have no kinds of line but `slow` (mean and slow motion) and `all`.
    Sigma is the rms error over the standard deviation of the noise; NaN where noise is not known.
    """

    level: int
    band_hz: Annotated[tuple[float, float], Unit("Hz")]
    lines: LineKind
    signal: Literal["position", "torque", "twist"]
    sigma: Number


MOST_SHARE = 10.0
"""How far a model runs away without a cause says nothing: its share counts as that at the most."""


class Cause(ResultModel):
    """An unmodelled effect that is present.

    Attributes:
        effect: its identifier.
        others: effects that these data cannot tell from it.
        present: probability that it, or one of the others, is there.
        share: how much of the squared gap that the refit left comes back if the cause is left out
            and all else is fitted anew; at most `MOST_SHARE`, where the model then runs away.
        invariance_p: how often chance alone makes its sizes differ so much between levels; None
            where there is one level only.
        where: where leaving it out shows most.
        parameters: its parameters.
    """

    effect: str
    others: list[str] = Field(default_factory=list, alias="or")
    present: float = Field(ge=0.0, le=1.0)
    share: Figure | None = None
    invariance_p: OptionalNumber = None
    where: list[Place] = Field(default_factory=list)
    parameters: dict[str, Estimate] = Field(default_factory=dict)


class Doubted(ResultModel):
    """An effect that the search added and its tests took out again.

    Attributes:
        effect: its identifier.
        present: probability that it is there nevertheless: up to one half, and more where only two
            causes that gain more keep it from being named.
    """

    effect: str
    present: float = Field(ge=0.0, le=1.0)
