"""What keeps a rig safe from its controller: limits, soft start, trips that stay until released.

A limit of torque or torque rate bounds the torque; a position or a velocity beyond its limit, a
jump, a value that is no number, a watchdog or the emergency stop trips. A trip takes the torque to
zero, where it stays until it is released: by a ramp of stated length, or at once where the position
can't be trusted. After a release the torque rises softly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fjr_interface.errors import InputError
from fjr_interface.parameters import Parameter, ParameterGroup

SAFETY = ParameterGroup(
    Parameter(
        "torque_rate_limit_nm_s",
        math.inf,
        "N m/s",
        "The torque changes no faster than this; .inf: no limit",
        1e-3,
    ),
    Parameter(
        "position_limit_rad",
        math.inf,
        "rad",
        "Trips when the measured position is beyond +- this; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "velocity_limit_rad_s",
        math.inf,
        "rad/s",
        "Trips when the velocity is beyond +- this; .inf: no limit",
        1e-6,
    ),
    Parameter(
        "velocity_window_s",
        0.005,
        "s",
        "Time constant of the velocity estimate; a jump of velocity_limit_rad_s times this trips",
        1e-5,
        10.0,
    ),
    Parameter(
        "position_jump_rad",
        0.1,
        "rad",
        "Real time only: trips when the position changes by more from sample to sample; .inf: no "
        "limit",
        1e-6,
    ),
    Parameter(
        "position_timeout_s",
        0.1,
        "s",
        "Real time only: trips when no position came for this long; .inf: never",
        1e-3,
    ),
    Parameter(
        "reference_timeout_s",
        0.1,
        "s",
        "Real time only: trips when positions had no reference for this long; .inf: never",
        0.0,
    ),
    Parameter(
        "torque_soft_start_s",
        0.5,
        "s",
        "Rise of the torque from zero after a release and, in real time, when a run begins",
        0.0,
        60.0,
    ),
    Parameter(
        "ramp_down_s",
        0.05,
        "s",
        "Ramp of the torque to zero after a trip by a watchdog or the emergency stop",
        0.0,
        10.0,
    ),
    Parameter("hardware", False, "", "The drive is real: all limits and confirm must be given"),
    Parameter("confirm", "", "", "With hardware: the name of the joint that is going to move"),
)
"""Parameters of the safety functions; the same names are parameters of the controller node."""

_ROUNDING = 1e-9  # so that the ramp ends when its steps say so
_HARDWARE_LIMITS = (
    "torque_limit_nm",
    "torque_rate_limit_nm_s",
    "position_limit_rad",
    "velocity_limit_rad_s",
)


def check_hardware(values: Mapping[str, Any]) -> None:
    """Refuse hardware without limits and confirmation.

    Args:
        values: checked values of SAFETY, of the control law, and `joint`.

    Raises:
        InputError: `hardware` is true and a limit is infinite, or `confirm` is not the joint.
    """
    if not values["hardware"]:
        return
    endless = [name for name in _HARDWARE_LIMITS if math.isinf(values[name])]
    if endless:
        raise InputError(f"hardware needs finite limits; give {', '.join(endless)}.")
    if values["confirm"] != values["joint"]:
        raise InputError(
            f"hardware moves joint {values['joint']!r}; give its name as confirm to confirm that."
        )


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
        self.begin_run(values)

    def begin_run(self, values: Mapping[str, Any]) -> None:
        """Begin a run from rest, with limits read anew; a trip stays."""
        self._rate = values["torque_rate_limit_nm_s"]
        self._position_limit = values["position_limit_rad"]
        self._velocity_limit = values["velocity_limit_rad_s"]
        self._window_s = values["velocity_window_s"]
        self._jump = values["position_jump_rad"] if self._real_time else math.inf
        self._soft_start_s = values["torque_soft_start_s"]
        self._ramp_s = values["ramp_down_s"]
        self._position: float | None = None
        self._velocity = 0.0
        self._torque = self._ramp_from = 0.0
        self._rise = 0.0 if self._real_time else 1.0
        self._ramp = 0.0
        self._falling = False
        self.resuming = False
        self.saturated = 0

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
        """Begin to guard a controller whose latest torque was this (N m)."""
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
        return was is not None

    def observe(self, position: float, duration_s: float, samples: int = 1) -> None:
        """Look at a measured position; trip if it is beyond a limit.

        Args:
            position: y (rad).
            duration_s: time since the last one.
            samples: sample periods since the last one.
        """
        if not math.isfinite(position):
            self.trip(f"the position is {position}", at_once=True)
            return
        before = position if self._position is None else self._position
        self._position = position
        change = position - before
        share = -math.expm1(-duration_s / self._window_s)
        self._velocity += share * (change / duration_s - self._velocity)
        if abs(change) > self._jump * samples:
            self.trip(
                f"the position jumped by {change:.4g} rad, beyond position_jump_rad {self._jump:g}",
                at_once=True,
            )
        if abs(position) > self._position_limit:
            self.trip(
                f"position {position:.4g} rad beyond position_limit_rad {self._position_limit:g}",
                at_once=True,
            )
        if abs(self._velocity) > self._velocity_limit:
            self.trip(
                f"velocity {self._velocity:.4g} rad/s beyond velocity_limit_rad_s "
                f"{self._velocity_limit:g}",
                at_once=True,
            )

    def bound(self, torque: float, duration_s: float) -> float:
        """Return the torque (N m) that may be commanded instead of the wanted one.

        Args:
            torque: what the control law wants (N m).
            duration_s: time since the last torque.
        """
        if not math.isfinite(torque):
            self.trip(f"the torque is {torque}", at_once=True)
        if self.held:
            fall = duration_s / self._ramp_s if self._ramp_s > 0.0 else 1.0
            self._ramp = self._ramp - fall if self._ramp - fall > _ROUNDING else 0.0
            self._torque = self._ramp_from * self._ramp if self._ramp else 0.0
            return self._torque
        self.resuming = False
        if self._rise < 1.0:
            rise = duration_s / self._soft_start_s if self._soft_start_s > 0.0 else 1.0
            self._rise = min(self._rise + rise, 1.0)
            torque *= self._rise
        step = self._rate * duration_s
        if abs(torque - self._torque) > step:
            self.saturated += 1
            torque = self._torque + math.copysign(step, torque - self._torque)
        self._torque = torque
        return torque
