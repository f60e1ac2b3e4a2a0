"""Safety functions of the controller: limits, soft start, and trips that stay until released.

A limit of torque or torque rate bounds the torque; a position or a velocity beyond its limit, a
jump, a value that is no number, a watchdog or the emergency stop trips. A trip takes the torque to
zero, where it stays until it is released: by a ramp of stated length, or at once where the position
can't be trusted. After a release the torque rises softly.

Every limit holds in sample time and in the time of the clock: what may change counts the shorter of
the two, what must be reached the longer. A comparison with what is no number trips.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

_ROUNDING = 1e-9  # so that the ramp ends when its steps say so


class Elapsed(NamedTuple):
    """Time since the last torque, by the stamps and by the clock.

    Attributes:
        least_s: the shorter of both.
        most_s: the longer of both.
    """

    least_s: float
    most_s: float


class Safety:
    """Bounds one controller's torque, sample by sample; a trip outlasts runs.

    Attributes:
        tripped: why the torque is held at zero; None if it isn't.
        trips: trips so far.
        resuming: whether the next torque is the first one after a release.
        saturated: samples of the run whose torque was bounded by the rate limit.
    """

    def __init__(self, values: Mapping[str, Any], *, real_time: bool) -> None:
        """Take checked SAFETY values."""
        self.tripped: str | None = None
        self.trips = 0
        self._real_time = real_time
        self._torque = self._ramp_from = self._ramp = 0.0
        self._forget_motion()
        self.begin_run(values)

    def begin_run(self, values: Mapping[str, Any]) -> None:
        """Begin a run, with limits read anew; a trip stays.

        A lockstep begins at rest. In real time the joint is where it was, with the torque that it
        had.
        """
        self._rate = values["torque_rate_limit_nm_s"]
        self._position_limit = values["position_limit_rad"]
        self._velocity_limit = values["velocity_limit_rad_s"]
        self._window_s = values["velocity_window_s"]
        self._jump = values["position_jump_rad"] if self._real_time else math.inf
        self._reference_limit = values["reference_limit_rad"]
        self._reference_step = values["reference_step_rad"]
        self._period_s = 1.0 / values["sample_rate_hz"]
        self._soft_start_s = values["torque_soft_start_s"]
        self._ramp_s = values["ramp_down_s"]
        self._rise = 0.0 if self._real_time else 1.0
        self._falling = False
        self.resuming = False
        self.saturated = 0
        limit = values["torque_limit_nm"]
        self._torque = min(max(self._torque, -limit), limit)
        if not self._real_time:
            self._torque = self._ramp_from = self._ramp = 0.0
            self._forget_motion()

    def _forget_motion(self) -> None:
        self._position: float | None = None
        self._velocity = 0.0

    @property
    def needed(self) -> bool:
        """Whether anything here can change the torque of a lockstep."""
        limits = (self._rate, self._position_limit, self._velocity_limit)
        return self.held or self._rise < 1.0 or any(map(math.isfinite, limits))

    @property
    def resting(self) -> bool:
        """Whether the torque is held at zero and has reached it."""
        return self.held and self._torque == 0.0

    @property
    def held(self) -> bool:
        """Whether the torque is taken to zero, or held there."""
        return self._falling or self.tripped is not None

    def take_over(self, torque: float) -> None:
        """Take over from a controller whose latest torque was this (N m)."""
        self._torque = torque

    def trip(self, reason: str, *, at_once: bool = False) -> None:
        """Take the torque to zero, by the ramp or at once, and hold it there until released."""
        if not self.held:
            self._begin_ramp()
        if at_once:
            self._ramp = 0.0
        if self.tripped is None:
            self.tripped = reason
            self.trips += 1

    def fall(self) -> None:
        """Take the torque to zero by the ramp, and hold it there until a run begins."""
        if not self.held:
            self._begin_ramp()
        self._falling = True

    def _begin_ramp(self) -> None:
        self._ramp_from, self._ramp = self._torque, 1.0

    def release(self) -> bool:
        """Let the torque rise again, softly; return False if nothing has tripped."""
        was, self.tripped = self.tripped, None
        if was is not None:
            self._rise, self.resuming = 0.0, True
            self._forget_motion()
        return was is not None

    def observe(self, position: float, elapsed: Elapsed) -> None:
        """Look at a measured position; trip if it is beyond a limit.

        Args:
            position: y (rad).
            elapsed: time since the last one; at least one sample period is counted, since positions
                that come late come together.
        """
        if not math.isfinite(position):
            self.trip(f"the position is {position}", at_once=True)
            return
        before = position if self._position is None else self._position
        self._position = position
        duration_s = max(elapsed.least_s, self._period_s)
        change = position - before
        share = -math.expm1(-duration_s / self._window_s)
        velocity = self._velocity + share * (change / duration_s - self._velocity)
        self._velocity = velocity
        if not abs(change) <= self._jump * (duration_s / self._period_s):
            self.trip(
                f"the position jumped by {change:.4g} rad, beyond position_jump_rad {self._jump:g}",
                at_once=True,
            )
        if not abs(position) <= self._position_limit:
            self.trip(
                f"position {position:.4g} rad beyond position_limit_rad {self._position_limit:g}",
                at_once=True,
            )
        if not abs(velocity) <= self._velocity_limit or not math.isfinite(velocity):
            self.trip(
                f"velocity {velocity:.4g} rad/s beyond velocity_limit_rad_s "
                f"{self._velocity_limit:g}",
                at_once=True,
            )
        if not math.isfinite(velocity):
            self._forget_motion()

    def accepts(self, reference: float, before: float, duration_s: float) -> bool:
        """Look at a reference; trip and return False if it is beyond a limit.

        Args:
            reference: r (rad).
            before: the last one that was accepted, or the position if there is none (rad).
            duration_s: time between the two.
        """
        if not math.isfinite(reference):
            self.trip(f"the reference is {reference}", at_once=True)
            return False
        if not abs(reference) <= self._reference_limit:
            self.trip(
                f"reference {reference:.4g} rad beyond reference_limit_rad "
                f"{self._reference_limit:g}"
            )
            return False
        samples = max(duration_s / self._period_s, 1.0)
        if not abs(reference - before) <= self._reference_step * samples:
            self.trip(
                f"the reference changed by {reference - before:.4g} rad, beyond reference_step_rad "
                f"{self._reference_step:g}"
            )
            return False
        return True

    def bound(self, torque: float, elapsed: Elapsed) -> float:
        """Return the torque (N m) that may be commanded instead of the wanted one.

        Args:
            torque: what the control law wants (N m).
            elapsed: time since the last torque.
        """
        if not math.isfinite(torque):
            self.trip(f"the torque is {torque}", at_once=True)
        if self.held:
            # The ramp begins with the trip, however long ago the last torque was.
            passed_s = elapsed.least_s if self._ramp == 1.0 else elapsed.most_s
            fall = passed_s / self._ramp_s if self._ramp_s > 0.0 else 1.0
            self._ramp = self._ramp - fall if self._ramp - fall > _ROUNDING else 0.0
            self._torque = self._ramp_from * self._ramp if self._ramp else 0.0
            return self._torque
        self.resuming = False
        if self._rise < 1.0:
            rise = elapsed.least_s / self._soft_start_s if self._soft_start_s > 0.0 else 1.0
            self._rise = min(self._rise + rise, 1.0)
            torque *= self._rise
        if math.isfinite(self._rate):
            step = self._rate * elapsed.least_s
            if abs(torque - self._torque) > step:
                self.saturated += 1
                torque = self._torque + math.copysign(step, torque - self._torque)
        self._torque = torque
        return torque
