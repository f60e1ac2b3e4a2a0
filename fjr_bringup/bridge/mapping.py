"""Between the rig's signals and the topics of `joint_state_topic_hardware_interface`: no ROS here.

That ros2_control hardware component reads joint states from one topic and writes joint commands to
another, both sensor_msgs/msg/JointState. A command carries the time at which it was written, not
that of the state which it answers, so the pairing has to be found; `Answers` does so in lockstep
and `Observer` by the stamps.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from fjr_interface.bags.joint_state import Layout, LayoutError
from fjr_interface.topics import SIGNAL_DEPTH
from fjr_kit.errors import InputError

THRESHOLD = (
    "the hardware's trigger_joint_command_threshold holds back commands that differ little from "
    "the state; set it to -1"
)
JITTER = 0.25
"""Greatest deviation of a step between joint states from the sample period, as a part of it."""

PATIENCE = 1000
"""Most states that wait for a command."""

MEND = "record the topics as they are and analyze them with --resample auto"


@dataclass(frozen=True)
class Command:
    """What a message of joint commands says of one joint.

    Attributes:
        stamp_ns: when it was written.
        effort: commanded torque in N m; NaN before a controller is active.
        echo: effort of the echo joint: the number of the sample that it answers; NaN without one.
    """

    stamp_ns: int
    effort: float
    echo: float = math.nan


class CommandReader:
    """Finds the efforts of named joints in serialized joint commands."""

    def __init__(self, topic: str, joint: str, echo_joint: str = "") -> None:
        """Read the effort of `joint`, and of `echo_joint` if it is named."""
        self._topic = topic
        self._joints = (joint, echo_joint) if echo_joint else (joint,)

    def decode(self, payload: bytes) -> Command:
        """Return the command; raise InputError if the joint's effort is not in it."""
        try:
            layout = Layout.of(payload)
            efforts = layout.counts["effort"]
            if efforts != len(layout.names):
                raise InputError(
                    f"Topic {self._topic}: {efforts} efforts for the {len(layout.names)} joints "
                    f"{', '.join(layout.names)}, so no effort can be assigned to its joint; give "
                    "each joint of the ros2_control tag an effort command interface."
                )
            places = [layout.value_offset("effort", joint) for joint in self._joints]
        except LayoutError as error:
            raise InputError(
                f"Topic {self._topic}: {error}; name a joint of the ros2_control tag."
            ) from None
        seconds = int.from_bytes(payload[4:8], "little", signed=True)
        stamp = seconds * 1_000_000_000 + int.from_bytes(payload[8:12], "little")
        return Command(stamp, *(_double(payload, place) for place in places))


def _double(payload: bytes, at: int) -> float:
    return float(memoryview(payload)[at : at + 8].cast("d")[0])


class Answers:
    """Decides in lockstep which command answers a position.

    With an echo it is the one that carries the number of the position's sample. Without, it is the
    n-th after the position was sent: the first where whoever commands does so once for each
    position; the second where the controller manager runs freely, since the first may have been on
    its way.
    """

    def __init__(self, nth: int, echo: bool) -> None:
        """Expect no answer yet."""
        self._nth, self._echo = nth, echo
        self._stamp_ns = self._number = self._seen = 0
        self._last: Command | None = None

    @property
    def stamp_ns(self) -> int:
        """Stamp of the position that waits for its answer; 0 if none does."""
        return self._stamp_ns

    def ask(self, stamp_ns: int, number: int) -> None:
        """Say that the position of a sample was sent."""
        self._stamp_ns, self._number, self._seen, self._last = stamp_ns, number, 0, None

    def take(self, command: Command) -> float | None:
        """Return the torque if this command is the answer."""
        if not self._stamp_ns:
            return None
        self._last = command
        if not math.isfinite(command.effort):
            return None
        self._seen += 1
        if command.echo != self._number if self._echo else self._seen < self._nth:
            return None
        self._stamp_ns = 0
        return command.effort

    def missing(self, topic: str, joint: str) -> str | None:
        """Return what the position waits for, None if no position does."""
        if not self._stamp_ns:
            return None
        if self._last is None:
            return (
                f"a command on {topic} that answers the position of {_seconds(self._stamp_ns)}; if "
                f"the controller manager runs, {THRESHOLD}"
            )
        if not math.isfinite(self._last.effort):
            return f"an active controller: the effort command of {joint} on {topic} is NaN"
        if self._echo:
            return f"the echo of sample {self._number} on {topic}, where {self._last.echo:g} is"
        return f"the next command on {topic}"


@dataclass(frozen=True)
class Sample:
    """One observed sample: its number from 1, and r (None without a reference), y and u in SI."""

    number: int
    reference: float | None
    position: float
    torque: float


class Observer:
    """Pairs joint states, commands and references of a running rig by their stamps.

    A command belongs to the newest state at or before it; the reference of a sample is the newest
    at or before its command. Samples count from the first state that a finite command answers.
    """

    def __init__(self, topics: tuple[str, str], sample_rate_hz: float, referenced: bool) -> None:
        """Observe the topics of states and commands, perhaps with a reference."""
        self._states_topic, self._commands_topic = topics
        self._period_ns = 1e9 / sample_rate_hz
        self._referenced = referenced
        self._number = self._last_ns = 0
        self._states: deque[tuple[int, float]] = deque()  # not answered yet
        self._commands: deque[Command] = deque(maxlen=SIGNAL_DEPTH)
        self._references: deque[tuple[int, float]] = deque(maxlen=2 * SIGNAL_DEPTH)

    def add_state(self, stamp_ns: int, position: float) -> list[Sample]:
        """Take a joint state; return the samples that are complete now.

        Raises:
            InputError: the position is not finite; or, once samples are counted, the state does not
                come one period after the last, or a state has no command, an effort that is not
                finite, or no reference.
        """
        if not math.isfinite(position):
            raise InputError(
                f"Topic {self._states_topic}: {position} at {_seconds(stamp_ns)}; start the bridge "
                "when the drive has a position."
            )
        if stamp_ns < self._last_ns - 10.0 * self._period_ns:
            self._begin_anew()
        elif self._number:
            self._check_step(stamp_ns)
        self._last_ns = stamp_ns
        self._states.append((stamp_ns, position))
        if len(self._states) > PATIENCE:
            self._leave_unanswered()
        return self._complete()

    def _begin_anew(self) -> None:
        """Follow a simulated rig that is at its beginning again."""
        self._number = 0
        self._states.clear()
        self._references.clear()
        early = [command for command in self._commands if command.stamp_ns < self._last_ns]
        self._commands = deque(early, maxlen=SIGNAL_DEPTH)  # one may have overtaken the first state

    def _check_step(self, stamp_ns: int) -> None:
        step_ns = stamp_ns - self._last_ns
        if abs(step_ns - self._period_ns) > JITTER * self._period_ns:
            raise InputError(
                f"Topic {self._states_topic}: the state of {_seconds(stamp_ns)} comes "
                f"{_seconds(step_ns)} after the one before it, where {_seconds(self._period_ns)} "
                f"were due; {MEND}."
            )

    def add_command(self, command: Command) -> list[Sample]:
        """Take a joint command; return the samples that are complete now."""
        self._commands.append(command)
        return self._complete()

    def add_reference(self, stamp_ns: int, reference: float) -> list[Sample]:
        """Take a reference; return the samples that are complete now."""
        self._references.append((stamp_ns, reference))
        return self._complete()

    def _complete(self) -> list[Sample]:
        samples = []
        while self._states and self._commands:
            (stamp, position), command = self._states[0], self._commands[0]
            if command.stamp_ns < stamp:
                self._commands.popleft()
                self._refuse_if_begun(
                    self._commands_topic,
                    f"a second command, of {_seconds(command.stamp_ns)}, answers one state; run "
                    "the controller manager at the rate of the states",
                )
            elif len(self._states) > 1 and command.stamp_ns >= self._states[1][0]:
                self._leave_unanswered()
            elif not self._number and not math.isfinite(command.effort):
                self._commands.popleft()  # no controller is active yet
            elif not self._is_decided(stamp, command):
                break
            else:
                self._states.popleft()
                self._commands.popleft()
                samples += self._paired(position, command)
        return samples

    def _leave_unanswered(self) -> None:
        stamp, _ = self._states.popleft()
        self._refuse_if_begun(
            self._commands_topic,
            f"no command answers the state of {_seconds(stamp)}: one was lost, or {THRESHOLD}",
        )

    def _is_decided(self, stamp: int, command: Command) -> bool:
        """Return whether nothing that is still to come can change what belongs to a state."""
        if len(self._states) > 1:
            return True
        if command.stamp_ns >= stamp + (1.0 - JITTER) * self._period_ns:
            return False
        return not self._referenced or any(at >= stamp for at, _ in self._references)

    def _paired(self, position: float, command: Command) -> list[Sample]:
        reference = self._reference_of(command) if self._referenced else None
        if not math.isfinite(command.effort):
            self._refuse_if_begun(
                self._commands_topic,
                f"{command.effort} at {_seconds(command.stamp_ns)}; keep the controller active",
            )
        elif self._referenced and reference is None:
            self._refuse_if_begun("reference", f"is missing at {_seconds(command.stamp_ns)}")
        else:
            self._number += 1
            return [Sample(self._number, reference, position, command.effort)]
        return []

    def _reference_of(self, command: Command) -> float | None:
        found = None
        while self._references and self._references[0][0] <= command.stamp_ns:
            found = self._references.popleft()
        if found is None:
            return None
        self._references.appendleft(found)
        return found[1]

    def _refuse_if_begun(self, topic: str, what: str) -> None:
        if self._number:
            raise InputError(f"Topic {topic}: {what}.")


def _seconds(time_ns: float) -> str:
    return f"{time_ns * 1e-9:.6f} s"
