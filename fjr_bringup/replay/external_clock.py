"""The time of another program's /clock, which a replay follows."""

from __future__ import annotations

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from fjr_interface.ros import runtime
from fjr_interface.topics import clock_ns
from fjr_kit.errors import InputError

from .messages import CLOCK


class ExternalClock:
    """The /clock of another program, such as a simulator."""

    def __init__(self, node: Node) -> None:
        """Subscribe on a node that no executor spins."""
        self._subscription = node.create_subscription(
            Clock, CLOCK, lambda _: None, runtime.CLOCK_QOS, raw=True
        )
        self._now_ns: int | None = None
        self._begun_ns = 0

    def begin(self) -> bool:
        """Count from now; return whether there is a time."""
        self._look()
        self._begun_ns = self._now_ns or 0
        return self._now_ns is not None

    def passed_s(self) -> float:
        """Return the time since the beginning; raise InputError if it has gone back."""
        self._look()
        passed = (self._now_ns or 0) - self._begun_ns
        if passed < 0:
            raise InputError(f"{CLOCK} has gone back to before the replay began; begin it again.")
        return passed * 1e-9

    def _look(self) -> None:
        for message in runtime.take_all(self._subscription):
            self._now_ns = clock_ns(message)
