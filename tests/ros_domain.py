"""For tests of the ROS graph: a domain of their own, and a node that joins."""

from __future__ import annotations

import gc
import random
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from processes import Patience, wait_for

DOMAINS = range(1, 77)
"""Below the domains that campaigns choose themselves."""


@contextmanager
def own_domain() -> Iterator[int]:
    """Hold a ROS domain that no other test of this machine uses, also not one of another job."""
    for domain in random.sample(DOMAINS, len(DOMAINS)):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
            try:
                lock.bind(f"\0fjr-rig-tests/ros-domain-{domain}")
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError("every ROS domain is taken by other tests")


class Peer:
    """A node in the test's own process that stands for other programs in the graph.

    Attributes:
        look_s: how long it lets pass between two looks for messages.
        after_each_look: what it does then.
    """

    def __init__(self, domain: int) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        import fjr_interface.ros.runtime  # noqa: F401 - chooses profiles that rclpy.init reads

        gc.freeze()  # a collection of all that tests have left takes longer than a queue lasts
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("peer", namespace="/rig", context=self.context)
        self._heard: list[tuple[Any, list[Any]]] = []
        self.look_s = 0.01
        self.after_each_look: Callable[[], None] = lambda: None
        self._clients = rclpy.create_node("peer_clients", namespace="/rig", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self._clients)

    def listen(self, message_type: type, topic: str, qos: Any) -> list[Any]:
        """Return the list into which all messages of a topic will go."""
        heard: list[Any] = []
        subscription = self.node.create_subscription(message_type, topic, heard.append, qos)
        self._heard.append((subscription, heard))
        return heard

    def spin_until(self, true: Callable[[], Any], what: str) -> Any:
        """Take part in the graph until a call returns something true; return that."""
        from fjr_interface.ros.runtime import take_all

        def spin() -> Any:
            self._executor.spin_once(timeout_sec=self.look_s)
            for subscription, heard in self._heard:
                heard.extend(take_all(subscription))  # an executor would lag behind the lockstep
            self.after_each_look()
            return true()

        return wait_for(spin, what, pause_s=0.0)

    def call(self, service_type: type, name: str, request: Any) -> Any:
        """Call a service and return its answer; ask again where discovery lost the answer."""
        client = self._clients.create_client(service_type, name)
        self.spin_until(client.service_is_ready, f"the service {name}")
        asked = [client.call_async(request)]
        patience = [Patience()]

        def answer() -> Any:
            patience[-1].look()
            if patience[-1].idle_s > 5.0:
                asked.append(client.call_async(request))
                patience.append(Patience())
            return next((future for future in asked if future.done()), None)

        return self.spin_until(answer, f"an answer of {name}").result()

    def leave(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._clients.destroy_node()
        self.context.try_shutdown()
        gc.unfreeze()
