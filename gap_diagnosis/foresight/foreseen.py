"""What a diagnosis could show: `plan.json`, schema fjr_rig/plan/1."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fjr_kit.result_types import Document, Number, OptionalNumber, ResultModel, Unit

Known = Literal["alone", "in combination", "no"]


class ForeseenParameter(ResultModel):
    """A parameter of the bare plant.

    Attributes:
        name: of the parameter.
        unit: its unit.
        nominal: its value.
        error_percent: expected standard error with all others free; None where nothing shows it.
        others_known_percent: the same if all others were known.
        identifiable: alone, if the first is below the tolerance of the datasheet; in combination,
            if only the second is; else no.
        tied_to: parameters with which it trades, where it is identifiable in combination only.
    """

    name: str
    unit: str
    nominal: Number
    error_percent: Annotated[OptionalNumber, Unit("%")]
    others_known_percent: Annotated[OptionalNumber, Unit("%")]
    identifiable: Known
    tied_to: list[str] = Field(default_factory=list)


class ForeseenEffect(ResultModel):
    """An effect of the catalogue.

    Attributes:
        effect: identifier.
        parameter: its leading parameter, by its full name.
        unit: of that.
        limit: detection limit of the leading parameter: the least size that would be named, or
            the greatest limit of a drive, in its most visible shape; None if none shows.
        limit_worst: the same in its least visible shape; None if that does not show.
        shape: the other parameters of the effect at `limit`, by full name, in their units.
        level: at which level it shows best.
        not_told_from: effects that leave less than half of it up to twice the limit.
        why_not: why there is no limit, a sentence; empty if there is one.
    """

    effect: str
    parameter: str
    unit: str
    limit: OptionalNumber = None
    limit_worst: OptionalNumber = None
    shape: dict[str, Number] = Field(default_factory=dict)
    level: str = ""
    not_told_from: list[str] = Field(default_factory=list)
    why_not: str = ""


class Foresight(Document):
    """What a diagnosis could show of a rig by an experiment, recorded or planned.

    Attributes:
        source: the folder of bags, or the name of the plan.
        kind: steady periods, or records.
        levels: names of the excitation levels.
        tolerance: how far a datasheet value may be off, relative.
        parameters: of the bare plant.
        effects: of the catalogue, those that would show first.
        notes: sentences that a reader must see.
    """

    schema_name: Literal["fjr_rig/plan/1"] = Field("fjr_rig/plan/1", alias="schema")
    source: str
    kind: Literal["periodic", "records"]
    levels: list[str]
    tolerance: float
    parameters: list[ForeseenParameter]
    effects: list[ForeseenEffect]
    notes: list[str] = Field(default_factory=list)
