"""The outcome of a comparison: `compare.json`, schema fjr_rig/compare/1."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from fjr_kit.result_types import (
    Array,
    Document,
    EqualArrays,
    Number,
    OptionalNumber,
    ResultModel,
    Unit,
)
from gap_diagnosis.outcome.gap_size import Estimate, Gap

Kind = Literal["campaigns", "diagnoses"]
PowerKind = Literal["total", "odd", "even", "noise"]


class Tested(ResultModel):
    """A difference that is one of the tests of a comparison."""

    p_value: Annotated[
        OptionalNumber,
        Field(description="How often chance alone gives so great a change; None where not known."),
    ]
    p_adjusted: Annotated[
        OptionalNumber,
        Field(description="The same, by Holm over all tests of the comparison."),
    ] = None
    changed: Annotated[bool, Field(description="Whether it changed.")] = False


class BlaDifference(EqualArrays):
    """Two BLAs at the F lines that both have reliably.

    Attributes:
        frequency_hz: (F,).
        g_first, g_other: complex (F,), rad/(N m).
        radius_95: (F,), radius of the disc in which the difference of two BLAs of one rig lies in
            95 % of cases, line by line.
        p_value: (F,), how often chance alone gives so great a difference at the line.
        changed: bool (F,), lines that differ by themselves, by Holm over the lines of a level that
            changed.
    """

    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    g_first: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    g_other: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    radius_95: Annotated[np.ndarray, Array("rad/(N m)")]
    p_value: Annotated[np.ndarray, Array("1")]
    changed: Annotated[np.ndarray, Array("bool", bool)]


class PowerDifference(Tested):
    """The mean power of distortion or noise in the position, at lines that both have.

    It is tested with enough lines, distortion where the excited lines are the same; it changed if
    it did so beyond chance and by 1 dB or more.

    Attributes:
        kind: total: distortion and noise at excited lines; odd, even: at detection lines; noise.
        first_db, other_db: mean of the lines' levels.
        change_db: other minus first.
        lines: how many lines are shared.
    """

    kind: PowerKind
    first_db: Annotated[Number, Unit("dB re 1 rad")]
    other_db: Annotated[Number, Unit("dB re 1 rad")]
    change_db: Annotated[Number, Unit("dB")]
    lines: int


class LevelDifference(Tested):
    """One amplitude in both campaigns; it is tested where the excited lines are the same.

    Attributes:
        name: of the level, in the first campaign.
        bla: the BLAs and their difference.
        change_percent: rms over lines of the change over |G|, less what chance alone gives.
        worst_hz: where the difference is greatest beside its disc.
        p_lines: of the most different line, corrected for the number of lines (Holm).
        p_all: of all lines together (Fisher); the smaller of both, doubled, is `p_value`.
        powers: distortion and noise.
    """

    name: str
    bla: BlaDifference
    change_percent: Annotated[Number, Unit("%")]
    worst_hz: Annotated[Number, Unit("Hz")]
    p_lines: Number
    p_all: Number
    powers: list[PowerDifference] = Field(default_factory=list)


class ParameterDifference(Tested):
    """One parameter in both diagnoses; it is tested where both intervals are known.

    Attributes:
        name: of the parameter; its unit is that of the simulator's parameter.
        unit: that unit.
        first, other: its values with their intervals.
        scatter_percent: standard deviation between runs, where a diagnosis states one, the greater
            of both.
        change_percent: other over first, less one; None where the first is zero.
        low, high: 95 % interval of the change, other minus first, scatter included.
    """

    name: str
    unit: str
    first: Estimate
    other: Estimate
    scatter_percent: Annotated[OptionalNumber, Unit("%")]
    change_percent: Annotated[OptionalNumber, Unit("%")]
    low: Number
    high: Number


class CauseDifference(ResultModel):
    """A cause that one or both diagnoses name.

    Attributes:
        effects: the effect, and those that its diagnosis cannot tell from it.
        first, other: probability that it is there; None where the diagnosis does not name it.
        changed: whether one names it with 95 % or more and the other, which could have, does not.
    """

    effects: list[str]
    first: OptionalNumber
    other: OptionalNumber
    changed: bool


class Pair(ResultModel):
    """One input beside the first one.

    Attributes:
        other: its name.
        levels: campaigns: the shared levels.
        parameters, causes: diagnoses: the shared parameters, and all causes.
        gap_first, gap_other: diagnoses: the gap of nominal and of updated simulation.
        notes: sentences that a reader must see.
    """

    other: str
    levels: list[LevelDifference] = Field(default_factory=list)
    parameters: list[ParameterDifference] = Field(default_factory=list)
    causes: list[CauseDifference] = Field(default_factory=list)
    gap_first: list[Gap] = Field(default_factory=list)
    gap_other: list[Gap] = Field(default_factory=list)
    notes: list[str] = Field(default_factory=list)


class Comparison(Document):
    """Campaigns or diagnoses side by side, each beside the first.

    Attributes:
        kind: what was compared.
        first: name of the first input.
        false_alarm: how often a comparison of what is the same may say that something changed.
        tests: how many tests share that rate.
        changed: whether anything changed.
        changes: what, a sentence each.
        pairs: one for each further input.
    """

    schema_name: Literal["fjr_rig/compare/1"] = Field("fjr_rig/compare/1", alias="schema")
    kind: Kind
    first: str
    false_alarm: float
    tests: int
    changed: bool
    changes: list[str] = Field(default_factory=list)
    pairs: list[Pair] = Field(default_factory=list)
