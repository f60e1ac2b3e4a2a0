"""The one publisher of each signal to which the controller listens."""

from __future__ import annotations

from rclpy.node import Node
from rclpy.subscription import Subscription

_UNKNOWN = "_NODE_NAME_UNKNOWN_"  # of a publisher whose node has not been heard of yet


class Source:
    """The publishers of one topic.

    Attributes:
        names: full names of their nodes, sorted; one that publishes twice is there twice.
    """

    def __init__(self, node: Node, subscription: Subscription) -> None:
        """Watch the publishers that a subscription of the node hears."""
        self._node, self._subscription = node, subscription
        self._count = 0
        self.names: list[str] = []

    @property
    def said(self) -> str | None:
        """The names in words; None where nobody publishes."""
        return " and ".join(self.names) or None

    def second(self) -> str | None:
        """Return that somebody else is heard, too; None if not. Cheap enough for each message."""
        count = self._subscription.get_publisher_count()
        if count != self._count:
            self.look()
        if count < 2:
            return None
        return (
            f"{self._subscription.topic_name} has {count} publishers ({self.said}); leave one of "
            "them, a killed one is forgotten after 10 s"
        )

    def look(self) -> None:
        """Ask the graph who publishes."""
        self._count = self._subscription.get_publisher_count()
        publishers = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
        self.names = sorted(
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in publishers
            if each.node_name != _UNKNOWN
        )

    def others(self) -> str | None:
        """Return that nodes of different names publish; None if not.

        A node that was killed and started again is no other.
        """
        self.look()
        if len(set(self.names)) < 2:
            return None
        return (
            f"Topic {self._subscription.topic_name} has publishers of different nodes "
            f"({self.said}); stop all but one and start the realization again."
        )
