"""Questions to a node of the rig that has something to say of itself."""

from __future__ import annotations

import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from fjr_kit.errors import InputError

ANSWER_S = 1.0
"""How long an answer is waited for."""
_POLL_S = 0.01


def answer_of(
    service: str, node: Node, executor: SingleThreadedExecutor
) -> Trigger.Response | None:
    """Return the answer of a service; None if nobody offers it or no answer comes.

    Args:
        service: its name in the namespace of the node, of type std_srvs/Trigger.
        node: which asks.
        executor: of the node, spun meanwhile.
    """
    client = node.create_client(Trigger, service)
    until = time.monotonic() + ANSWER_S
    future = None
    while time.monotonic() < until and not (future and future.done()):
        executor.spin_once(timeout_sec=_POLL_S)
        if future is None and client.service_is_ready():
            future = client.call_async(Trigger.Request())
    node.destroy_client(client)
    return future.result() if future and future.done() else None


def refuse_trip(node: Node, executor: SingleThreadedExecutor) -> None:
    """Refuse a realization in which the controller held the torque at zero.

    Args:
        node: which asks the controller.
        executor: of the node, spun meanwhile.

    Raises:
        InputError: the controller says that it has tripped.
    """
    answer = answer_of("controller/status", node, executor)
    if answer is not None and not answer.success:
        raise InputError(f"The realization is not kept: the controller {answer.message}.")
