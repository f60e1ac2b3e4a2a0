"""The controller in real time: every position is answered at once, whatever is missing.

What is missing for too long trips: the watchdogs of position and reference. Without positions the
controller takes the torque to zero by its own clock. Instants are integer nanoseconds of one steady
clock; the caller says what time it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fjr_interface.real_time import NEVER
from fjr_interface.topics import stamp_ns

from .guarded import GuardedLaw

Answers = list[tuple[int, float]]
"""Torques to publish: (stamp in ns, torque in N m)."""

_FIRST = 10  # a run may begin with any of the first samples: the very first may be lost


class RealTimeController:
    """Pairs positions and references where nobody waits; one realization after the other.

    Attributes:
        due_ns: when `serve` wants to be called, if no position comes before.
        answered: positions answered with a torque.
        missing: those of them whose reference was not there; an older one was used.
        lost: positions that never came, by their stamps.
        stale: positions that came again or behind a newer one; they get no answer.
        strange: whether a run is under way that began before this controller was there.
    """

    def __init__(self, law: GuardedLaw, values: Mapping[str, Any]) -> None:
        """Wait for a run of this law, with checked values of CONTROLLER and SAFETY."""
        self._law = law
        self._values = values
        self._references: dict[int, float] = {}
        self._end: int | None = None
        self._sample: int | None = None  # the newest that was answered; None before the first run
        self._left = True
        self._pacing = False
        self._heard_ns = 0
        self.strange = False
        self._take_values()

    def _take_values(self) -> None:
        values = self._values
        self._rate = values["sample_rate_hz"]
        self._period_ns = 1e9 / self._rate
        timeout_s = values["position_timeout_s"]
        self._timeout_ns = NEVER if math.isinf(timeout_s) else round(timeout_s * 1e9)
        self._reference_timeout_s = values["reference_timeout_s"]
        self._reference: float | None = None
        self._unreferenced = 0
        self.due_ns = NEVER
        self.answered = self.missing = self.lost = self.stale = 0

    def leave_run(self, values: Mapping[str, Any]) -> None:
        """Take the torque of the run under way to zero; forget its references.

        Args:
            values: checked values for the next run.
        """
        self._values = values
        self._references.clear()
        self._end = None
        self._left = True
        self.strange = False
        self._law.fall()

    def reference(self, stamp: int, value: float) -> None:
        """Keep a reference for the position of the same stamp (ns)."""
        self._references[stamp] = value

    def end(self, samples: int) -> None:
        """Take the torque to zero after this many samples: the run is described, and so its end."""
        self._end = samples

    def position(self, now_ns: int, stamp: int, value: float) -> Answers:
        """Return the torque that answers a position.

        None answers a position that came before, one behind a newer one, and one of a run under way
        that the controller has not begun.
        """
        sample = round(stamp / self._period_ns)
        newest = self._sample
        if sample <= _FIRST and (self._left or newest is None or newest - sample > _FIRST):
            self._begin(now_ns)
        elif newest is None:
            self.strange = True
            return []
        if sample <= self._sample:
            self.stale += 1
            return []
        if now_ns >= self.due_ns:
            self._miss_position()
        samples, self._sample = sample - self._sample, sample
        jump_ns = (samples - 1) * self._period_ns - (now_ns - self._heard_ns)
        if jump_ns > self._timeout_ns:
            self._law.trip(f"the stamps jumped by {jump_ns * 1e-9:.3g} s")
        self._pacing, self._heard_ns = False, now_ns
        torque = self._answer(stamp, value, samples)
        self.answered += 1
        if self._end is not None and sample >= self._end and not self._left:
            self._law.fall()
        self.due_ns = now_ns + self._timeout_ns if self._watched else NEVER
        return [(stamp, torque)]

    def _begin(self, now_ns: int) -> None:
        self._take_values()
        self._heard_ns = now_ns
        self._law.begin_run(self._values)
        self._sample, self._left, self._pacing, self.strange = 0, False, False, False

    def _answer(self, stamp: int, value: float, samples: int) -> float:
        self.lost += samples - 1
        reference = self._references.pop(stamp, None)
        if reference is None and not self._law.safety.held:
            self.missing += 1
            self._unreferenced += samples
            if self._unreferenced > self._reference_timeout_s * self._rate:
                self._law.trip(f"no reference for {self._reference_timeout_s:g} s")
        elif reference is not None:
            self._unreferenced = 0
        if reference is None:
            reference = value if self._reference is None else self._reference
        self._reference = reference
        return self._law.torque(reference, value, samples)

    @property
    def _watched(self) -> bool:
        """Whether a position that does not come must take the torque to zero.

        A simulated drive stops with its last sample; a real one may hold the last torque.
        """
        ended = self._end is not None and self._sample is not None and self._sample >= self._end
        if ended and not self._values["hardware"]:
            return False
        return self._sample is not None and not self._law.safety.resting

    def trip(self, now_ns: int, reason: str, *, at_once: bool = False) -> Answers:
        """Take the torque to zero and hold it there; return what is to be said now."""
        self._law.trip(reason, at_once=at_once)
        if not at_once or not self._watched:
            return []
        self._pacing, self.due_ns = True, now_ns
        return self.serve(now_ns)

    def release(self, now_ns: int) -> bool:
        """Let the torque rise again; return False if nothing has tripped."""
        released = self._law.safety.release()
        self._unreferenced = 0
        if released and self._watched:
            self.due_ns = now_ns + self._timeout_ns
        return released

    def serve(self, now_ns: int) -> Answers:
        """Watch the positions; return the torques due when none comes, on their way to zero."""
        answers: Answers = []
        if now_ns < self.due_ns or self._sample is None:
            return answers
        if not self._pacing:
            self._miss_position()
            self._pacing = True
        while self.due_ns <= now_ns:
            self._sample += 1
            answers.append((stamp_ns(self._sample, self._rate), self._law.rest()))
            self.due_ns = self.due_ns + round(self._period_ns) if self._watched else NEVER
        return answers

    def _miss_position(self) -> None:
        if not self._law.safety.held:
            self._law.trip(f"no position for {self._timeout_ns * 1e-9:g} s")

    def fall(self, now_ns: int) -> None:
        """Take the torque to zero by the own clock from now on: the controller ends."""
        self._law.fall()
        self._pacing, self.due_ns = True, now_ns if self._watched else NEVER
