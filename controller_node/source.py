"""A signal to which the controller listens: its messages, and its one publisher."""

from __future__ import annotations

from collections.abc import Callable

from fjr_interface.bags.joint_state import JointStateReader
from fjr_interface.ros.graph_node import NOT_KNOWN_YET
from fjr_interface.ros.runtime import RigNode
from fjr_interface.topics import Signal


class Source:
    """One signal and its publishers.

    Attributes:
        topic: name of the signal's topic, without the namespace.
        subscription: hears the serialized messages.
        decode: returns stamp (ns) and value of a message; raises LayoutError if it is malformed.
        names: full names of the publishers' nodes, sorted; one that publishes twice is there twice.
    """

    def __init__(self, node: RigNode, signal: Signal, callback: Callable[[bytes], None]) -> None:
        """Let a callback of the node hear a signal."""
        self.topic = signal.topic
        self.subscription = node.hear(signal, callback)
        self.decode = JointStateReader(signal.field).decode
        self._node = node
        self._count = 0
        self._first: str | None = None  # whom the run under way began with
        self.names: list[str] = []

    @property
    def said(self) -> str | None:
        """The names in words; None where nobody publishes."""
        return " and ".join(self.names) or None

    def second(self) -> str | None:
        """Return that somebody else is heard, too; None if not. Cheap enough for each message."""
        count = self.subscription.get_publisher_count()
        if count != self._count:
            self.look()
        if count < 2:
            return None
        return (
            f"{self.subscription.topic_name} has {count} publishers ({self.said}); leave one of "
            "them, a killed one is forgotten after 10 s"
        )

    def replaced(self) -> str | None:
        """Return that another node publishes than when the run began; None if not.

        A node that was killed and started again is no other.
        """
        if len(self.names) != 1:
            return None
        (now,) = self.names
        self._first = self._first or now
        if now == self._first:
            return None
        return (
            f"{self.subscription.topic_name} comes from {now} now, not from {self._first} as when "
            "the run began; begin a new run with one of them"
        )

    def forget(self) -> None:
        """Let another node publish from now on: no run is under way, or a new one begins."""
        self._first = None

    def look(self) -> None:
        """Ask the graph who publishes."""
        self._count = self.subscription.get_publisher_count()
        publishers = self._node.get_publishers_info_by_topic(self.subscription.topic_name)
        self.names = sorted(
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in publishers
            if each.node_name != NOT_KNOWN_YET
        )

    def others(self) -> str | None:
        """Return that nodes of different names publish; None if not.

        A node that was killed and started again is no other.
        """
        self.look()
        if len(set(self.names)) < 2:
            return None
        return (
            f"Topic {self.subscription.topic_name} has publishers of different nodes "
            f"({self.said}); stop all but one and start the realization again."
        )
