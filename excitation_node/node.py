"""ROS node of the excitation: describes the experiment and streams its reference ahead of time."""

from __future__ import annotations

import struct
import time
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateWriter
from fjr_interface.experiment import Experiment, controller_from_json
from fjr_interface.health import Health
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_interface.real_time import NEVER
from fjr_interface.ros import runtime, spinning
from fjr_interface.ros.program import Program
from fjr_interface.waiting import Lack, start
from fjr_kit.errors import InputError

from . import multisine

STREAM = ParameterGroup(
    Parameter("autostart", True, "", "Play as soon as all is there, without the start service"),
    Parameter(
        "pace",
        "clock",
        "",
        "What the stream must not outrun by more than the window: simulated time, what a recorder "
        "has recorded, or the positions of a drive that publishes no clock",
        choices=("clock", "recorded", "position"),
    ),
    Parameter("window", 1000, "", "Samples streamed ahead", 10, topics.SIGNAL_DEPTH // 2),
    Parameter(
        "describe_controller",
        True,
        "",
        "Wait for the controller's description of itself; false for a controller that gives none",
    ),
    runtime.JOINT_PARAMETER,
    runtime.readers_parameter("controller"),
)
"""How a reference is streamed, whatever it is."""

PARAMETERS = ParameterGroup(
    *multisine.EXCITATION,
    Parameter("level", 0, "", "Level to play, an index into amplitudes_rad", 0, 100_000),
    Parameter("realization", 0, "", "Realization to play", 0, 100_000),
    *STREAM,
)

_PACES = {
    "clock": (Clock, "/clock", runtime.CLOCK_QOS, "simulator"),
    "recorded": (Time, topics.RECORDED_TOPIC, runtime.EXPERIMENT_QOS, "recorder"),
    "position": (JointState, topics.MOTOR_POSITION.topic, runtime.SIGNAL_QOS, "simulator"),
}
_TIME = struct.Struct("<4xiI")  # with this begins the CDR of all three

# What overruns the reader's socket, or its queue in shared memory, is repeated by DDS later.
_BURST = 100
_PAUSE_NS = 2_000_000


class ExcitationNode(runtime.RigNode):
    """Plays one realization at a time; `start` (std_srvs/Trigger) plays the one set by parameters.

    It streams r, at most `window` samples ahead of the pace, and describes the experiment, which
    makes the simulator start, as soon as the controller has taken the new reference.
    """

    def __init__(self, group: ParameterGroup = PARAMETERS) -> None:
        """Create publishers, the pace subscription and the start service."""
        super().__init__("excitation", group)
        self._encode = JointStateWriter("position", self.values["joint"]).encode_many
        self._reference = self.offer(topics.REFERENCE)
        self.claim(self._reference)
        self._description = self.create_publisher(
            String, topics.EXPERIMENT_TOPIC, runtime.EXPERIMENT_QOS
        )
        self._stamps = np.empty(0, np.int64)
        self._sent = 0
        self._sent_ns = self._passed_ns = 0
        self._next_ns = NEVER
        self._controller: dict[str, Any] | None = None
        self._stream_taken: int | None = None
        self._untaken = False
        self._played: Experiment | None = None
        message_type, topic, qos, self._pace_maker = _PACES[self.values["pace"]]
        self._pace = self.create_subscription(message_type, topic, self._on_pace, qos, raw=True)
        self.create_subscription(
            String, topics.CONTROLLER_TOPIC, self._on_controller, runtime.EXPERIMENT_QOS
        )
        self.create_service(Trigger, "~/start", self._on_start)
        if self.values["autostart"]:
            self._prepare()

    def _on_pace(self, message: bytes) -> None:
        seconds, nanoseconds = _TIME.unpack_from(message)
        passed_ns = seconds * 1_000_000_000 + nanoseconds
        # The sample after what was sent may be under way; of ticks only the newest is sure to come.
        # A time beyond that is an earlier realization's, and no pace for this one.
        if self._passed_ns < passed_ns <= max(self._sent_ns, self._unsent_ns):
            self._passed_ns = passed_ns
            if self.due_ns == NEVER and self._next_ns <= passed_ns:
                self.on_time(time.monotonic_ns())

    def _on_controller(self, message: String) -> None:
        description = controller_from_json(message.data)
        taken = description.pop(topics.STREAM_KEY, None)
        description.pop(topics.MODE_KEY, None)
        if taken is None or taken != self._stream_taken:
            self._untaken = False
        self._controller, self._stream_taken = description, taken

    def _on_start(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            experiment = self._prepare()
        except InputError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        response.message = f"level {experiment.level}, realization {experiment.realization}"
        return response

    def _describe(self) -> Experiment:
        return multisine.describe(
            self.values, self.values["level"], self.values["realization"], self._controller
        )

    def _signal(self, experiment: Experiment) -> np.ndarray:
        """Return the reference of an experiment, float64 of shape (samples,) in rad."""
        return multisine.reference(experiment)

    def _prepare(self) -> Experiment:
        """Check the request, then wait for the peers and begin; return what will be played."""
        self._played = experiment = self._describe()
        self._stamps = np.empty(0, np.int64)
        self._next_ns, self._sent_ns = NEVER, 0
        self.wait_until(self._lacking, self._begin)
        return experiment

    def _lacking(self) -> Lack | None:
        if missing := self.unread(self._reference) or self._untaken_by():
            return missing
        if self._description.get_subscription_count() < 1:
            return Lack(f"a subscriber of {self._description.topic_name}", start("simulator"))
        if self._controller is None and self.values["describe_controller"]:
            return Lack(
                "the controller's description on topic controller",
                "set describe_controller:=false for a controller that gives none",
            )
        return None

    def _untaken_by(self) -> Lack | None:
        if not self._untaken:
            return None
        return Lack("the controller to take the reference", f"{start('controller')} anew")

    def _begin(self) -> None:
        experiment = self._describe()
        self._samples = self._signal(experiment)
        self._stamps = experiment.stamps_ns
        self._window_ns = topics.stamp_ns(self.values["window"], experiment.sample_rate_hz)
        self._burst = max(1, min(self.values["window"] // 4, _BURST))
        self._sent = self._sent_ns = self._passed_ns = self._next_ns = 0
        self._untaken = self._stream_taken is not None
        self.on_time(time.monotonic_ns())
        # The description makes the simulator start: never before the controller has left the old
        # reference, or it would answer the first position with that.
        description = String(data=experiment.to_json())
        self.wait_until(self._unready, lambda: self._description.publish(description))

    def _unready(self) -> Lack | None:
        return self._untaken_by() or (None if self.due_ns == NEVER else Lack("the first window"))

    @property
    def _unsent_ns(self) -> int:
        """Stamp of the first sample that is not sent (ns); 0 if all are."""
        return int(self._stamps[self._sent]) if self._sent < self._stamps.size else 0

    @property
    def _over(self) -> bool:
        """Whether the pace has reached the end of the reference."""
        return self._stamps.size > 0 and self._passed_ns >= self._stamps[-1]

    def owed(self) -> Lack | None:
        """Return that nobody keeps the pace of what is being played."""
        if not self._stamps.size or self._over:
            return None
        return self.unwritten(self._pace, self._pace_maker)

    def health(self) -> Health:
        """Return how much of the reference is streamed."""
        if self._played is None:
            return Health(summary="waiting to be started")
        what = f"level {self._played.level}, realization {self._played.realization}"
        if not self._stamps.size:
            return Health(summary=f"waiting to play {what}")
        return Health(
            summary=f"{'finished' if self._over else 'playing'} {what}",
            values={"samples streamed": self._sent, "samples": int(self._stamps.size)},
        )

    def on_time(self, now_ns: int) -> None:
        """Publish one burst if it lies within the window beyond the pace; look again soon."""
        if self._passed_ns < self._next_ns:
            self.due_ns = NEVER
            return
        part = slice(self._sent, self._sent + self._burst)
        stamps = self._stamps[part]
        for message in self._encode(stamps, self._samples[part]):
            self._reference.publish(message.tobytes())
        self._sent, self._sent_ns = self._sent + stamps.size, int(stamps[-1])
        following = self._stamps[self._sent : self._sent + self._burst]
        self._next_ns = int(following[-1]) - self._window_ns if following.size else NEVER
        self.due_ns = now_ns + _PAUSE_NS


def main() -> int:
    """Run the node; the console script `excitation_node`."""
    program = Program("excitation_node", ExcitationNode.__doc__, PARAMETERS)
    return spinning.run(ExcitationNode, program=program)
