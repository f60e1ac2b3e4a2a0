"""Stands in for the drive: publishes the recorded positions, in lockstep with the torques.

`python -m fjr_bringup.replay.simulator --ros-args -p bag:=FOLDER`
"""

from __future__ import annotations

import sys

from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, LayoutError
from fjr_interface.experiment import Experiment
from fjr_interface.parameters import ParameterGroup
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_interface.waiting import Lack
from fjr_kit.errors import InputError

from .bag import BAG_PARAMETER, read_recorded

PARAMETERS = ParameterGroup(
    BAG_PARAMETER, runtime.JOINT_PARAMETER, runtime.readers_parameter("controller")
)


class ReplaySimulatorNode(runtime.RigNode):
    """A drive whose positions are a bag's, whatever the torque.

    Each experiment description starts the replay; each torque of the sample's stamp is answered
    with the next position.
    """

    def __init__(self) -> None:
        """Read the bag, create publishers and subscriptions."""
        super().__init__("simulator", PARAMETERS)
        record = read_recorded(str(self.values["bag"])).record
        encoder = JointStateWriter("position", str(self.values["joint"]))
        self._messages = encoder.encode_many(record.stamps_ns, record.position)
        self._stamps = record.stamps_ns.tolist()
        self._decode = JointStateReader("effort").decode
        self._sample = len(self._stamps)
        self._ticks = self.create_publisher(Clock, "/clock", runtime.CLOCK_QOS)
        self._position = self.offer(topics.MOTOR_POSITION)
        self._torque = self.hear(topics.MOTOR_TORQUE, self._on_torque)
        self.create_subscription(
            String, topics.EXPERIMENT_TOPIC, self._on_experiment, runtime.EXPERIMENT_QOS
        )

    def _on_experiment(self, message: String) -> None:
        experiment = Experiment.from_json(message.data, "topic experiment")
        if experiment.stamps_ns.tolist() != self._stamps:
            raise InputError(
                "The experiment has other stamps than the bag; let the same bag give the reference."
            )
        self._sample = 0
        self.wait_until(self._lacking, self._publish_sample)

    def _lacking(self) -> Lack | None:
        return self.unread(self._position) or self.unwritten(self._torque, "controller")

    def _publish_sample(self) -> None:
        self._position.publish(self._messages[self._sample].tobytes())
        self._ticks.publish(topics.clock_message(self._stamps[self._sample]))

    def _on_torque(self, message: bytes) -> None:
        try:
            stamp, _ = self._decode(message)
        except LayoutError as error:
            raise InputError(f"Topic motor_torque: {error}; publish one effort.") from None
        if self._due_ns() != stamp:
            return  # a late answer to a run that was replaced
        self._sample += 1
        if self._sample < len(self._stamps):
            self._publish_sample()

    def _due_ns(self) -> int | None:
        return self._stamps[self._sample] if self._sample < len(self._stamps) else None

    def owed(self) -> Lack | None:
        """Return the torque that the replay waits for."""
        due = self._due_ns()
        return None if due is None else Lack(f"the torque of {due * 1e-9:.6f} s")


def main() -> int:
    """Run the node."""
    program = Program("fjr_bringup.replay.simulator", ReplaySimulatorNode.__doc__, PARAMETERS)
    return spinning.run(ReplaySimulatorNode, program=program)


if __name__ == "__main__":
    sys.exit(main())
