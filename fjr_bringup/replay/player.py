"""Publishes a bag: recorded bytes and QoS, the latched description, and /clock by the stamps."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from pathlib import Path

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from fjr_interface.ros import runtime
from fjr_interface.ros.session import ros_session
from fjr_interface.topics import checked_namespace, clock_message
from fjr_kit.errors import InputError
from fjr_kit.stopping import Interruption

from ..campaign.progress import CampaignProgress
from ..graph.domain import own_domain, reach
from .external_clock import ExternalClock
from .messages import CLOCK, Messages, PlayedTopic
from .publishing import Published, PublishedTopic, Publishing

NODE = "replay"

_DISCOVERY_S = 1.0
_PAUSE_S = 0.02
_CLOCK_PAUSE_S = 0.001
_SAY_S = 3.0
_LOOK_S = 0.1
_LAST_S = 4.0  # at the end, for what DDS must repeat: by default every 3 s
_BURST = 50  # messages on one topic between two acknowledgements


def publish_bag(bag: Path, publishing: Publishing, sum_up: Callable[[Published], None]) -> None:
    """Publish a bag.

    Args:
        bag: its folder.
        publishing: what of it, and how.
        sum_up: told at the end, and at Ctrl-C, what was published.

    Raises:
        InputError: the bag cannot be read, a topic is not in it, no namespace, or somebody else
            publishes one.
        KeyboardInterrupt: Ctrl-C; what was published until then was summed up.
    """
    own_domain()  # refused by a sentence, unlike by rclpy
    namespace = checked_namespace(publishing.namespace)
    messages = Messages(bag, publishing.topics, namespace)
    with Interruption() as interruption, ros_session():
        node = rclpy.create_node(NODE, namespace=namespace, start_parameter_services=False)
        player = Player(node, messages, publishing, interruption)
        player.wait()
        try:
            player.play()
        except KeyboardInterrupt:
            sum_up(player.published)
            raise
        sum_up(player.published)


class _Output:
    """One publisher and what has gone through it.

    Fast DDS asks its readers for an acknowledgement at once when the history is full, else only
    with a heartbeat: so a publisher that is to be paced by them has a short history, and fills it.
    """

    def __init__(self, node: Node, topic: PlayedTopic, paced: bool) -> None:
        self.topic = topic
        qos = copy.copy(topic.qos)
        if paced:
            qos.depth = min(qos.depth, _BURST)
        self._depth = qos.depth if paced else math.inf
        self._publisher: Publisher = node.create_publisher(topic.kind, topic.name, qos)
        self._reliable = topic.qos.reliability == ReliabilityPolicy.RELIABLE
        self._open = 0
        self.messages = 0

    def publish(self, data: bytes) -> None:
        self._publisher.publish(data)
        self.messages += 1
        self._open += self._reliable

    @property
    def is_full(self) -> bool:
        """Whether one more would push out what a reader may not have yet."""
        return self._open >= self._depth

    def is_read(self, timeout_s: float) -> bool:
        """Wait until its reliable readers have everything, or for the timeout."""
        if self._open and not self._publisher.wait_for_all_acked(Duration(seconds=timeout_s)):
            return False
        self._open = 0
        return True

    @property
    def readers(self) -> int:
        return int(self._publisher.get_subscription_count())

    @property
    def published(self) -> PublishedTopic:
        reliability = "reliable" if self._reliable else "best effort"
        qos = f"{reliability}, latched" if self.topic.latched else reliability
        return PublishedTopic(self.topic.name, self.messages, qos, self.readers)


class Player:
    """Publishes the messages of one bag on their topics."""

    def __init__(
        self, node: Node, messages: Messages, publishing: Publishing, interruption: Interruption
    ) -> None:
        """Create the publishers."""
        self._node, self._messages, self._publishing = node, messages, publishing
        self._interruption = interruption
        self._progress = CampaignProgress(done="played")
        # without a pace of its own, or after a jump of another's clock, much is due at once
        paced = math.isinf(publishing.rate) or publishing.follow_clock
        own = not publishing.follow_clock
        played = [topic for topic in messages.topics if own or topic.name != CLOCK]
        self._outputs = {topic.name: _Output(node, topic, paced) for topic in played}
        self._ticks: _Output | None = None
        self._clock: ExternalClock | None = None
        if publishing.follow_clock:
            self._clock = ExternalClock(node)
        elif CLOCK not in self._outputs:
            self._ticks = _Output(node, PlayedTopic(CLOCK, Clock, runtime.CLOCK_QOS), False)
            self._outputs[CLOCK] = self._ticks
        self._begun_s = self._took_s = self._late_s = 0.0
        self._played_ns = 0

    def wait(self) -> None:
        """Let discovery find those who are there, and wait for those who are wanted.

        Raises:
            InputError: another node publishes one of the topics.
        """
        self._progress.say(f"ROS domain {own_domain()}; {reach()}.")
        for note in self._messages.notes:
            self._progress.say(note)
        seen: list[tuple[int, set[str]]] = []
        changed_s = time.monotonic()
        said_s = changed_s + _SAY_S
        while True:
            before, seen = seen, [self._seen(output) for output in self._outputs.values()]
            if seen != before:
                changed_s = time.monotonic()
            reading = set().union(*(names for _, names in seen))
            missing = [name for name in self._publishing.wait_for if name not in reading]
            if not missing and time.monotonic() > changed_s + _DISCOVERY_S:
                break
            if missing and time.monotonic() > said_s:
                self._progress.say(f"Waiting for {' and '.join(missing)} to subscribe.")
                said_s = math.inf
            self._pause(_PAUSE_S)
        self._refuse_others()

    def _seen(self, output: _Output) -> tuple[int, set[str]]:
        """Return the subscriptions that are matched, and whose are known."""
        known = self._node.get_subscriptions_info_by_topic(output.topic.name)
        return output.readers, {reader.node_name for reader in known}

    def _refuse_others(self) -> None:
        for name in self._outputs:
            writers = self._node.get_publishers_info_by_topic(name)
            if len(writers) > 1:
                names = {f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in writers}
                others = names - {self._node.get_fully_qualified_name()} or names
                raise InputError(
                    f"{', '.join(sorted(others))} publishes on {name} too; stop it, choose other "
                    "topics with --topic, or set another ROS_DOMAIN_ID."
                )

    def play(self) -> None:
        """Publish everything, once or again and again; raise KeyboardInterrupt on Ctrl-C."""
        self._begun_s = time.monotonic()
        with self._progress:
            self._progress.expect_s(self._messages.duration_s)
            self._play_once()
            if self._publishing.start_offset_s and not self._has_played:
                raise InputError(
                    f"--start-offset {self._publishing.start_offset_s:g}: the bag ends before; "
                    f"give less than {self._messages.duration_s:g}."
                )
            while self._publishing.loop:
                self._play_once()
        until_s = time.monotonic() + _LAST_S
        for output in self._outputs.values():
            while not output.is_read(_PAUSE_S) and time.monotonic() < until_s:
                self._interruption.raise_if_asked()

    @property
    def _has_played(self) -> bool:
        """Whether more than latched messages, which ignore the offset, went out."""
        outputs = self._outputs.values()
        return any(output.messages for output in outputs if not output.topic.latched)

    def _play_once(self) -> None:
        if self._clock is not None:
            self._begin_by_clock(self._clock)
        skip_ns = at_ns = round(self._publishing.start_offset_s * 1e9)
        before_ns, begun_s = self._played_ns, time.monotonic()
        looked_s, ticked_ns = 0.0, -1
        for message in self._messages:
            if time.monotonic() > looked_s + _LOOK_S:
                looked_s = time.monotonic()
                self._progress.update(message.logged_s)
                self._interruption.raise_if_asked()
            if message.offset_ns < skip_ns and not message.topic.latched:
                continue
            at_ns = max(at_ns, message.offset_ns)
            passed_s = (at_ns - skip_ns) * 1e-9 / self._publishing.rate
            if self._clock is None:
                self._keep_pace(begun_s + passed_s)
            else:
                while self._clock.passed_s() < passed_s:
                    self._pause(_CLOCK_PAUSE_S)
            if self._ticks is not None and message.clock_ns > ticked_ns:
                ticked_ns = message.clock_ns
                self._send(self._ticks, clock_message(ticked_ns))
            if message.topic.name in self._outputs:  # a recorded /clock is not, beside another
                self._send(self._outputs[message.topic.name], message.data)
            self._played_ns = before_ns + at_ns - skip_ns
            self._took_s = time.monotonic() - self._begun_s

    def _begin_by_clock(self, clock: ExternalClock) -> None:
        """Take the time of the external clock now for the beginning."""
        said_s = time.monotonic() + _SAY_S
        while not clock.begin():
            if time.monotonic() > said_s:
                self._progress.say(f"Waiting for {CLOCK}, which nobody publishes.")
                said_s = math.inf
            self._pause(_PAUSE_S)

    def _keep_pace(self, due_s: float) -> None:
        """Wait for a message's time, or see how late it is."""
        if math.isinf(self._publishing.rate):
            return
        while (left := due_s - time.monotonic()) > 0.0:
            self._pause(min(left, _PAUSE_S))
        self._late_s = max(self._late_s, -left)

    def _send(self, output: _Output, data: bytes) -> None:
        output.publish(data)
        while output.is_full and not output.is_read(_PAUSE_S):
            self._interruption.raise_if_asked()

    def _pause(self, seconds: float) -> None:
        time.sleep(seconds)
        self._interruption.raise_if_asked()

    @property
    def published(self) -> Published:
        """What was published until now."""
        return Published(
            tuple(output.published for output in self._outputs.values()),
            self._played_ns * 1e-9,
            self._took_s,
            None if math.isinf(self._publishing.rate) else self._late_s,
        )
