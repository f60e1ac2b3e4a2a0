"""ROS node between the rig's topics and those of `joint_state_topic_hardware_interface`.

`python -m fjr_bringup.bridge serve` lets a controller manager of ros2_control command the simulated
drive in lockstep; `python -m fjr_bringup.bridge observe` gives the topics of a rig that runs under
ros2_control the form of the rig's contract.
"""

from __future__ import annotations

import sys

from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, LayoutError
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program, refuse
from fjr_interface.waiting import Lack, start
from fjr_kit.errors import InputError

from .mapping import Answers, CommandReader, Observer, Sample

_TOPICS = (
    Parameter("joint_states_topic", "/robot_joint_states", "", "Topic of the joint states"),
    Parameter("joint_commands_topic", "/robot_joint_commands", "", "Topic of the joint commands"),
    Parameter("joint", topics.JOINT, "", "Joint of the ros2_control tag, and in our messages"),
)
SERVE = ParameterGroup(
    *_TOPICS,
    Parameter(
        "echo_joint",
        "",
        "",
        "Joint whose state is the number of the sample and whose effort command returns it; empty "
        "without",
    ),
    Parameter("reference_joint", "", "", "Joint whose state is the reference; empty without"),
    Parameter(
        "answer",
        2,
        "",
        "Without an echo: which command after a position answers it; 1 if there is one for each "
        "position, 2 for a controller manager that runs freely",
        1,
        10,
    ),
    runtime.readers_parameter("simulator"),
)
OBSERVE = ParameterGroup(
    *_TOPICS,
    Parameter("sample_rate_hz", 1000.0, "Hz", "Rate of the joint states", 1.0, 20_000.0),
    Parameter(
        "reference_topic", "", "", "JointState whose position is the reference; empty without"
    ),
    Parameter("reference_joint", "", "", "Joint in those messages; empty for their first position"),
    runtime.readers_parameter(),
)

_RESEND_S = 0.2


class ServingBridge(runtime.RigNode):
    """Gives positions to a controller manager as joint states, and its commands back as torques.

    Velocity is the backward difference of the position, effort the torque held until then. With an
    echo joint a state that got no answer is sent again: the hardware component reads states best
    effort.
    """

    def __init__(self) -> None:
        """Create publishers and subscriptions."""
        super().__init__("bridge", SERVE)
        values = self.values
        echo, reference = str(values["echo_joint"]), str(values["reference_joint"])
        self._joint, self._topic = str(values["joint"]), str(values["joint_commands_topic"])
        self._answers = Answers(int(str(values["answer"])), bool(echo))
        self._state = JointState(name=[self._joint, *filter(None, (reference, echo))])
        self._decode_command = CommandReader(self._topic, self._joint, echo).decode
        self._decode = JointStateReader("position").decode
        self._encode = JointStateWriter("effort", self._joint).encode
        self._has_reference, self._has_echo = bool(reference), bool(echo)
        self._references: dict[int, float] = {}
        self._newest_reference = 0
        self._number = 0
        self._position: tuple[int, float] | None = None
        self._ready = False
        self._before, self._held = (0, 0.0), 0.0
        states = str(values["joint_states_topic"])
        self._states = self.create_publisher(JointState, states, runtime.SIGNAL_QOS)
        self._torque = self.offer(topics.MOTOR_TORQUE)
        self.claim(self._torque)
        self._commands = self.create_subscription(
            JointState, self._topic, self._on_command, runtime.SIGNAL_QOS, raw=True
        )
        self._positions = self.hear(topics.MOTOR_POSITION, self._on_position)
        if reference:
            self.hear(topics.REFERENCE, self._on_reference)
        if echo:
            self.call_every(_RESEND_S, self._send_again)

    def _on_reference(self, message: bytes) -> None:
        stamp, value = _decoded(self._decode, message, topics.REFERENCE.topic)
        if stamp <= self._newest_reference:
            self._references.clear()
        self._newest_reference = stamp
        self._references[stamp] = value
        self._ask()

    def _on_position(self, message: bytes) -> None:
        stamp, position = _decoded(self._decode, message, topics.MOTOR_POSITION.topic)
        self._position = stamp, position
        if self._ready and stamp > self._before[0]:
            self._ask()
        else:
            self.wait_until(self._lacking, self._begin)

    def _lacking(self) -> Lack | None:
        manager = "the controller manager"
        if missing := self.unread(self._torque) or self.unwritten(self._commands, manager):
            return missing
        if self._states.get_subscription_count() < 1:
            states = self._states.topic_name
            return Lack(f"a controller manager that subscribes to {states}", start(manager))
        return None

    def _begin(self) -> None:
        self._ready = True
        self._before, self._held = (0, 0.0), 0.0
        self._ask()

    def _ask(self) -> None:
        """Send the state if the sample is complete."""
        if self._position is None or not self._ready:
            return
        stamp, position = self._position
        if self._has_reference and stamp not in self._references:
            return
        self._position = None
        self._number += 1
        before, self._before = self._before, (stamp, position)
        velocity = (position - before[1]) / ((stamp - before[0]) * 1e-9) if before[0] else 0.0
        others = [self._references.pop(stamp)] if self._has_reference else []
        others += [float(self._number)] if self._has_echo else []
        state = self._state
        state.header.stamp.sec, state.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        state.position = [position, *others]
        state.velocity = [velocity] + [0.0] * len(others)
        state.effort = [self._held] + [0.0] * len(others)
        self._answers.ask(stamp, self._number)
        self._states.publish(state)

    def _send_again(self) -> None:
        if self._answers.stamp_ns:
            self._states.publish(self._state)

    def _on_command(self, message: bytes) -> None:
        stamp = self._answers.stamp_ns
        torque = self._answers.take(self._decode_command(message))
        if torque is not None:
            self._held = torque
            self._torque.publish(self._encode(stamp, torque))

    def owed(self) -> Lack | None:
        """Return what a position waits for, or that nobody publishes positions."""
        if self._position is not None:
            return Lack(f"the reference of {self._position[0] * 1e-9:.6f} s", start("excitation"))
        if missing := self._answers.missing(self._topic, self._joint):
            return Lack(missing)
        return self.unwritten(self._positions, "simulator")


class ObservingBridge(runtime.RigNode):
    """Publishes what a rig under ros2_control does as reference, motor_position and motor_torque.

    It only listens: samples are numbered from 1 and stamped k Ts, as the contract wants them. A rig
    that does not fit on that grid is refused and named.
    """

    def __init__(self) -> None:
        """Create publishers and subscriptions."""
        super().__init__("bridge", OBSERVE)
        values = self.values
        joint, reference = str(values["joint"]), str(values["reference_topic"])
        states, commands = str(values["joint_states_topic"]), str(values["joint_commands_topic"])
        self._rate = float(str(values["sample_rate_hz"]))
        self._observer = Observer((states, commands), self._rate, bool(reference))
        self._inputs = {states: self._on_state, commands: self._on_command}
        if reference:
            self._inputs[reference] = self._on_reference
        self._topics = (states, reference)
        self._decode_command = CommandReader(commands, joint).decode
        self._decode = JointStateReader("position", joint).decode
        named = str(values["reference_joint"]) or None
        self._decode_reference = JointStateReader("position", named).decode
        signals = [s for s in topics.SIGNALS if reference or s is not topics.REFERENCE]
        self._encoders = {
            signal.symbol: JointStateWriter(signal.field, joint).encode for signal in signals
        }
        self._writers = {signal.symbol: self.offer(signal) for signal in signals}
        for writer in self._writers.values():
            self.claim(writer)
        self.wait_until(self._lacking, self._begin)

    def _lacking(self) -> Lack | None:
        for topic in self._inputs:
            if self.count_publishers(topic) < 1:
                return Lack(f"a publisher of {topic}", "start the rig under ros2_control")
        return next(filter(None, map(self.unread, self._writers.values())), None)

    def _begin(self) -> None:
        """Subscribe to each topic as reliably as it is published."""
        for topic, callback in self._inputs.items():
            offered = [
                each.qos_profile.reliability for each in self.get_publishers_info_by_topic(topic)
            ]
            reliable = all(each == ReliabilityPolicy.RELIABLE for each in offered)
            qos = QoSProfile(
                depth=topics.SIGNAL_DEPTH,
                reliability=ReliabilityPolicy.RELIABLE
                if reliable
                else ReliabilityPolicy.BEST_EFFORT,
            )
            self.create_subscription(JointState, topic, callback, qos, raw=True)
        self.get_logger().info(
            f"Samples of {self.values['joint']} count from the first state that a command answers."
        )

    def _on_state(self, message: bytes) -> None:
        stamp, position = _decoded(self._decode, message, self._topics[0])
        self._publish(self._observer.add_state(stamp, position))

    def _on_command(self, message: bytes) -> None:
        self._publish(self._observer.add_command(self._decode_command(message)))

    def _on_reference(self, message: bytes) -> None:
        stamp, reference = _decoded(self._decode_reference, message, self._topics[1])
        self._publish(self._observer.add_reference(stamp, reference))

    def _publish(self, samples: list[Sample]) -> None:
        for sample in samples:
            stamp = topics.stamp_ns(sample.number, self._rate)
            values = {"r": sample.reference, "y": sample.position, "u": sample.torque}
            for symbol, writer in self._writers.items():
                value = values[symbol]
                assert value is not None
                writer.publish(self._encoders[symbol](stamp, value))


def _decoded(decode, message: bytes, topic: str) -> tuple[int, float]:
    try:
        return decode(message)
    except LayoutError as error:
        raise InputError(f"Topic {topic}: {error}; name the joint as the messages do.") from None


BRIDGES = {"serve": (ServingBridge, SERVE), "observe": (ObservingBridge, OBSERVE)}
_NAME = "python -m fjr_bringup.bridge"


def main() -> int:
    """Run the bridge in the direction that the first argument names."""
    direction, *arguments = sys.argv[1:] or [""]
    if direction in BRIDGES:
        bridge, parameters = BRIDGES[direction]
        program = Program(f"{_NAME} {direction}", bridge.__doc__, parameters)
        return spinning.run(bridge, program=program, arguments=arguments)
    if Program.wants_help(sys.argv[1:]):
        for direction, (bridge, parameters) in BRIDGES.items():
            print(Program(f"{_NAME} {direction}", bridge.__doc__, parameters).help(), end="\n\n")
        return 0
    return refuse(InputError("say serve or observe before --ros-args."))
