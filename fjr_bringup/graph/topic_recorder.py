"""Records chosen topics of any rig, of any type that is installed here: `fjr record --topic`."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosReliability
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore

from fjr_interface.bags.qos import stated_qos
from fjr_interface.bags.storage import ChecksummedWriter
from fjr_interface.ros.messages import message_class
from fjr_interface.ros.session import ros_session
from fjr_kit.atomic import new_partial
from fjr_kit.errors import InputError
from fjr_kit.progress import ProgressLine
from fjr_kit.stopping import Interruption

from .domain import own_domain, reach

_POLL_S = 0.005
_DISCOVERY_S = 2.0
_SAY_S = 3.0
_DEPTH = 5000
"""Messages of one topic that may come between two looks."""
_OF_ROS = {"/rosout", "/parameter_events"}


def record_topics(
    bag: Path, topics: Sequence[str], duration_s: float | None, progress: ProgressLine
) -> None:
    """Record topics until Ctrl-C, or for a time after the first message, into one whole bag.

    Args:
        bag: folder of the bag, which must not exist.
        topics: absolute names; empty for all that are published after a moment.
        duration_s: time from the first message on; None for no end.
        progress: where progress is shown.

    Raises:
        InputError: no such topic comes, a type is not installed, no message came, or the folder
            cannot be written.
    """
    domain = own_domain()
    store = get_typestore(Stores.ROS2_JAZZY)
    partial = new_partial(bag)
    try:
        with ros_session(), Interruption() as interruption:
            node = rclpy.create_node("fjr_record")
            progress.say(f"Recording in ROS domain {domain}; {reach()}.")
            types = _types(node, topics, progress, interruption)
            recorded = [_Topic(node, name, kind, store) for name, kind in types.items()]
            _wait_for_match(recorded, interruption)
            progress.say(f"Recording {', '.join(types)}. Ctrl-C ends the bag.")
            try:
                _write(partial.path, recorded, duration_s, progress, interruption, store)
                partial.publish()
            except OSError as error:
                raise InputError(
                    f"{bag}: the bag cannot be written ({error.strerror}); make room or choose "
                    "another folder."
                ) from None
            node.destroy_node()
    finally:
        partial.clear_away()


def _types(
    node: Node, topics: Sequence[str], progress: ProgressLine, interruption: Interruption
) -> dict[str, str]:
    """Return the types of the topics by name, once all of them have a publisher."""
    begun, said = time.monotonic(), ""
    while True:
        there = {
            name: kinds[0]
            for name, kinds in node.get_topic_names_and_types()
            if node.count_publishers(name) and name not in _OF_ROS
        }
        waited = time.monotonic() - begun
        missing = [name for name in topics if name not in there]
        if not missing and (topics or (there and waited > _DISCOVERY_S)):
            return {name: there[name] for name in topics or sorted(there)}
        what = f"Waiting for a publisher of {' and '.join(missing) or 'any topic'}."
        if waited > _SAY_S and what != said:
            said = what
            progress.say(what)
        interruption.raise_if_asked()
        time.sleep(_POLL_S)


class _Topic:
    """One subscription to serialized messages."""

    def __init__(self, node: Node, name: str, kind: str, store: Any) -> None:
        self.name, self.type = name, kind
        message = message_class(kind)
        if message is None or kind not in store.types:
            raise InputError(
                f"{name}: the type {kind} is not one that is installed here; leave the topic out, "
                "or record it with `ros2 bag record`."
            )
        offers = node.get_publishers_info_by_topic(name)
        self.qos = [_recorded(offer.qos_profile) for offer in offers]
        self._subscription = node.create_subscription(
            message, name, lambda _: None, _readable(offers), raw=True
        )
        self.messages = 0

    @property
    def matched(self) -> bool:
        """Whether what a publisher sends from now on arrives here."""
        return self._subscription.get_publisher_count() > 0

    def take(self) -> list[tuple[int, bytes]]:
        """Return what has arrived: time of arrival in ns, and the serialized message."""
        taken = []
        handle = self._subscription.handle
        with handle:
            while (message := handle.take_message(self._subscription.msg_type, True)) is not None:
                data, info = message
                taken.append((info.get("received_timestamp") or time.time_ns(), data))
        self.messages += len(taken)
        return taken


def _wait_for_match(topics: Sequence[_Topic], interruption: Interruption) -> None:
    """Wait until the subscriptions hear their publishers, some of which may have left again."""
    until = time.monotonic() + _DISCOVERY_S
    while not all(each.matched for each in topics) and time.monotonic() < until:
        interruption.raise_if_asked()
        time.sleep(_POLL_S)


def _readable(offers: Sequence[TopicEndpointInfo]) -> QoSProfile:
    """Return the QoS that reads every publisher: reliable or latched only if all of them are."""
    reliable = all(o.qos_profile.reliability == ReliabilityPolicy.RELIABLE for o in offers)
    latched = all(o.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for o in offers)
    return QoSProfile(
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _recorded(offered: QoSProfile) -> Qos:
    """Return an offered QoS as it stands in a bag."""
    return stated_qos(
        QosHistory[offered.history.name],
        offered.depth,
        QosReliability[offered.reliability.name],
        QosDurability[offered.durability.name],
    )


def _write(
    path: Path,
    topics: Sequence[_Topic],
    duration_s: float | None,
    progress: ProgressLine,
    interruption: Interruption,
    store: Any,
) -> None:
    """Write what comes; leave a closed bag behind, or raise InputError where nothing came."""
    writer = ChecksummedWriter(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.open()
    channels = [
        writer.add_connection(each.name, each.type, typestore=store, offered_qos_profiles=each.qos)
        for each in topics
    ]
    first: float | None = None
    ends = False
    while not ends:
        ends = interruption.asked  # and what has arrived until then is taken
        arrived = [
            (stamp, channel, data)
            for topic, channel in zip(topics, channels, strict=True)
            for stamp, data in topic.take()
        ]
        for stamp, channel, data in sorted(arrived, key=lambda each: each[0]):
            writer.write(channel, stamp, data)
        now = time.monotonic()
        if arrived:
            first = now if first is None else first
            passed = now - first
            progress.describe(f"{sum(each.messages for each in topics)} messages, {passed:.0f} s")
        if first is not None and duration_s is not None and now - first >= duration_s:
            break
        time.sleep(_POLL_S)
    if first is None:
        raise InputError("No message came, so there is no bag.")
    writer.close()
