"""Talks to a rig that was started by hand, as the `ros2` command would."""

from __future__ import annotations

import os
import time
from collections.abc import Collection
from contextlib import ExitStack
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from fjr_interface.ros.session import ros_session
from fjr_interface.topics import NAMESPACE, NODES, WRITERS, checked_namespace
from fjr_interface.waiting import start
from fjr_kit.errors import InputError

from .domain import own_domain, reach

_FIND_S = 5.0
_ANSWER_S = 5.0
_AGAIN_S = 1.0  # an answer may be lost while the two are finding each other
_FOUND_S = 0.1
_POLL_S = 0.02
_LEVELS = ("ok", "WARN", "ERROR", "stale")


class Rig:
    """The nodes of the ROS domain that the environment names; a context manager."""

    def __init__(self, namespace: str = NAMESPACE) -> None:
        """Prepare to talk to the nodes in a namespace; raise InputError if it is none."""
        self._namespace = checked_namespace(namespace)

    def __enter__(self) -> Rig:
        """Join the domain; raise InputError if the environment names none."""
        own_domain()
        self._stack = ExitStack()
        self._stack.enter_context(ros_session())
        self._node = rclpy.create_node(f"fjr_{os.getpid()}", namespace=self._namespace)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._stack.close()

    def trigger(self, service: str) -> str:
        """Call a service of type std_srvs/Trigger; return its message.

        Args:
            service: one that may be called twice, such as simulator/pause.

        Raises:
            InputError: nobody offers it, it refuses, or no answer comes.
        """
        return _message(self._call(Trigger, service, Trigger.Request()))

    def step(self, steps: int) -> str:
        """Play so many samples of a paused simulation; return its status when they are done.

        Raises:
            InputError: there is no simulator, it is not paused, or it gives the steps up.
        """
        self.set("simulator", "steps", steps)
        self.trigger("simulator/status")
        service = "simulator/step"
        return _message(self._call(Trigger, service, Trigger.Request(), once=True))

    def set(self, node: str, name: str, value: float | int) -> None:
        """Set a parameter of a node.

        Raises:
            InputError: there is no such node, or it refuses the value.
        """
        if isinstance(value, int):
            typed = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
        else:
            typed = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
        request = SetParametersAtomically.Request()
        request.parameters = [Parameter(name=name, value=typed)]
        service = f"{node}/set_parameters_atomically"
        result = self._call(SetParametersAtomically, service, request).result
        if not result.successful:
            raise InputError(_sentence(result.reason))

    def status(self) -> str:
        """Return what every node of the rig does, and which one is missing, as a person reads it.

        Raises:
            InputError: no node says anything.
        """
        heard = {_node(status.name): status for status in self._diagnostics()}
        absent = [self._absence(node) for node in NODES if node not in heard]
        return "\n".join([*absent, *map(_describe, heard, heard.values())])

    def _absence(self, node: str) -> str:
        """Return what is known of a node of the rig that says nothing."""
        topic = f"{self._namespace}/{WRITERS[node].topic}"
        writers = {
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in self._node.get_publishers_info_by_topic(topic)
        }
        if f"{self._namespace}/{node}" in writers:
            silent = "it says nothing: it hangs, or it was killed a moment ago"
            return f"{node}: SILENT, {silent}; end it, {start(node)}, then `fjr reset`"
        if writers:
            return f"{node}: none, {' and '.join(sorted(writers))} publishes {topic} in its place"
        return f"{node}: MISSING, nobody publishes {topic}; {start(node)}"

    def _diagnostics(self) -> list[DiagnosticStatus]:
        """Return the newest diagnostics of every node of the rig, by name."""
        heard: dict[str, DiagnosticStatus] = {}
        ours = self._namespace[1:]

        def hear(message: DiagnosticArray) -> None:
            statuses = {status.name: status for status in message.status}
            heard.update({k: v for k, v in statuses.items() if _namespace(k) == ours})

        subscription = self._node.create_subscription(DiagnosticArray, "/diagnostics", hear, 10)
        until = time.monotonic() + _FIND_S
        while time.monotonic() < until and not self._all_in(heard):
            self._executor.spin_once(timeout_sec=_POLL_S)
        self._node.destroy_subscription(subscription)
        if not heard:
            raise InputError(self._not_found("no node publishes diagnostics"))
        return [heard[name] for name in sorted(heard)]

    def _all_in(self, heard: Collection[str]) -> bool:
        """Return whether a whole rig, and whoever else is found, has been heard.

        While one of its nodes is missing nobody knows whether it is there: nodes of a busy rig are
        found a second or more after each other.
        """
        nodes = set(map(_node, heard))
        writers = self._node.get_publishers_info_by_topic("/diagnostics")
        found = sum(writer.node_namespace == self._namespace for writer in writers)
        return nodes >= set(NODES) and found <= len(heard)

    def _not_found(self, what: str) -> str:
        domain = os.environ.get("ROS_DOMAIN_ID") or "0"
        return (
            f"No rig is found in ROS domain {domain}, namespace {self._namespace} ({what}; "
            f"{reach()}); start its nodes, or set ROS_DOMAIN_ID or FJR_NAMESPACE to theirs."
        )

    def _call(self, kind: Any, service: str, request: Any, *, once: bool = False) -> Any:
        """Return the answer of a service; one that is called once is waited for without end."""
        client = self._node.create_client(kind, service)
        until = time.monotonic() + _FIND_S
        while not client.service_is_ready():
            self._executor.spin_once(timeout_sec=_POLL_S)
            if time.monotonic() > until:
                raise InputError(self._not_found(f"nobody offers {client.srv_name}"))
        # The node drops its answer to a client that it has not found yet.
        self._executor.spin_once(timeout_sec=_FOUND_S)
        calls = [client.call_async(request)]
        until, again = time.monotonic() + _ANSWER_S, time.monotonic() + _AGAIN_S
        while not any(call.done() for call in calls):
            self._executor.spin_once(timeout_sec=_POLL_S)
            if once:
                continue
            if time.monotonic() > until:
                raise InputError(f"No answer comes from {client.srv_name}; its node hangs.")
            if time.monotonic() > again:
                calls.append(client.call_async(request))
                again += _AGAIN_S
        return next(call.result() for call in calls if call.done())


def _message(answer: Trigger.Response) -> str:
    if not answer.success:
        raise InputError(_sentence(answer.message))
    return str(answer.message)


def _sentence(text: str) -> str:
    """Return a refusal as a sentence."""
    return text if text.endswith(".") else f"It refuses: {text}."


def _namespace(status_name: str) -> str:
    """Return the namespace, without its slash, of the node that a diagnostic status is of."""
    return status_name.split(":")[0].rpartition("/")[0]


def _node(status_name: str) -> str:
    """Return the node that a diagnostic status is of."""
    return status_name.split(":")[0].rpartition("/")[2]


def _describe(node: str, status: DiagnosticStatus) -> str:
    """Return a line about a node, its figures below."""
    lines = [f"{node}: {_LEVELS[min(status.level[0], 3)]}, {status.message}"]
    lines += [f"  {each.key}: {each.value}" for each in status.values]
    return "\n".join(lines)
