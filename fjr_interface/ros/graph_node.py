"""A node that knows the other publishers and readers of the rig's signals."""

from __future__ import annotations

import hashlib
import socket
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from rclpy.subscription import Subscription

from fjr_kit.errors import InputError

from ..topics import WRITERS
from ..waiting import Lack, start
from .claims import claim

Values = dict[str, Any]
"""Checked parameter values by name."""

NOT_KNOWN_YET = "_NODE_NAME_UNKNOWN_"
"""Name of a node that has been discovered, its name not yet."""


class GraphNode(Node):
    """What a node asks of the graph before and in a run.

    Attributes:
        values: its checked parameter values, `readers` among them.
        begun: whether its first run has begun.
    """

    def __init__(self, name: str, **node_options: Any) -> None:
        """Join the graph."""
        super().__init__(name, **node_options)
        self.values: Values = {}
        self.begun = False
        self._claims: list[socket.socket] = []

    def claim(self, publisher: Publisher) -> None:
        """Be the only node of this machine that publishes a signal.

        Raises:
            InputError: another one does.
        """
        topic, domain = publisher.topic_name, self.context.get_domain_id()
        held = claim(f"publisher/{hashlib.sha256(f'{domain}{topic}'.encode()).hexdigest()}")
        if held is None:
            raise _taken("Another node of this machine", topic, domain)
        self._claims.append(held)

    def unread(self, publisher: Publisher) -> Lack | None:
        """Return which readers of a signal are not there yet, None if all are.

        Those named by the parameter `readers` must be there, and whoever else is known must be
        matched: then nobody misses the first sample.

        Raises:
            InputError: before the first run of this node, somebody else publishes the signal.
        """
        topic = publisher.topic_name
        if not self.begun and self._beside_unnamed(topic):
            return Lack(f"the name of the node that publishes {topic} beside this one")
        readers = [
            reader.node_name
            for reader in self.get_subscriptions_info_by_topic(topic)
            if reader.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL
        ]
        wanted = [name.strip() for name in str(self.values["readers"]).split(",")]
        missing = [name for name in wanted if name and name not in readers]
        if missing:
            return Lack(f"{' and '.join(missing)} to subscribe to {topic}", start(*missing))
        if publisher.get_subscription_count() < max(len(readers), 1):
            return Lack(f"the subscribers of {topic}")
        return None

    def _beside_unnamed(self, topic: str) -> bool:
        """Tell whether somebody publishes a topic whose name is not known yet.

        Raises:
            InputError: somebody else publishes it, whose name is known.
        """
        own = self.get_name(), self.get_namespace()
        writers = self.get_publishers_info_by_topic(topic)
        for writer in writers:
            name, namespace = writer.node_name, writer.node_namespace
            if (name, namespace) != own and name != NOT_KNOWN_YET:
                who = f"{namespace.rstrip('/')}/{name}"
                raise _taken(f"The node {who}", topic, self.context.get_domain_id())
        return any(writer.node_name == NOT_KNOWN_YET for writer in writers)

    def unwritten(self, subscription: Subscription, writer: str) -> Lack | None:
        """Return that a subscription has no publisher yet, None if it has.

        Args:
            subscription: to a topic of the rig.
            writer: the node that publishes on it.
        """
        if subscription.get_publisher_count() < 1:
            return Lack(f"a publisher of {subscription.topic_name}", start(writer))
        return None

    def writers(self, node: str) -> frozenset[bytes]:
        """Return the identities of all that publish the signal of a node of the rig."""
        infos = self.get_publishers_info_by_topic(WRITERS[node].topic)
        return frozenset(bytes(info.endpoint_gid) for info in infos)

    def overdue(self, what: str, node: str, at_first: frozenset[bytes]) -> Lack:
        """Return that a message of a run is waited for, and what to do if it does not come.

        Args:
            what: the message.
            node: the node of the rig that owes it.
            at_first: `writers` of that node when the run began.
        """
        again = "`fjr reset` plays the realization from its beginning"
        writers = {each: self.writers(each) for each in (node, *WRITERS)}
        if twice := self._published_twice():
            return Lack(what, f"{twice}: end all but one of them, then {again}")
        if absent := [each for each, found in writers.items() if not found]:
            return Lack(what, f"{start(*absent)}, then {again}")
        if writers[node] - at_first:
            return Lack(what, f"the {node} was started in the middle of the run: {again}")
        return Lack(what, f"{again}; if that does not help, {start(node)} anew")

    def _published_twice(self) -> str:
        """Return which signals of the rig have several publishers, empty if none has."""
        found = []
        for signal in WRITERS.values():
            infos = self.get_publishers_info_by_topic(signal.topic)
            names = [f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in infos]
            if len(names) > 1:
                topic = self.resolve_topic_name(signal.topic)
                found.append(f"{len(names)} nodes publish {topic} ({', '.join(sorted(names))})")
        return " and ".join(found)


def _taken(who: str, topic: str, domain: int) -> InputError:
    return InputError(
        f"{who} publishes {topic} in ROS domain {domain} already; end it, or set another "
        "ROS_DOMAIN_ID."
    )
