"""ROS node of the controller: pairs r and y by stamp and answers with u of the same stamp."""

from __future__ import annotations

import json
import math
import time

from rclpy.duration import Duration
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, LayoutError
from fjr_interface.experiment import Experiment
from fjr_interface.health import ERROR, OK, WARN, Health, Speed
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import LOCKSTEP, MODE_PARAMETER, NEVER, REAL_TIME, keep_pauses_out
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_interface.waiting import Lack
from fjr_kit.errors import InputError

from . import limits, pd_filtered
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
        self._decode_reference = JointStateReader("position").decode
        self._decode_position = JointStateReader("position").decode
        self._real_time = self.values["mode"] == REAL_TIME
        self._law = SupervisedLaw(self.values, real_time=self._real_time)
        self._loop = RealTimeController(self._law, self.values)
        self._references: dict[int, float] = {}
        self._newest_reference = 0
        self._stream = time.time_ns()  # not one of an earlier controller
        self._position: tuple[int, float] | None = None
        self._ready = False
        self._replaced = False
        self._tripped: str | None = None
        self._speed = Speed()
        self._excitations: frozenset[bytes] = frozenset()
        self._start_run()
        self._torque = self.create_publisher(
            JointState, topics.MOTOR_TORQUE.topic, runtime.SIGNAL_QOS
        )
        self.claim(self._torque)
        self._reference = self.create_subscription(
            JointState, topics.REFERENCE.topic, self._on_reference, runtime.SIGNAL_QOS, raw=True
        )
        self._positions = self.create_subscription(
            JointState,
            topics.MOTOR_POSITION.topic,
            self._on_position_in_real_time if self._real_time else self._on_position,
            runtime.SIGNAL_QOS,
            raw=True,
        )
        self._sources = {
            topics.REFERENCE.topic: Source(self, self._reference),
            topics.MOTOR_POSITION.topic: Source(self, self._positions),
        }
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

    def _start_run(self) -> None:
        self._law.begin_run(self.values)
        self._sample = 0
        self._rate = self.values["sample_rate_hz"]
        self._first_ns = self._due_ns = topics.stamp_ns(1, self._rate)

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
        """Refuse a second publisher: in real time each message looks for one, too."""
        for source in self._sources.values():
            if self._real_time:
                source.look()
                self._refuse_second(source)
            elif others := source.others():
                raise InputError(others)

    def _refuse_second(self, source: Source) -> None:
        if (second := source.second()) and self._law.safety.tripped is None:
            self._trip(second)

    def _on_reference(self, message: bytes) -> None:
        if self._real_time:
            self._refuse_second(self._sources[topics.REFERENCE.topic])
        for each in (message, *runtime.take_all(self._reference)):  # they come in bursts
            try:
                stamp, value = self._decode_reference(each)
            except LayoutError as error:
                self._refuse_unreadable(error, topics.REFERENCE.topic)
                continue
            self._check_number(stamp, value, topics.REFERENCE.topic)
            if stamp <= self._newest_reference or not self._newest_reference:
                self._leave_run()
            self._newest_reference = stamp
            if self._real_time:
                self._loop.reference(stamp, value)
            else:
                self._references[stamp] = value
        self._answer()

    def _leave_run(self) -> None:
        if self._real_time:
            self._loop.leave_run(self.values)
            keep_pauses_out()
        self._references.clear()
        self._stream += 1
        self._describe()
        if self._sample == 1 and self._position is not None:
            return  # a first position that overtook its reference
        self.stop_waiting()
        self._replaced, self._ready, self._position = self._sample > 0, False, None

    def _on_position(self, message: bytes) -> None:
        try:
            stamp, value = self._decode_position(message)
        except LayoutError as error:
            self._refuse_unreadable(error, topics.MOTOR_POSITION.topic)
            return
        self._check_number(stamp, value, topics.MOTOR_POSITION.topic)
        if stamp == self._first_ns:
            self._look_for_others()
            self._start_run()
            self._ready = self._replaced = False
        elif stamp != self._due_ns:
            raise InputError(
                f"Topic motor_position: stamp {stamp * 1e-9:.6f} s where {self._due_ns * 1e-9:.6f} "
                f"s was due at sample_rate_hz {self._rate:g}; give all nodes the same rate and "
                "start the realization again."
            )
        elif self._replaced:
            return  # of the run that the new references replace
        self._sample += 1
        self._due_ns = topics.stamp_ns(self._sample + 1, self._rate)
        self._position = stamp, value
        if self._sample == 1:
            self.wait_until(self._lacking, self._begin)
        else:
            self._answer()

    def _lacking(self) -> Lack | None:
        return self.unread(self._torque) or self.unwritten(self._reference, "excitation")

    def _begin(self) -> None:
        self._ready = True
        self._excitations = self.writers("excitation")
        self._answer()

    def _answer(self) -> None:
        """Publish the torque if the sample is complete: its position and its reference are here."""
        if not self._ready or self._position is None:
            return
        stamp, position = self._position
        reference = self._references.get(stamp)
        if reference is None:
            return
        self._position = None
        self._torque.publish(self._encode(stamp, self._law.torque(reference, position)))
        self._tell_trip()
        # The latest ones stay: a run that is replaced may have used some of the new one's.
        self._references.pop(topics.stamp_ns(self._sample - topics.SIGNAL_DEPTH, self._rate), None)

    def _on_position_in_real_time(self, message: bytes) -> None:
        now_ns = time.monotonic_ns()
        self._refuse_second(self._sources[topics.MOTOR_POSITION.topic])
        try:
            stamp, value = self._decode_position(message)
        except LayoutError as error:
            self._refuse_unreadable(error, topics.MOTOR_POSITION.topic)
            return
        self._say(self._loop.position(now_ns, stamp, value))

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

    def _refuse_unreadable(self, error: LayoutError, topic: str) -> None:
        """Trip at a message that is no JointState of one joint; it ends a lockstep."""
        if not self._real_time:
            raise InputError(f"Topic {topic}: {error}; publish JointState with one joint.")
        at_once = topic == topics.MOTOR_POSITION.topic
        self._trip(f"a message of {topic} is unreadable: {error}", at_once=at_once)

    def _check_number(self, stamp: int, value: float, topic: str) -> None:
        if not self._real_time and not math.isfinite(value):
            raise InputError(
                f"Topic {topic}: {value} at {stamp * 1e-9:.6f} s; no torque from that."
            )

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
        samples = loop.answered if self._real_time else self._sample
        return Health(
            ERROR if safety.tripped else WARN if bad else OK,
            self._state,
            {
                "mode": self.values["mode"],
                "hardware": str(self.values["hardware"]).lower(),
                "samples": samples,
                "speed (x real time)": self._speed.look(samples, self._rate),
                "saturated samples": self._law.saturated + safety.saturated,
                "missing references": loop.missing,
                "lost positions": loop.lost,
                "stale positions": loop.stale,
                "position from": self._sources[topics.MOTOR_POSITION.topic].said,
                "reference from": self._sources[topics.REFERENCE.topic].said,
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
        if self._position is not None:
            reference = f"the reference of {self._position[0] * 1e-9:.6f} s"
            return self.overdue(reference, "excitation", self._excitations)
        return self.unwritten(self._positions, "simulator") or self.unwritten(
            self._reference, "excitation"
        )


def main() -> int:
    """Run the node; the console script `controller_node`."""
    program = Program("controller_node", ControllerNode.__doc__, PARAMETERS)
    return spinning.run(ControllerNode, program=program)
