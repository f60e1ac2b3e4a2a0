"""The messages of any rosbag2 bag in their order, with the topics, types and QoS to publish them.

The time of a message is that of the rig: the newest header stamp of the signal that keeps the
clock (the position if it is among the topics, else reference, torque or link). Where there is none
of these, it is the time at which the message was recorded.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosbags.interfaces import Qos, QosTime
from rosbags.rosbag2.metadata import parse_qos
from std_msgs.msg import String

from fjr_interface.bags.blocks import MEND, Block
from fjr_interface.bags.files import bag_files
from fjr_interface.bags.metadata import TopicMetadata
from fjr_interface.bags.plain_yaml import load_plain_yaml
from fjr_interface.experiment import CUSTOM_DATA_KEY
from fjr_interface.ros import runtime
from fjr_interface.ros.messages import message_class
from fjr_interface.topics import (
    EXPERIMENT_TOPIC,
    LINK_POSITION,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    NAMESPACE,
    REFERENCE,
    moved_topic,
)
from fjr_kit.errors import InputError

CLOCK = "/clock"

_KEEPERS = (MOTOR_POSITION, REFERENCE, MOTOR_TORQUE, LINK_POSITION)
_HEADER = "std_msgs/Header"
_STAMP = struct.Struct("<4xiI")
_DEPTH = 10  # where no history was recorded, as in most bags of rosbag2 itself
_FOREVER_S = 2**31 - 1


@dataclass(frozen=True)
class PlayedTopic:
    """A topic to publish: absolute name, message class and QoS."""

    name: str
    kind: Any
    qos: QoSProfile

    @property
    def latched(self) -> bool:
        """Whether late readers get its last messages too."""
        return bool(self.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL)


@dataclass(frozen=True)
class TimedMessage:
    """One message.

    Attributes:
        topic: where to publish it.
        data: serialized message.
        offset_ns: rig time since the beginning.
        clock_ns: rig time.
        logged_s: time of recording since the beginning.
    """

    topic: PlayedTopic
    data: bytes
    offset_ns: int
    clock_ns: int
    logged_s: float


class Messages:
    """The messages of a bag to publish, iterated again and again.

    Attributes:
        topics: what is published.
        notes: sentences about what is not.
        duration_s: time that the recording took.
    """

    def __init__(self, bag: Path, wanted: Sequence[str] = (), namespace: str = NAMESPACE) -> None:
        """Open the bag.

        Args:
            bag: its folder.
            wanted: topics by name or by last words; empty for all. The description always comes.
            namespace: where the topics go that the bag has in `/rig`.

        Raises:
            InputError: the bag cannot be read, or holds no such topic.
        """
        self._bag, self._namespace = bag, namespace
        self._files = bag_files(bag)
        self._files.refuse_cut()
        self.notes = list(self._files.notes)
        self.duration_s = max(self._files.duration_ns, 0) * 1e-9
        self._played: dict[str, PlayedTopic] = {}
        for each in self._chosen(wanted):
            self._take_in(each)
        if not self._played:
            raise InputError(f"{bag}: holds no message that can be published here.")
        metadata = self._files.metadata
        custom = {} if metadata is None else metadata.custom_data or {}
        self._description = self._described(custom.get(CUSTOM_DATA_KEY))
        self._keeper = self._clock_keeper()

    @property
    def topics(self) -> list[PlayedTopic]:
        """What is published."""
        return list(self._played.values())

    def _chosen(self, wanted: Sequence[str]) -> list[TopicMetadata]:
        there = self._files.described
        for name in wanted:
            if not any(_means(name, each.name) for each in there):
                names = ", ".join(sorted({each.name for each in there}))
                raise InputError(f"{self._bag}: holds no topic {name}; there are: {names}.")
        return [
            each
            for each in there
            if not wanted
            or _means(EXPERIMENT_TOPIC, each.name)
            or any(_means(name, each.name) for name in wanted)
        ]

    def _take_in(self, topic: TopicMetadata) -> None:
        """Take a topic in, or note why it is left out."""
        if topic.name in self._played:
            return
        kind = message_class(topic.type)
        encoding = topic.serialization_format
        if kind is None or encoding != "cdr":
            why = f"the type {topic.type} is not installed" if kind is None else encoding
            self.notes.append(f"{topic.name} is left out: {why}.")
            return
        offers = [
            qos
            for each in self._files.described
            if each.name == topic.name
            for qos in self._offered(each)
        ]
        place = moved_topic(topic.name, self._namespace)
        self._played[topic.name] = PlayedTopic(place, kind, to_offer(offers))

    def _offered(self, topic: TopicMetadata) -> list[Qos]:
        profiles = topic.offered_qos_profiles
        try:
            given: Any = load_plain_yaml(profiles) if isinstance(profiles, str) else profiles
            return parse_qos(given)
        except Exception:  # rosbags trusts what it finds here: anything may go wrong
            raise InputError(
                f"{self._bag}: {topic.name}: offered_qos_profiles is damaged; {MEND}."
            ) from None

    def _described(self, text: object) -> TimedMessage | None:
        """Return the description of metadata.yaml if no message gives one."""
        if not isinstance(text, str) or any(
            _means(EXPERIMENT_TOPIC, name) for name in self._played
        ):
            return None
        place = f"{self._namespace}/{EXPERIMENT_TOPIC}"
        topic = PlayedTopic(place, String, runtime.EXPERIMENT_QOS)
        self._played[topic.name] = topic
        return TimedMessage(topic, serialize_message(String(data=text)), 0, -1, 0.0)

    def _clock_keeper(self) -> str | None:
        for signal in _KEEPERS:
            for name, topic in self._played.items():
                fields = list(topic.kind.get_fields_and_field_types().values())
                if _means(signal.topic, name) and fields[:1] == [_HEADER]:
                    return name
        return None

    def __iter__(self) -> Iterator[TimedMessage]:
        """Yield all messages in the order of recording."""
        if self._description is not None:
            yield self._description
        begin_ns = now_ns = begun_ns = None
        for name, logged_ns, data in self._logged():
            begun_ns = logged_ns if begun_ns is None else begun_ns
            if self._keeper is None:
                stamp_ns = logged_ns
            elif name == self._keeper:
                if len(data) < _STAMP.size:
                    raise InputError(f"{self._bag}: {name}: a message has no stamp; {MEND}.")
                seconds, nanoseconds = _STAMP.unpack_from(data)
                stamp_ns = seconds * 1_000_000_000 + nanoseconds
            else:
                stamp_ns = -1
            now_ns = max(stamp_ns, -1 if now_ns is None else now_ns)
            if begin_ns is None and now_ns >= 0:
                begin_ns = now_ns
            offset_ns = 0 if begin_ns is None else now_ns - begin_ns
            logged_s = (logged_ns - begun_ns) * 1e-9
            yield TimedMessage(self._played[name], data, offset_ns, now_ns, logged_s)

    def _logged(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, time of recording in ns, payload)."""
        blocks = (
            block for block in self._files.blocks(self._played) if block.topic.name in self._played
        )
        for _, group in itertools.groupby(blocks, key=lambda block: id(block.data)):
            yield from _in_order(list(group))


def _in_order(blocks: list[Block]) -> Iterator[tuple[str, int, bytes]]:
    """Yield the messages of blocks that were recorded together, by time of recording."""
    times = np.concatenate([block.times for block in blocks])
    starts = np.concatenate([block.starts for block in blocks])
    which = np.repeat(np.arange(len(blocks)), [len(block.starts) for block in blocks])
    first = np.cumsum([0, *(len(block.starts) for block in blocks)])
    for at in np.lexsort((starts, times)):
        block = blocks[which[at]]
        yield block.topic.name, int(times[at]), block.payload(at - first[which[at]])


def to_offer(recorded: Sequence[Qos]) -> QoSProfile:
    """Return the QoS with which to publish what was offered with recorded profiles.

    As rosbag2 does: the recorded one, unless the publishers differed in what decides who can read
    them; then the default, reliable and volatile. An unknown history is the last ten messages.
    """
    kept = {(qos.reliability.name, qos.durability.name) for qos in recorded}
    if len(kept) != 1:
        return QoSProfile(depth=_DEPTH)
    qos = recorded[0]
    keeps_all = qos.history.name == HistoryPolicy.KEEP_ALL.name
    known = qos.history.name == HistoryPolicy.KEEP_LAST.name and qos.depth > 0
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if keeps_all else HistoryPolicy.KEEP_LAST,
        depth=qos.depth if known else _DEPTH,
        reliability=(
            ReliabilityPolicy.BEST_EFFORT
            if qos.reliability.name == ReliabilityPolicy.BEST_EFFORT.name
            else ReliabilityPolicy.RELIABLE
        ),
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL
            if qos.durability.name == DurabilityPolicy.TRANSIENT_LOCAL.name
            else DurabilityPolicy.VOLATILE
        ),
        deadline=_duration(qos.deadline),
        lifespan=_duration(qos.lifespan),
    )


def _duration(recorded: QosTime) -> Duration:
    """Return a recorded duration; zero, which means unlimited, for one that is."""
    if recorded.sec >= _FOREVER_S:
        return Duration()
    return Duration(seconds=recorded.sec, nanoseconds=recorded.nsec)


def _means(wanted: str, topic: str) -> bool:
    """Tell whether a name, or the last words of one, means a topic."""
    relative = not wanted.startswith("/") and topic.endswith(f"/{wanted}")
    return relative or topic == wanted
