"""Faults to rehearse, each described once, and the wire that has them.

A fault lies between the real-time drive and its topics: positions pass it on their way to the
publisher, torques on their way to the drive. It begins `after_s` after the first message and is
seeded: which messages it hits depends on the seed and on their stamps, never on the machine's load.
Written as KIND or KIND:NAME=VALUE,NAME=VALUE.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_interface.errors import InputError
from fjr_interface.parameter_file import parse_value
from fjr_interface.parameters import Parameter, ParameterGroup, Value
from fjr_interface.real_time import NEVER

from .real_time import PlainWire, Wire

CONTINUES = "continues"
NO_TORQUE = "no torque"
SAFE_STATES = {
    CONTINUES: "the loop goes on: torques keep coming, all of them finite and within the limits",
    NO_TORQUE: "every torque is zero, or none comes and the drive lets go",
}
"""The safe states in which a fault may end, in words."""

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
        parameters: its parameters.
        safe_state: a key of SAFE_STATES.
        within_s: the safe state holds from this long after the fault began; for CONTINUES the
            longest pause between two torques.
        finding: the check that must turn the verdict to NO-GO, empty if the loop may pass.
    """

    identifier: str
    summary: str
    acts_on: str
    parameters: ParameterGroup
    safe_state: str
    within_s: float
    finding: str


def _fault(identifier: str, summary: str, acts_on: str, *parameters: Parameter, **rest) -> Fault:
    return Fault(identifier, summary, acts_on, ParameterGroup(*parameters, _AFTER), **rest)


CATALOGUE: tuple[Fault, ...] = (
    _fault(
        "delay",
        "Positions come late by a constant time.",
        POSITION,
        Parameter("time_s", 5e-3, "s", "By how much", 0.0, 1.0),
        safe_state=CONTINUES,
        within_s=0.1,
        finding="delay_margin",
    ),
    _fault(
        "jitter",
        "Positions come late by a random time, in their order.",
        POSITION,
        Parameter("spread_s", 5e-3, "s", "Uniform from zero to this", 0.0, 1.0),
        safe_state=CONTINUES,
        within_s=0.1,
        finding="jitter",
    ),
    _fault(
        "loss",
        "Positions are lost.",
        POSITION,
        _SHARE,
        safe_state=CONTINUES,
        within_s=0.1,
        finding="lost",
    ),
    _fault(
        "reordering",
        "Positions come after the one that follows them.",
        POSITION,
        _SHARE,
        safe_state=CONTINUES,
        within_s=0.1,
        finding="unordered",
    ),
    _fault(
        "duplicated_stamps",
        "Positions come twice with the same stamp.",
        POSITION,
        _SHARE,
        safe_state=CONTINUES,
        within_s=0.1,
        finding="repeated",
    ),
    _fault(
        "encoder_dropout",
        "No position comes for a while.",
        POSITION,
        Parameter("for_s", 1.0, "s", "How long", 0.0, 1e6),
        safe_state=NO_TORQUE,
        within_s=0.2,
        finding="lost",
    ),
    _fault(
        "encoder_jump",
        "The position jumps, and stays there.",
        POSITION,
        Parameter("step_rad", 1.0, "rad", "By how much", -100.0, 100.0),
        safe_state=NO_TORQUE,
        within_s=0.2,
        finding="response",
    ),
    _fault(
        "nan",
        "The position is not a number.",
        POSITION,
        Parameter("samples", 1, "", "How many samples in a row", 1, 1_000_000),
        safe_state=NO_TORQUE,
        within_s=0.2,
        finding="not_finite",
    ),
    _fault(
        "drive_saturation",
        "The drive gives less torque than commanded.",
        TORQUE,
        Parameter("limit_nm", 8.0, "N m", "The most that it gives", 0.0, 1e6),
        safe_state=CONTINUES,
        within_s=0.1,
        finding="response",
    ),
    _fault(
        "drive_trip",
        "The drive gives no torque any more; its encoder still answers.",
        TORQUE,
        safe_state=CONTINUES,
        within_s=0.1,
        finding="response",
    ),
    _fault(
        "clock_jump",
        "The clock of the drive jumps: all stamps are off from then on.",
        POSITION,
        Parameter("step_s", 0.5, "s", "By how much", -1e4, 1e4),
        safe_state=NO_TORQUE,
        within_s=0.2,
        finding="clock_jumps",
    ),
    _fault(
        "node_killed",
        "The process of a node is killed, and started again later.",
        NODE,
        Parameter(
            "node", "controller", "", "Which one", choices=("controller", "excitation", "simulator")
        ),
        Parameter("restart_after_s", 1.0, "s", "Started again after; .inf: never", 0.0),
        safe_state=NO_TORQUE,
        within_s=0.2,
        finding="unanswered",
    ),
)
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


Messages = list[tuple[int, int, float]]
"""(due in ns, stamp in ns, value) of messages under way."""


class FaultyWire:
    """A wire with a fault; see `real_time.Wire`. Messages come out by their due time."""

    def __init__(self, plan: FaultPlan, seed: int) -> None:
        """Prepare a fault of positions or torques."""
        self.next_ns = NEVER
        self._plan = plan
        self._random = np.random.default_rng(seed)
        self._change: Callable[[Messages], Messages] = getattr(self, f"_{plan.fault.identifier}")
        self._first_ns: int | None = None
        self._last_due_ns = 0
        self._held: tuple[int, float] | None = None
        self._hit = 0
        self._messages: Messages = []

    def put(self, now_ns: int, stamp_ns: int, value: float) -> None:
        """Send a message in at this instant."""
        if self._first_ns is None:
            self._first_ns = stamp_ns
        message = (now_ns, stamp_ns, value)
        active = stamp_ns - self._first_ns >= self._plan.after_ns
        self._messages += self._change([message]) if active else [message]
        self._messages.sort(key=lambda each: each[0])
        self._schedule()

    def take(self, now_ns: int) -> Sequence[tuple[int, float]]:
        """Return (stamp, value) of what has come out by this instant, in its order."""
        out = [(stamp, value) for due, stamp, value in self._messages if due <= now_ns]
        self._messages = self._messages[len(out) :]
        self._schedule()
        return out

    def _schedule(self) -> None:
        self.next_ns = self._messages[0][0] if self._messages else NEVER

    def _hits(self) -> bool:
        return bool(self._random.random() < self._plan.number("share"))

    def _delay(self, messages: Messages) -> Messages:
        late_ns = round(self._plan.number("time_s") * 1e9)
        return [(due + late_ns, stamp, value) for due, stamp, value in messages]

    def _jitter(self, messages: Messages) -> Messages:
        ((now_ns, stamp, value),) = messages
        late_s = self._random.uniform(0.0, self._plan.number("spread_s"))
        self._last_due_ns = max(now_ns + round(late_s * 1e9), self._last_due_ns)
        return [(self._last_due_ns, stamp, value)]

    def _loss(self, messages: Messages) -> Messages:
        return [] if self._hits() else messages

    def _reordering(self, messages: Messages) -> Messages:
        ((now_ns, stamp, value),) = messages
        if self._held is not None:
            held, self._held = self._held, None
            return [*messages, (now_ns, *held)]
        if self._hits():
            self._held = (stamp, value)
            return []
        return messages

    def _duplicated_stamps(self, messages: Messages) -> Messages:
        return messages * 2 if self._hits() else messages

    def _encoder_dropout(self, messages: Messages) -> Messages:
        ((_, stamp, _),) = messages
        ends_ns = self._plan.after_ns + round(self._plan.number("for_s") * 1e9)
        return [] if stamp - (self._first_ns or 0) < ends_ns else messages

    def _encoder_jump(self, messages: Messages) -> Messages:
        step_rad = self._plan.number("step_rad")
        return [(due, stamp, value + step_rad) for due, stamp, value in messages]

    def _nan(self, messages: Messages) -> Messages:
        self._hit += 1
        if self._hit > self._plan.number("samples"):
            return messages
        return [(due, stamp, math.nan) for due, stamp, _ in messages]

    def _drive_saturation(self, messages: Messages) -> Messages:
        limit = self._plan.number("limit_nm")
        return [(due, stamp, min(max(value, -limit), limit)) for due, stamp, value in messages]

    def _drive_trip(self, messages: Messages) -> Messages:
        return [(due, stamp, 0.0) for due, stamp, _ in messages]

    def _clock_jump(self, messages: Messages) -> Messages:
        step_ns = round(self._plan.number("step_s") * 1e9)
        return [(due, max(stamp + step_ns, 1), value) for due, stamp, value in messages]


def wires(plan: FaultPlan | None, seed: int) -> tuple[Wire, Wire]:
    """Return the wires of torques to the drive and of positions from it, with a fault on one."""
    torques: Wire = PlainWire()
    positions: Wire = PlainWire()
    if plan is not None and plan.fault.acts_on == TORQUE:
        torques = FaultyWire(plan, seed)
    elif plan is not None and plan.fault.acts_on == POSITION:
        positions = FaultyWire(plan, seed)
    return torques, positions


def as_text(plan: FaultPlan) -> str:
    """Return the text that `FaultPlan.parse` reads back, every parameter written out."""
    values = ",".join(f"{name}={_text(value)}" for name, value in plan.values.items())
    return f"{plan.fault.identifier}:{values}"


def _text(value: Value) -> str:
    return ".inf" if value == math.inf else str(value)
