"""What the three nodes share of ROS: QoS profiles, parameters from descriptions, start and stop.

The only module of this package that imports rclpy.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import InvalidParameterValueException
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_srvs.srv import Trigger

from . import fast_dds
from .errors import InputError
from .health import Health
from .parameters import Parameter, ParameterGroup
from .real_time import NEVER
from .ros_messages import plain, to_descriptor, to_diagnostics
from .stopping import Stopping
from .topics import JOINT, NAMESPACE, SIGNAL_DEPTH

# Discovery stays on this machine unless the user's environment asks otherwise: a rehearsal must
# not move hardware on the network. Both are read by rclpy.init().
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
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

Values = dict[str, Any]
"""Checked parameter values by name."""

_PATIENCE_S = 3.0  # before and between messages about what is waited for
_DIAGNOSTICS_S = 1.0
_IDLE_S = 0.2  # between two looks for Ctrl-C where nothing happens


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


class RigNode(Node):
    """A node of the rig whose parameters come from one description.

    `values` holds the checked values; a change through ROS is checked first and refused with a
    sentence. Nodes read `values` when a realization starts, so a run is never half one, half other.
    """

    def __init__(self, name: str, group: ParameterGroup, **node_options: Any) -> None:
        """Declare the group's parameters; raise InputError if an override is refused."""
        super().__init__(name, namespace=NAMESPACE, **node_options)
        self.group = group
        self.values: Values = {}
        self.failure: InputError | None = None
        self._wait: Timer | None = None
        self._missing: Callable[[], str | None] = lambda: None
        self._said_before: str | None = None
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
        self.call_every(_PATIENCE_S, self._say_what_is_waited_for)
        self.call_every(_DIAGNOSTICS_S, self.diagnose)

    def check(self, values: Values) -> None:
        """Raise InputError if values, each of them good, don't go together."""

    def values_changed(self) -> None:
        """Do what a change of `values` asks for."""

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], *args: Any, **kw: Any
    ) -> Subscription:
        """Subscribe; an InputError in the callback ends the node with that sentence."""
        guarded = self._guard(callback)
        return super().create_subscription(msg_type, topic, guarded, *args, **kw)

    def call_every(self, period_s: float, callback: Callable[[], None]) -> Timer:
        """Create a timer of the machine's time, whatever clock the node is told to use.

        An InputError in the callback ends the node with that sentence.
        """
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        return self.create_timer(period_s, self._guard(callback), clock=clock)

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

    def _guard(self, callback: Callable[..., None]) -> Callable[..., None]:
        # An exception that leaves a callback is logged by the executor as a traceback.
        def guarded(*message: Any) -> None:
            try:
                callback(*message)
            except InputError as error:
                self.failure = error

        return guarded

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

    def wait_until(
        self, missing: Callable[[], str | None], then: Callable[[], None], period_s: float = 0.01
    ) -> None:
        """Call `then` once nothing is missing; meanwhile say every few seconds what is.

        Args:
            missing: returns what is still waited for, None if nothing.
            then: what to do when all is there.
            period_s: time between two looks.
        """
        self.stop_waiting()
        self._missing = missing

        def look() -> None:
            if missing() is None:
                self.stop_waiting()
                then()

        self._wait = self.call_every(period_s, look)
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
        message = to_diagnostics(name, self.values["joint"], self.health())
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)

    def leave(self) -> None:
        """Say what others must still hear before the node ends."""

    def owed(self) -> str | None:
        """Return the message that others owe this node in a run, None if none."""
        return None

    def _say_what_is_waited_for(self) -> None:
        what = self._missing() if self._wait is not None else self.owed()
        if what is not None and what == self._said_before:
            self.get_logger().info(f"Waiting for {what}.")
        self._said_before = what

    def unread(self, publisher: Publisher) -> str | None:
        """Return which readers of a signal are not there yet, None if all are.

        Those named by the parameter `readers` must be there, and whoever else is known must be
        matched: then nobody misses the first sample.
        """
        topic = publisher.topic_name
        readers = [
            reader.node_name
            for reader in self.get_subscriptions_info_by_topic(topic)
            if reader.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL
        ]
        wanted = [name.strip() for name in str(self.values["readers"]).split(",")]
        missing = [name for name in wanted if name and name not in readers]
        if missing:
            return f"{' and '.join(missing)} to subscribe to {topic}"
        if publisher.get_subscription_count() < max(len(readers), 1):
            return f"the subscribers of {topic}"
        return None

    def unwritten(self, subscription: Subscription) -> str | None:
        """Return that a subscription has no publisher yet, None if it has."""
        if subscription.get_publisher_count() < 1:
            return f"a publisher of {subscription.topic_name}"
        return None


def run(*factories: Callable[[], RigNode]) -> int:
    """Spin the nodes that the factories make, in this process, until shutdown; return exit status.

    Ctrl-C and SIGTERM end it quietly with 0; an InputError, at start or later, is printed as one
    sentence and gives 2. However it ends, each node says its last word before it leaves.
    """
    nodes: list[RigNode] = []
    with Stopping() as stopping:
        try:
            # ROS would end the communication at once, before a controller takes its torque down.
            rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
            executor = EventsExecutor()
            for factory in factories:
                nodes.append(factory())
                executor.add_node(nodes[-1])
            _spin(executor, nodes, stopping)
        except (KeyboardInterrupt, ExternalShutdownException):
            pass
        except InputError as error:
            print(f"error: {error}", file=sys.stderr, flush=True)
            return 2
        except rclpy_implementation.RCLError as error:
            if rclpy.ok():
                raise
            print(f"error: ROS refuses the arguments: {error}", file=sys.stderr, flush=True)
            return 2
        finally:
            stopping.only_asks()
            for node in nodes:
                node.leave()
            for node in nodes:
                node.destroy_node()
            rclpy.try_shutdown()
    return 0


def _spin(executor: Any, nodes: Sequence[RigNode], stopping: Stopping) -> None:
    """Spin until somebody wants it to stop; raise the first failure of a node.

    What is due by the steady clock is served between two events: a timer of ROS would be later.
    """
    stopping.only_asks()
    while not stopping.asked:
        wait_s = _IDLE_S
        if (due_ns := min([node.due_ns for node in nodes])) != NEVER:
            wait_s = min(max(due_ns - time.monotonic_ns(), 0) * 1e-9, wait_s)
        executor.spin_once(timeout_sec=wait_s)  # EventsExecutor.spin() serves no timer, no signal
        for node in nodes:
            if node.due_ns != NEVER and node.due_ns <= (now_ns := time.monotonic_ns()):
                node.on_time(now_ns)
            if node.failure is not None:
                raise node.failure
