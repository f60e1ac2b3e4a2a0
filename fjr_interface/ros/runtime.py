"""What the three nodes share of ROS: QoS profiles, and parameters from their descriptions."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidParameterValueException
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from fjr_kit.errors import InputError

from ..health import Health
from ..parameters import Parameter, ParameterGroup
from ..real_time import NEVER
from ..topics import JOINT, NAMESPACE, SIGNAL_DEPTH, Signal
from ..waiting import Lack, Waiting
from . import fast_dds
from .graph_node import GraphNode, Values
from .messages import plain, to_descriptor, to_diagnostics

# Discovery stays on this machine unless the user's environment asks otherwise: a rehearsal must
# not move hardware on the network. Both are read by rclpy.init().
if not os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE"):
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
fast_dds.set_defaults(os.environ)

SIGNAL_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=SIGNAL_DEPTH,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
)
EXPERIMENT_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
CLOCK_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)

JOINT_PARAMETER = Parameter("joint", JOINT, "", "Joint name in name[0] of the messages")

_LOOK_S = 1.0  # between two looks at how the node is
_AWAIT_S = 0.01  # between two looks for what is awaited


def readers_parameter(*nodes: str) -> Parameter:
    """Return the parameter that names whose subscriptions a node awaits before its first sample."""
    return Parameter(
        "readers",
        ",".join(nodes),
        "",
        "Nodes that must subscribe to the published signal before the first sample, separated by "
        "commas; empty for any one",
    )


def take_all(subscription: Subscription) -> list:
    """Return everything that has arrived, without an executor: one look serves many messages."""
    taken = []
    handle, kind, raw = subscription.handle, subscription.msg_type, subscription.raw
    with handle:
        while (message := handle.take_message(kind, raw)) is not None:
            taken.append(message[0])
    return taken


class RigNode(GraphNode):
    """A node of the rig whose parameters come from one description.

    `values` holds the checked values; a change through ROS is checked first and refused with a
    sentence. Nodes read `values` when a realization starts, so a run is never half one, half other.
    """

    def __init__(self, name: str, group: ParameterGroup, **node_options: Any) -> None:
        """Declare the group's parameters; raise InputError if an override is refused."""
        super().__init__(name, namespace=NAMESPACE, **node_options)
        self.group = group
        self.failure: InputError | None = None
        self._wait: Timer | None = None
        self._missing: Callable[[], Lack | None] = lambda: None
        self._waiting = Waiting()
        self.due_ns = NEVER
        for parameter in group:
            self._declare(parameter)
        for override in self._parameter_overrides:
            if not self.has_parameter(override) and not override.startswith("qos_overrides."):
                group[override]  # raises with the nearest name
        self.check(self.values)
        self.add_on_set_parameters_callback(self._refuse_bad_values)
        self.add_post_set_parameters_callback(self._take_values)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.call_every(_LOOK_S, self._look)

    def check(self, values: Values) -> None:
        """Raise InputError if values, each of them good, don't go together."""

    def values_changed(self) -> None:
        """Do what a change of `values` asks for."""

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], *args: Any, **kw: Any
    ) -> Subscription:
        """Subscribe; an InputError in the callback ends the node with that sentence."""
        ending = self._ending_node(callback)
        return super().create_subscription(msg_type, topic, ending, *args, **kw)

    def offer(self, signal: Signal) -> Publisher:
        """Publish a signal of the rig."""
        return self.create_publisher(JointState, signal.topic, SIGNAL_QOS)

    def hear(self, signal: Signal, callback: Callable[[bytes], None]) -> Subscription:
        """Subscribe to the serialized messages of a signal of the rig."""
        return self.create_subscription(JointState, signal.topic, callback, SIGNAL_QOS, raw=True)

    def call_every(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Create a timer of the machine's time, whatever clock the node is told to use.

        An InputError in the callback ends the node with that sentence.
        """
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        return self.create_timer(period_s, self._ending_node(callback), clock=clock)

    def create_trigger(self, name: str, do: Callable[[], tuple[bool, str]]) -> None:
        """Offer a service of type std_srvs/Trigger; `do` returns success and message.

        An InputError is answered as failure, with its sentence.
        """

        def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            try:
                response.success, response.message = do()
            except InputError as error:
                response.success, response.message = False, str(error)
            return response

        self.create_service(Trigger, name, answer)

    def _ending_node(self, callback: Callable[..., None]) -> Callable[..., None]:
        """Return the callback with InputErrors kept in `failure`, which ends the node.

        The executor would log an exception that leaves a callback as a traceback.
        """

        def called(*message: Any) -> None:
            try:
                callback(*message)
            except InputError as error:
                self.failure = error

        return called

    def _declare(self, parameter: Parameter) -> None:
        default = parameter.default
        default = list(default) if isinstance(default, tuple) else default
        try:
            declared = self.declare_parameter(parameter.name, default, to_descriptor(parameter))
            self.values[parameter.name] = parameter.check(plain(declared.value))
        except InvalidParameterValueException:
            override = self._parameter_overrides[parameter.name]
            parameter.check(plain(override.value))
            raise

    def _refuse_bad_values(self, changes: Sequence[rclpy.Parameter]) -> SetParametersResult:
        values = dict(self.values)
        try:
            for change in changes:
                if change.name in self.group:
                    values[change.name] = self.group[change.name].check(plain(change.value))
            self.check(values)
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _take_values(self, changes: Sequence[rclpy.Parameter]) -> None:
        for change in changes:
            if change.name in self.group:
                self.values[change.name] = self.group[change.name].check(plain(change.value))
        self.values_changed()

    def wait_until(self, missing: Callable[[], Lack | None], then: Callable[[], None]) -> None:
        """Call `then` once nothing is missing; meanwhile say every few seconds what is.

        Args:
            missing: returns what is still waited for, None if nothing.
            then: what to do when all is there.
        """
        self.stop_waiting()
        self._missing = missing

        def look() -> None:
            if missing() is None:
                self.stop_waiting()
                self.begun = True
                then()

        self._wait = self.call_every(_AWAIT_S, look)
        look()

    def stop_waiting(self) -> None:
        """End the wait under way, if there is one."""
        if self._wait is not None:
            self.destroy_timer(self._wait)
            self._wait = None

    def on_time(self, now_ns: int) -> None:
        """Do what was due by `due_ns`, an instant of the steady clock, and set the next one."""

    def health(self) -> Health:
        """Return how the node is, for /diagnostics; asked about once a second."""
        return Health()

    def diagnose(self) -> None:
        """Publish how the node is on /diagnostics."""
        name = self.get_fully_qualified_name()[1:]
        health = self._waiting.mark(self.health(), time.monotonic_ns())
        message = to_diagnostics(name, self.values["joint"], health)
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def leave(self) -> None:
        """Say what others must still hear before the node ends."""

    def owed(self) -> Lack | None:
        """Return the message that others owe this node in a run, None if none."""
        return None

    def _look(self) -> None:
        now_ns = time.monotonic_ns()
        self._waiting.look(self._missing() if self._wait is not None else self.owed(), now_ns)
        if (sentence := self._waiting.sentence(now_ns)) is not None:
            self.get_logger().info(sentence)
        self.diagnose()
