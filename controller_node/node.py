"""ROS node of the controller: pairs r and y by stamp and answers with u of the same stamp."""

from __future__ import annotations

import json
import math
import time

from rclpy.duration import Duration
from std_msgs.msg import String

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateWriter, LayoutError
from fjr_interface.experiment import Experiment
from fjr_interface.health import ERROR, OK, WARN, Health, Speed
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import LOCKSTEP, MODE_PARAMETER, NEVER, REAL_TIME, keep_pauses_out
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_interface.waiting import Lack
from fjr_kit.errors import InputError

from . import limits, pd_filtered
from .lockstep import LockstepController
from .real_time import Answers, RealTimeController
from .source import Source
from .supervised_law import SupervisedLaw

PARAMETERS = ParameterGroup(
    *pd_filtered.CONTROLLER,
    *limits.SAFETY,
    MODE_PARAMETER,
    runtime.JOINT_PARAMETER,
    runtime.readers_parameter("simulator"),
)

_LOOK_S = 0.5  # between two looks at who publishes
_LAST_WORD_S = 0.2  # for a torque to arrive before the node ends


class ControllerNode(runtime.RigNode):
    """Controller driven by the signal topics and their stamps only.

    A position with the stamp of the first sample starts a new realization: the filter state is
    zeroed and the parameters are read anew. A reference whose stamp goes back starts a new stream:
    the controller leaves the run under way and describes itself again, which tells the excitation.
    In lockstep a position waits for its reference; in real time it is answered at once.
    """

    def __init__(self) -> None:
        """Create publishers, subscriptions and the services of the emergency stop."""
        super().__init__("controller", PARAMETERS)
        self._encode = JointStateWriter("effort", self.values["joint"]).encode
        self._real_time = self.values["mode"] == REAL_TIME
        self._law = SupervisedLaw(self.values, real_time=self._real_time)
        self._loop = RealTimeController(self._law, self.values)
        self._lockstep = LockstepController(self._law, self.values)
        self._newest_reference = 0
        self._stream = time.time_ns()  # not one of an earlier controller
        self._tripped: str | None = None
        self._speed = Speed()
        self._excitations: frozenset[bytes] = frozenset()
        self._torque = self.offer(topics.MOTOR_TORQUE)
        self.claim(self._torque)
        on_position = self._on_position_in_real_time if self._real_time else self._on_position
        self._reference = Source(self, topics.REFERENCE, self._on_reference)
        self._position = Source(self, topics.MOTOR_POSITION, on_position)
        self.call_every(_LOOK_S, self._look_for_others)
        self.create_subscription(
            String, topics.EXPERIMENT_TOPIC, self._on_experiment, runtime.EXPERIMENT_QOS
        )
        self._description = self.create_publisher(
            String, topics.CONTROLLER_TOPIC, runtime.EXPERIMENT_QOS
        )
        self._describe()
        self.create_trigger("~/estop", self._estop)
        self.create_trigger("~/release", self._release)
        self.create_trigger("~/status", lambda: (self._tripped is None, self._state))

    def check(self, values: runtime.Values) -> None:
        """Refuse hardware without limits and confirmation."""
        limits.check_hardware(values)

    def values_changed(self) -> None:
        """Describe the controller anew."""
        self._describe()

    def _describe(self) -> None:
        description = {
            **pd_filtered.describe(self.values),
            topics.STREAM_KEY: self._stream,
            topics.MODE_KEY: REAL_TIME if self._real_time else LOCKSTEP,
        }
        self._description.publish(String(data=json.dumps(description)))

    def _on_experiment(self, message: String) -> None:
        if not self._real_time:
            return  # its end is that of the positions
        try:
            experiment = Experiment.from_json(message.data, "topic experiment")
        except InputError as error:
            self._trip(f"{error}".rstrip("."))
            return
        rate = self.values["sample_rate_hz"]
        if experiment.sample_rate_hz != rate:
            self._trip(
                f"the experiment has sample_rate_hz {experiment.sample_rate_hz:g}, the controller "
                f"{rate:g}"
            )
        self._loop.end(experiment.samples)

    def _look_for_others(self) -> None:
        """Refuse a second publisher: in real time each message looks for one, too.

        In real time another one in the first one's place is refused as well, while a run goes on.
        """
        for source in (self._reference, self._position):
            if self._real_time:
                source.look()
                self._refuse_second(source)
                if self._law.safety.held:
                    source.forget()
                elif replaced := source.replaced():
                    self._trip(replaced)
            elif others := source.others():
                raise InputError(others)

    def _refuse_second(self, source: Source) -> None:
        if (second := source.second()) and self._law.safety.tripped is None:
            self._trip(second)

    def _on_reference(self, message: bytes) -> None:
        if self._real_time:
            self._refuse_second(self._reference)
        for each in (
            message,
            *runtime.take_all(self._reference.subscription),
        ):  # they come in bursts
            sample = self._read(self._reference, each)
            if sample is None:
                continue
            stamp, _ = sample
            if stamp <= self._newest_reference or not self._newest_reference:
                self._leave_run()
            self._newest_reference = stamp
            (self._loop if self._real_time else self._lockstep).reference(*sample)
        self._answer()

    def _leave_run(self) -> None:
        for source in (self._reference, self._position):
            source.forget()
        if self._real_time:
            self._loop.leave_run(self.values)
            keep_pauses_out()
        elif self._lockstep.leave_run():
            self.stop_waiting()
        self._stream += 1
        self._describe()

    def _on_position(self, message: bytes) -> None:
        sample = self._read(self._position, message)
        assert sample is not None  # an unreadable one ends a lockstep
        if first := self._lockstep.is_first(sample[0]):
            self._look_for_others()
            self._lockstep.begin_run(self.values)
        if not self._lockstep.position(*sample):
            return
        if first:
            self.wait_until(self._lacking, self._begin)
        else:
            self._answer()

    def _lacking(self) -> Lack | None:
        return self.unread(self._torque) or self.unwritten(
            self._reference.subscription, "excitation"
        )

    def _begin(self) -> None:
        self._lockstep.go_on()
        self._excitations = self.writers("excitation")
        self._answer()

    def _answer(self) -> None:
        """Publish the torque of a lockstep's sample if it is complete."""
        if answer := self._lockstep.answer():
            self._torque.publish(self._encode(*answer))
            self._tell_trip()

    def _on_position_in_real_time(self, message: bytes) -> None:
        now_ns = time.monotonic_ns()
        self._refuse_second(self._position)
        sample = self._read(self._position, message)
        if sample is not None:
            self._say(self._loop.position(now_ns, *sample))

    def _trip(self, reason: str, *, at_once: bool = False) -> None:
        self._say(self._loop.trip(time.monotonic_ns(), reason, at_once=at_once))

    def on_time(self, now_ns: int) -> None:
        """Watch the positions in real time."""
        self._say(self._loop.serve(now_ns))

    def _say(self, answers: Answers) -> None:
        for stamp, torque in answers:
            self._torque.publish(self._encode(stamp, torque))
        self.due_ns = self._loop.due_ns
        self._tell_trip()

    def leave(self) -> None:
        """Take the torque to zero before the node ends: a drive may hold the last one."""
        if not self._real_time:
            return
        self._loop.fall(time.monotonic_ns())
        while self._loop.due_ns != NEVER:
            time.sleep(max(self._loop.due_ns - time.monotonic_ns(), 0) * 1e-9)
            self._say(self._loop.serve(time.monotonic_ns()))
        self._torque.wait_for_all_acked(Duration(seconds=_LAST_WORD_S))

    def _read(self, source: Source, message: bytes) -> tuple[int, float] | None:
        """Return stamp and value of a message; an unreadable one trips, or ends a lockstep."""
        try:
            stamp, value = source.decode(message)
        except LayoutError as error:
            if not self._real_time:
                raise InputError(
                    f"Topic {source.topic}: {error}; publish JointState with one joint."
                ) from None
            at_once = source is self._position
            self._trip(f"a message of {source.topic} is unreadable: {error}", at_once=at_once)
            return None
        if not self._real_time and not math.isfinite(value):
            raise InputError(
                f"Topic {source.topic}: {value} at {stamp * 1e-9:.6f} s; no torque from that."
            )
        return stamp, value

    def _estop(self) -> tuple[bool, str]:
        self._law.trip("emergency stop")
        self._tell_trip()
        return True, self._state

    def _release(self) -> tuple[bool, str]:
        released = self._loop.release(time.monotonic_ns())
        self.due_ns = self._loop.due_ns
        self._tell_trip()
        return released, self._state if released else "nothing has tripped"

    def _tell_trip(self) -> None:
        """Log a trip, or its end, and publish it at once."""
        if self._law.safety.tripped is not self._tripped:
            self._tripped = self._law.safety.tripped
            sentence = f"{self._state}.".capitalize()
            if self._tripped:
                self.get_logger().error(sentence)
            else:
                self.get_logger().info(sentence)
            self.diagnose()

    @property
    def _state(self) -> str:
        tripped = self._law.safety.tripped
        return "ready" if tripped is None else f"tripped: {tripped}; zero torque until released"

    def health(self) -> Health:
        """Return trip and counters of the run."""
        safety, loop = self._law.safety, self._loop
        bad = loop.missing + loop.lost + loop.stale
        samples = loop.answered if self._real_time else self._lockstep.samples
        return Health(
            ERROR if safety.tripped else WARN if bad else OK,
            self._state,
            {
                "mode": self.values["mode"],
                "hardware": str(self.values["hardware"]).lower(),
                "samples": samples,
                "speed (x real time)": self._speed.look(samples, self.values["sample_rate_hz"]),
                "saturated samples": self._law.saturated + safety.saturated,
                "missing references": loop.missing,
                "lost positions": loop.lost,
                "stale positions": loop.stale,
                "position from": self._position.said,
                "reference from": self._reference.said,
                "trips": safety.trips,
                "trip": safety.tripped or "none",
            },
        )

    def owed(self) -> Lack | None:
        """Return the reference that a position waits for, or who is not there to be answered."""
        if self._loop.strange:
            return Lack(
                "a new realization: the one under way began without this controller",
                "`fjr reset` starts one",
            )
        if self._lockstep.waiting_ns is not None:
            reference = f"the reference of {self._lockstep.waiting_ns * 1e-9:.6f} s"
            return self.overdue(reference, "excitation", self._excitations)
        return self.unwritten(self._position.subscription, "simulator") or self.unwritten(
            self._reference.subscription, "excitation"
        )


def main() -> int:
    """Run the node; the console script `controller_node`."""
    program = Program("controller_node", ControllerNode.__doc__, PARAMETERS)
    return spinning.run(ControllerNode, program=program)
