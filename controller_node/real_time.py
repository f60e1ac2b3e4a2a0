"""The controller in real time: every position is answered at once, whatever is missing.

What is missing for too long trips: the watchdogs of position and reference. So do stamps that run
ahead of the clock. Without positions the controller takes the torque to zero by its own clock.
Instants are integer nanoseconds of one steady clock; the
caller says what time it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fjr_interface.real_time import NEVER
from fjr_interface.topics import SIGNAL_DEPTH, stamp_ns

from .pace import Pace
from .safety import Elapsed
from .supervised_law import SupervisedLaw

Answers = list[tuple[int, float]]
"""Torques to publish: (stamp in ns, torque in N m)."""

_FIRST = 10  # a run may begin with any of the first samples: the very first may be lost
_LAST_NS = (2**31 - 2**20) * 10**9  # what a stamp can hold, less what is said without positions
_ROUNDED_UP = 1.0 + 1e-9  # so that a sum of periods reaches a timeout when their number does
_MOST_REFERENCES = 2 * SIGNAL_DEPTH


class RealTimeController:
    """Pairs positions and references where nobody waits; one realization after the other.

    Attributes:
        due_ns: when `serve` wants to be called, if no position comes before.
        answered: positions answered with a torque.
        missing: those of them whose reference was not there; an older one was used.
        lost: positions that never came, by their stamps.
        stale: positions that came again, behind a newer one, or ahead of the clock; they get no
            answer.
        strange: whether a run is under way that began before this controller was there.
    """

    def __init__(self, law: SupervisedLaw, values: Mapping[str, Any]) -> None:
        """Wait for a run of this law, with checked values of CONTROLLER and SAFETY."""
        self._law = law
        self._values = values
        self._references: dict[int, float] = {}
        self._end: int | None = None
        self._sample: int | None = None  # the newest that was answered; None before the first run
        self._left = True
        self._pacing = False
        self._pace = Pace()
        self._heard: tuple[int, int] | None = None  # instant and sample of the last position
        self._said_ns: int | None = None  # instant of the last torque
        self._ahead: int | None = None  # sample of a position that was refused: the next may agree
        self.strange = False
        self._take_values()

    def _take_values(self) -> None:
        values = self._values
        self._rate = values["sample_rate_hz"]
        self._period_ns = 1e9 / self._rate
        timeout_s = values["position_timeout_s"]
        self._timeout_s = timeout_s
        self._timeout_ns = NEVER if math.isinf(timeout_s) else round(timeout_s * 1e9)
        self._reference_timeout_s = values["reference_timeout_s"]
        self._reference: float | None = None
        self._unreferenced_s = self._reference_age_s = 0.0
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
        if len(self._references) > _MOST_REFERENCES:
            del self._references[next(iter(self._references))]

    def end(self, samples: int) -> None:
        """Take the torque to zero after this many samples: the run is described, and so its end."""
        self._end = samples

    def position(self, now_ns: int, stamp: int, value: float) -> Answers:
        """Return the torque that answers a position.

        None answers a position that came before, one behind a newer one, one that is ahead of the
        clock, and one of a run under way that the controller has not begun.
        """
        sample = round(stamp / self._period_ns)
        newest = self._sample
        if sample < 1 or stamp > _LAST_NS:
            self.stale += 1
            return []
        begins = sample <= _FIRST and (self._left or newest is None or newest - sample > _FIRST)
        if begins:
            self._begin()
        elif newest is None:
            self.strange = True
            return []
        if sample <= self._sample:
            self.stale += 1
            return []
        if now_ns >= self.due_ns:
            self._miss_position()
        clock_s = self._since(self._heard and self._heard[0], now_ns)
        if not begins and not self._follows(sample, clock_s):
            return self._refuse(now_ns, sample, clock_s)
        return [(stamp, self._take(now_ns, stamp, sample, value, clock_s, begins))]

    def _since(self, then_ns: int | None, now_ns: int) -> float:
        """Return the time since an instant (s): one sample period if there was none."""
        return self._period_ns * 1e-9 if then_ns is None else (now_ns - then_ns) * 1e-9

    def _follows(self, sample: int, clock_s: float) -> bool:
        """Return whether a position can be the next one that came."""
        assert self._heard is not None  # a run has begun
        if self._law.safety.held and self._ahead is not None and 0 < sample - self._ahead <= _FIRST:
            self._heard = self._heard[0], sample - 1  # the stamps have moved, for good
            self._sample = max(self._sample or 0, sample - 1)
            return True
        left_out_s = (sample - self._heard[1] - 1) * self._period_ns * 1e-9
        return not self._pace.skips(left_out_s, clock_s, self._timeout_s)

    def _refuse(self, now_ns: int, sample: int, clock_s: float) -> Answers:
        """Trip at a position ahead of the clock; from now on the own clock says the torques."""
        assert self._heard is not None
        ahead_s = (sample - self._heard[1] - 1) * self._period_ns * 1e-9 - clock_s
        self._law.trip(f"the stamps jumped by {ahead_s:.3g} s")
        self._ahead = sample
        self.stale += 1
        if self._watched and not self._pacing:
            self._pacing, self.due_ns = True, now_ns + round(self._period_ns)
        return []

    def _take(
        self, now_ns: int, stamp: int, sample: int, value: float, clock_s: float, begins: bool
    ) -> float:
        """Return the torque that answers a position in its turn."""
        period_s, newest = self._period_ns * 1e-9, self._sample or 0
        # Where a run begins, the stamps say nothing of the time since the one before.
        since = 0 if begins or self._heard is None else self._heard[1]
        stamps_s = max(clock_s, period_s) if begins else (sample - since) * period_s
        if not self._pace.pass_time(stamps_s, clock_s, self._timeout_s):
            self._law.trip(f"the stamps are ahead of the clock by {self._timeout_s:g} s")
        said_s = self._since(self._said_ns, now_ns)
        sample_s = max(said_s, period_s) if begins else (sample - newest) * period_s
        self.lost += sample - newest - 1
        self._heard, self._said_ns, self._sample = (now_ns, sample), now_ns, sample
        self._pacing, self._ahead = False, None
        elapsed = Elapsed(min(sample_s, said_s), max(sample_s, said_s))
        torque = self._answer(stamp, value, elapsed)
        self.answered += 1
        if self._end is not None and sample >= self._end and not self._left:
            self._law.fall()
        self.due_ns = now_ns + self._timeout_ns if self._watched else NEVER
        return torque

    def _begin(self) -> None:
        self._take_values()
        self._law.begin_run(self._values)
        self._sample, self._left, self._pacing, self.strange = 0, False, False, False
        self._ahead = None

    def _answer(self, stamp: int, value: float, elapsed: Elapsed) -> float:
        reference, safety = self._references.pop(stamp, None), self._law.safety
        self._reference_age_s += max(elapsed.least_s, self._period_ns * 1e-9)
        if reference is not None:
            self._unreferenced_s = 0.0
            before = value if self._reference is None else self._reference
            if safety.accepts(reference, before, self._reference_age_s):
                self._reference, self._reference_age_s = reference, 0.0
        elif not safety.held:
            self.missing += 1
            self._unreferenced_s += elapsed.most_s
            if self._unreferenced_s > self._reference_timeout_s * _ROUNDED_UP:
                self._law.trip(f"no reference for {self._reference_timeout_s:g} s")
        if self._reference is None:
            self._reference = value
        return self._law.torque(self._reference, value, elapsed)

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
        self._unreferenced_s, self._pace = 0.0, Pace()
        if released and self._watched:
            self._pacing = False  # a position that does not come now trips again
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
            self._sample, self._said_ns = self._sample + 1, now_ns
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
