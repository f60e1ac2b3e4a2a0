"""The simulated drive in real time: samples by the clock, torques when they come.

The motion is that of a drive whose clock never waits: sample k is measured at t0 + k Ts exactly,
and a torque acts from the instant at which it arrives, within a sample if it comes late. Instants
are integer nanoseconds of one steady clock; the caller says what time it is, so that the same run
can be made without one.
"""

from __future__ import annotations

import math
from array import array
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from fjr_interface.experiment import Experiment
from fjr_interface.parameters import Parameter
from fjr_interface.real_time import NEVER, Histogram
from fjr_kit.errors import InputError

from .. import effects as fx
from .. import plant
from ..simulation import rig
from ..simulation.simulator import encoder_noise

TORQUE_TIMEOUT = Parameter(
    "torque_timeout_s",
    0.1,
    "s",
    "Real time only: the drive lets go (zero torque) when no torque came for this long; .inf: it "
    "holds the last one for ever",
    1e-3,
)


class Wire(Protocol):
    """What lies between the drive and the topics: the place for delay, loss and damage.

    The node puts each message in when it is made and hands on what has come out: positions on their
    way to the publisher, torques on their way to the drive.
    """

    next_ns: int
    """Instant of the next message to come out, NEVER if none is under way."""

    def put(self, now_ns: int, stamp_ns: int, value: float) -> None:
        """Send a message in at this instant."""
        ...

    def take(self, now_ns: int) -> Sequence[tuple[int, float]]:
        """Return (stamp, value) of what has come out by this instant, in its order."""
        ...


class PlainWire:
    """A wire on which nothing happens."""

    def __init__(self) -> None:
        """Start empty."""
        self.next_ns = NEVER
        self._messages: list[tuple[int, float]] = []

    def put(self, now_ns: int, stamp_ns: int, value: float) -> None:
        """Send a message in; it comes out at once."""
        self._messages.append((stamp_ns, value))
        self.next_ns = now_ns

    def take(self, now_ns: int) -> Sequence[tuple[int, float]]:
        """Return everything that is under way."""
        messages, self._messages, self.next_ns = self._messages, [], NEVER
        return messages


class RealTimeDrive:
    """One realization of the simulated drive on a steady clock."""

    def __init__(self, values: Mapping[str, Any], experiment: Experiment) -> None:
        """Switch the drive on: plant at rest, noise seeded, no torque.

        Args:
            values: checked SIMULATOR values and TORQUE_TIMEOUT.
            experiment: what is played.
        """
        self._stamps = array("q", experiment.stamps_ns.tobytes())
        self._noise = array("d", encoder_noise(values, experiment).tobytes())
        self._plant = plant.coefficients(values)
        self._link_side = rig.MOTOR if plant.moves_as_one(values) else rig.LINK
        # The effect delays by samples, as the lockstep needs it; here it lies between arrival and
        # action, whenever that is.
        delay = fx.NAMES[fx.DELAY_TIME_S]
        self._delay_ns = round(values.get(delay, 0.0) * 1e9)
        self._effects = fx.coefficients({**values, delay: 0.0})
        timeout_s = values[TORQUE_TIMEOUT.name]
        self._timeout_ns = NEVER if math.isinf(timeout_s) else round(timeout_s * 1e9)
        self._period_ns = 1e9 / experiment.sample_rate_hz
        self._state = rig.at_rest(experiment.elapsed_s)
        rig.hold(rig.at_rest(), 0.0, 1e-4, self._plant, self._effects)  # compiles it
        rig.measure(self._state, 0.0, self._effects)
        self._pending: deque[tuple[int, float]] = deque()
        self._torque = 0.0
        self._heard_ns = NEVER
        self._published = array("q", bytes(8 * len(self._stamps)))
        self.samples = self.torques = self.late_torques = self.overruns = self.let_go = 0
        self._stuck_motor = self._stuck_link = 0
        self.latency, self.lateness = Histogram(), Histogram()
        self._start_ns = self._at_ns = self.due_ns = NEVER

    def start(self, now_ns: int) -> None:
        """Let time begin: the first sample is due one sample period from now."""
        self._start_ns = self._at_ns = now_ns
        self.due_ns = now_ns + self._stamps[0]

    @property
    def total(self) -> int:
        """Samples of the realization."""
        return len(self._stamps)

    @property
    def over(self) -> bool:
        """Whether all samples have been measured and the time of the last one has passed."""
        return self.samples == self.total and self.due_ns == NEVER

    @property
    def troubled(self) -> bool:
        """Whether anything was late or lost so far."""
        return bool(self.overruns or self.late_torques or self.let_go or self.unanswered)

    @property
    def unanswered(self) -> int:
        """Samples without a torque, the newest two aside, whose torques may be under way."""
        return max(self.samples - 2 - self.torques, 0)

    def figures(self) -> dict[str, float | int]:
        """Return the counts and times so far by name, with the unit in the name."""
        return {
            "samples": self.samples,
            "torques": self.torques,
            "late torques": self.late_torques,
            "unanswered samples": self.unanswered,
            "overruns": self.overruns,
            "let go": self.let_go,
            "motor sticking (fraction)": self._stuck_motor / max(self.samples, 1),
            "link sticking (fraction)": self._stuck_link / max(self.samples, 1),
            "worst lateness of a sample (ms)": self.lateness.worst_ns * 1e-6,
            "loop latency p50 (ms)": self.latency.quantile_s(0.5) * 1e3,
            "loop latency p99 (ms)": self.latency.quantile_s(0.99) * 1e3,
            "loop latency worst (ms)": self.latency.worst_ns * 1e-6,
        }

    def describe(self) -> str:
        """Return in one sentence how the realization went."""
        return (
            f"{self.samples} samples in real time, {self.torques} torques, "
            f"{self.late_torques} of them late; {self.overruns} overruns; torque after position: "
            f"{self.latency.describe()}."
        )

    def measure(self, now_ns: int) -> Iterator[tuple[int, float, float]]:
        """Yield (stamp, motor position, link position) of all samples that are due by now.

        After the last sample one more period passes, for the last torque; then `due_ns` is NEVER.

        Raises:
            InputError: the motion diverges.
        """
        while self.due_ns <= now_ns:
            k, due_ns = self.samples, self.due_ns
            self._advance(due_ns)
            if k == self.total:
                self.due_ns = NEVER
                return
            self.samples = k + 1
            after = self._stamps[k + 1] if k + 1 < self.total else self._stamps[k] + self._period_ns
            self.due_ns = self._start_ns + int(after)
            self._published[k] = now_ns
            self.lateness.add(now_ns - due_ns)
            self.overruns += now_ns - due_ns > self._period_ns
            self._stuck_motor += self._state[rig.MOTOR + 1] == 0.0
            self._stuck_link += self._state[rig.LINK + 1] == 0.0
            position = rig.measure(self._state, self._noise[k], self._effects)
            yield self._stamps[k], position, self._state[self._link_side]

    def command(self, now_ns: int, stamp_ns: int, torque: float) -> None:
        """Take a torque that arrives now, the answer to the position of that stamp.

        It acts from now on, or later by the delay of the drive; one that is no number makes the
        drive let go. Before the first sample it is of an earlier realization, and ignored.

        Raises:
            InputError: the motion diverges.
        """
        if not self.samples or self.due_ns == NEVER:
            return
        self._advance(now_ns)
        self._heard_ns = now_ns
        if not math.isfinite(torque):
            torque = 0.0
            self.let_go += 1
        self._pending.append((now_ns + self._delay_ns, torque))
        self.torques += 1
        k = round(stamp_ns / self._period_ns) - 1
        if 0 <= k < self.samples:
            latency_ns = now_ns - self._published[k]
            self.latency.add(latency_ns)
            self.late_torques += latency_ns > self._period_ns

    def _advance(self, until_ns: int) -> None:
        """Move to an instant; on the way the torque changes when it is due to."""
        pending = self._pending
        while pending and pending[0][0] <= until_ns:
            at_ns, torque = pending.popleft()
            self._hold(at_ns)
            self._torque = torque
        self._hold(until_ns)
        if not math.isfinite(self._state[rig.MOTOR]):
            raise InputError(
                f"The simulated motion diverges at {(until_ns - self._start_ns) * 1e-9:.3f} s; "
                "raise sample_rate_hz or lower the controller gains or the amplitude."
            )

    def _hold(self, until_ns: int) -> None:
        """Hold the torque to an instant, but never longer than its timeout."""
        deadline_ns = self._heard_ns + self._timeout_ns
        if self._torque != 0.0 and deadline_ns < until_ns:
            self._move(deadline_ns)
            self._torque = 0.0
            self.let_go += 1
        self._move(until_ns)

    def _move(self, to_ns: int) -> None:
        duration_ns = to_ns - self._at_ns
        if duration_ns > 0:
            rig.hold(self._state, self._torque, duration_ns * 1e-9, self._plant, self._effects)
            self._at_ns = to_ns
