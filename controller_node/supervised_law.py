"""The control law behind its safety functions, one sample at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from . import pd_filtered
from .safety import Elapsed, Safety


class SupervisedLaw:
    """The default law of one controller; without limits or a trip its torque is the bare law's.

    Attributes:
        safety: the limits and trips that its torque obeys.
        saturated: torques of the run at the torque limit.
    """

    def __init__(self, values: Mapping[str, Any], *, real_time: bool) -> None:
        """Take checked values of CONTROLLER and SAFETY."""
        self.safety = Safety(values, real_time=real_time)
        self.begin_run(values)

    def begin_run(self, values: Mapping[str, Any]) -> None:
        """Begin a run from rest, with parameters read anew; a trip stays."""
        self._coefficients = pd_filtered.coefficients(values)
        self._limit = float(self._coefficients[3])
        period_s = 1.0 / values["sample_rate_hz"]
        self._one_sample = Elapsed(period_s, period_s)
        self._x = self._torque = 0.0
        self.saturated = 0
        self.safety.begin_run(values)
        self._supervised = self.safety.needed
        pd_filtered.step(0.0, 0.0, self._coefficients)  # compiles it

    def trip(self, reason: str, *, at_once: bool = False) -> None:
        """Take the torque to zero and hold it there until released."""
        self._supervise()
        self.safety.trip(reason, at_once=at_once)

    def fall(self) -> None:
        """Take the torque to zero until a run begins."""
        self._supervise()
        self.safety.fall()

    def _supervise(self) -> None:
        if not self._supervised:
            self.safety.take_over(self._torque)
            self._supervised = True

    def torque(self, reference: float, position: float, elapsed: Elapsed | None = None) -> float:
        """Return the torque (N m) that answers a position.

        Args:
            reference: r (rad).
            position: y (rad).
            elapsed: time since the last answer; None for one sample period.
        """
        if self._supervised:
            return self._supervised_torque(reference, position, elapsed or self._one_sample)
        self._x, torque = pd_filtered.step(self._x, reference - position, self._coefficients)
        if torque >= self._limit or torque <= -self._limit:
            self.saturated += 1
        self._torque = torque
        return torque

    def rest(self) -> float:
        """Return the torque of a sample without a position, on its way to zero."""
        return self.safety.bound(0.0, self._one_sample)

    def _supervised_torque(self, reference: float, position: float, elapsed: Elapsed) -> float:
        safety = self.safety
        if not math.isfinite(reference):
            self.trip(f"the reference is {reference}", at_once=True)
        safety.observe(position, elapsed)
        if safety.held:
            return safety.bound(0.0, elapsed)
        error = reference - position
        if safety.resuming:
            self._x = error  # as after a long time with this error: no kick of the derivative
        self._x, torque = pd_filtered.step(self._x, error, self._coefficients)
        if abs(torque) >= self._limit:
            self.saturated += 1
        return safety.bound(torque, elapsed)
