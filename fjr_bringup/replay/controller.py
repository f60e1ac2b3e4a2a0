"""Stands in for the controller: answers each position with the recorded torque of its stamp.

`python -m fjr_bringup.replay.controller --ros-args -p bag:=FOLDER`
"""

from __future__ import annotations

import sys

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter, LayoutError
from fjr_interface.parameters import ParameterGroup
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_kit.errors import InputError

from .bag import BAG_PARAMETER, read_recorded

PARAMETERS = ParameterGroup(
    BAG_PARAMETER, runtime.JOINT_PARAMETER, runtime.readers_parameter("simulator")
)


class ReplayControllerNode(runtime.RigNode):
    """A controller in an open loop: its torque is a bag's, whatever the position.

    A position with the stamp of the first sample starts the replay.
    """

    def __init__(self) -> None:
        """Read the bag, create publisher and subscription."""
        super().__init__("controller", PARAMETERS)
        record = read_recorded(str(self.values["bag"])).record
        encoder = JointStateWriter("effort", str(self.values["joint"]))
        self._messages = encoder.encode_many(record.stamps_ns, record.torque)
        self._stamps = record.stamps_ns.tolist()
        self._decode = JointStateReader("position").decode
        self._sample = 0
        self._torque = self.offer(topics.MOTOR_TORQUE)
        self.hear(topics.MOTOR_POSITION, self._on_position)

    def _on_position(self, message: bytes) -> None:
        try:
            stamp, _ = self._decode(message)
        except LayoutError as error:
            raise InputError(f"Topic motor_position: {error}; publish one position.") from None
        if stamp == self._stamps[0]:
            self._sample = 0
            self.wait_until(lambda: self.unread(self._torque), self._answer)
            return
        due = self._stamps[self._sample] if self._sample < len(self._stamps) else None
        if stamp != due:
            raise InputError(
                f"Topic motor_position: stamp {stamp * 1e-9:.6f} s where "
                + (f"{due * 1e-9:.6f} s was due" if due else "the bag has ended")
                + "; give the simulator the sample rate of the bag and start again."
            )
        self._answer()

    def _answer(self) -> None:
        self._torque.publish(self._messages[self._sample].tobytes())
        self._sample += 1


def main() -> int:
    """Run the node."""
    program = Program("fjr_bringup.replay.controller", ReplayControllerNode.__doc__, PARAMETERS)
    return spinning.run(ReplayControllerNode, program=program)


if __name__ == "__main__":
    sys.exit(main())
