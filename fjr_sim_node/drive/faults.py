"""Faults to rehearse, each described once; `faulty_wire` has them.

A fault begins `after_s` after the first message and is seeded. It is written as KIND or
KIND:NAME=VALUE,NAME=VALUE.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from fjr_interface.parameter_file import parse_value
from fjr_interface.parameters import Parameter, ParameterGroup, Value
from fjr_kit.errors import InputError

CONTINUES = "continues"
NO_TORQUE = "no torque"
SAFE_STATES = {
    CONTINUES: "the loop goes on: torques keep coming, all of them finite and within the limits",
    NO_TORQUE: "every torque is zero, or none comes and the drive lets go",
}
"""The safe states in which a fault may end, in words."""
WITHIN_S = {CONTINUES: 0.1, NO_TORQUE: 0.2}
"""No torque: from this long after the fault began; continues: the longest pause of the torques."""

POSITION, TORQUE, NODE = "position", "torque", "node"
"""Where a fault acts: on positions, on torques, or on the process of a node."""

_AFTER = Parameter("after_s", 1.0, "s", "Begins this long after the first message", 0.0, 1e6)
_SHARE = Parameter("share", 0.01, "", "Share of the positions that it hits", 0.0, 1.0)


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        identifier: its fixed name.
        summary: what happens, one sentence.
        acts_on: POSITION, TORQUE or NODE.
        safe_state: a key of SAFE_STATES.
        finding: the check that must turn the verdict to NO-GO, empty if the loop may pass.
        parameters: its parameters.
    """

    identifier: str
    summary: str
    acts_on: str
    safe_state: str
    finding: str
    parameters: ParameterGroup

    @property
    def within_s(self) -> float:
        """When its safe state must hold, see WITHIN_S."""
        return WITHIN_S[self.safe_state]


def _fault(
    identifier: str, summary: str, acts_on: str, ends: str, finding: str, *parameters: Parameter
) -> Fault:
    group = ParameterGroup(*parameters, _AFTER)
    return Fault(identifier, summary, acts_on, ends, finding, group)


CATALOGUE: tuple[Fault, ...] = (
    _fault(
        "delay", "Positions come late by a constant time.", POSITION, CONTINUES, "delay_margin",
        Parameter("time_s", 5e-3, "s", "By how much", 0.0, 1.0),
    ),
    _fault(
        "jitter", "Positions come late by a random time, in their order.", POSITION, CONTINUES,
        "jitter", Parameter("spread_s", 5e-3, "s", "Uniform from zero to this", 0.0, 1.0),
    ),
    _fault("loss", "Positions are lost.", POSITION, CONTINUES, "lost", _SHARE),
    _fault(
        "reordering", "Positions come after the one that follows them.", POSITION, CONTINUES,
        "unordered", _SHARE,
    ),
    _fault(
        "duplicated_stamps", "Positions come twice with the same stamp.", POSITION, CONTINUES,
        "repeated", _SHARE,
    ),
    _fault(
        "encoder_dropout", "No position comes for a while.", POSITION, NO_TORQUE, "lost",
        Parameter("for_s", 1.0, "s", "How long", 0.0, 1e6),
    ),
    _fault(
        "encoder_jump", "The position jumps, and stays there.", POSITION, NO_TORQUE, "response",
        Parameter("step_rad", 1.0, "rad", "By how much", -100.0, 100.0),
    ),
    _fault(
        "nan", "The position is not a number.", POSITION, NO_TORQUE, "not_finite",
        Parameter("samples", 1, "", "How many samples in a row", 1, 1_000_000),
    ),
    _fault(
        "drive_saturation", "The drive gives less torque than commanded.", TORQUE, CONTINUES,
        "response", Parameter("limit_nm", 8.0, "N m", "The most that it gives", 0.0, 1e6),
    ),
    _fault(
        "drive_trip", "The drive gives no torque any more; its encoder still answers.", TORQUE,
        CONTINUES, "response",
    ),
    _fault(
        "clock_jump", "The clock of the drive jumps: all stamps are off from then on.", POSITION,
        NO_TORQUE, "clock_jumps", Parameter("step_s", 0.5, "s", "By how much", -1e4, 1e4),
    ),
    _fault(
        "node_killed", "The process of a node is killed, and started again later.", NODE,
        NO_TORQUE, "unanswered",
        Parameter("node", "controller", "", "Which one",
                  choices=("controller", "excitation", "simulator")),
        Parameter("restart_after_s", 1.0, "s", "Started again after; .inf: never", 0.0),
    ),
)  # fmt: skip
"""All faults."""

FAULTS: dict[str, Fault] = {fault.identifier: fault for fault in CATALOGUE}

NO_FAULT = ""

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "fault",
        NO_FAULT,
        "",
        "Real time only: fault to rehearse, KIND or KIND:NAME=VALUE,...; empty for none",
    ),
    Parameter("fault_seed", 1, "", "Seed of the fault", 0, 2**31 - 1),
)
"""Parameters of the simulator node."""


@dataclass(frozen=True)
class FaultPlan:
    """A fault with its parameters.

    Attributes:
        fault: which.
        values: its checked parameters.
    """

    fault: Fault
    values: Mapping[str, Value]

    @classmethod
    def parse(cls, text: str) -> FaultPlan | None:
        """Parse KIND or KIND:NAME=VALUE,...; an empty text is no fault.

        Raises:
            InputError: an unknown kind or name, or a bad value.
        """
        if text == NO_FAULT:
            return None
        kind, _, settings = text.partition(":")
        if kind not in FAULTS:
            raise InputError(f"There is no fault {kind!r}; known are {', '.join(FAULTS)}.")
        given = {}
        for setting in filter(None, settings.split(",")):
            name, equals, value = setting.partition("=")
            if not equals:
                raise InputError(f"Fault {text}: write {kind}:NAME=VALUE, not {setting!r}.")
            given[name.strip()] = parse_value(value, f"fault {text}: {name}")
        fault = FAULTS[kind]
        return cls(fault, fault.parameters.check(given, f"fault {kind}"))

    def number(self, name: str) -> float:
        """Return a parameter that is a number."""
        return float(self.values[name])  # type: ignore[arg-type]

    @property
    def after_ns(self) -> int:
        """When it begins, in ns after the first message."""
        return round(self.number("after_s") * 1e9)


def as_text(plan: FaultPlan) -> str:
    """Return the text that `FaultPlan.parse` reads back, every parameter written out."""
    values = ",".join(f"{name}={_text(value)}" for name, value in plan.values.items())
    return f"{plan.fault.identifier}:{values}"


def _text(value: Value) -> str:
    return ".inf" if value == math.inf else str(value)
