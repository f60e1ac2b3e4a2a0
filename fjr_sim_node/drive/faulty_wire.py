"""The wire with a fault, between the real-time drive and its topics.

Positions pass it on their way to the publisher, torques on their way to the drive. Which messages a
fault hits depends on its seed and on their stamps, never on the machine's load.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from fjr_interface.real_time import NEVER

from .faults import POSITION, TORQUE, FaultPlan
from .real_time import PlainWire, Wire

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
