"""The messages of any rosbag2 bag in their order, with the topics, types and QoS to publish them.

The time of a message is that of the rig: the newest header stamp of the signal that keeps the
clock (the position if it is among the topics, else reference, torque or link). Where there is none
of these, it is the time at which the message was recorded.
"""

from __future__ import annotations

import contextlib
import importlib
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosbags.interfaces import Connection, Qos, QosTime
from rosbags.rosbag2 import Reader
from std_msgs.msg import String

from fjr_interface import ros
from fjr_interface.bag_metadata import read_metadata, storage_files
from fjr_interface.errors import InputError
from fjr_interface.experiment import CUSTOM_DATA_KEY
from fjr_interface.mcap_blocks import MEND
from fjr_interface.topics import (
    EXPERIMENT_TOPIC,
    LINK_POSITION,
    MOTOR_POSITION,
    MOTOR_TORQUE,
    NAMESPACE,
    REFERENCE,
)

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
    """The messages of a bag to publish; a context manager, iterated again and again.

    Attributes:
        topics: what is published.
        notes: sentences about what is not.
        duration_s: time that the recording took.
    """

    def __init__(self, bag: Path, wanted: Sequence[str] = ()) -> None:
        """Open the bag.

        Args:
            bag: its folder.
            wanted: topics by name or by last words; empty for all. The description always comes.

        Raises:
            InputError: the bag cannot be read, or holds no such topic.
        """
        self._bag = bag
        self.notes: list[str] = []
        metadata = read_metadata(bag)
        storage_files(bag, metadata)
        self._reader = Reader(bag)
        with self._readable():
            self._reader.open()
        self.duration_s = max(self._reader.duration, 0) * 1e-9
        self._played: dict[str, PlayedTopic] = {}
        self._connections = [each for each in self._chosen(wanted) if self._can_play(each)]
        if not self._played:
            self.close()
            raise InputError(f"{bag}: holds no message that can be published here.")
        self._description = self._described((metadata.custom_data or {}).get(CUSTOM_DATA_KEY))
        self._keeper = self._clock_keeper()

    @property
    def topics(self) -> list[PlayedTopic]:
        """What is published."""
        return list(self._played.values())

    def close(self) -> None:
        """Close the bag."""
        self._reader.close()

    def __enter__(self) -> Messages:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the bag."""
        self.close()

    @contextlib.contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except Exception:  # rosbags unpacks arbitrary bytes here: anything may go wrong
            raise InputError(f"{self._bag}: is damaged and cannot be played; {MEND}.") from None

    def _chosen(self, wanted: Sequence[str]) -> list[Connection]:
        there = self._reader.connections
        for name in wanted:
            if not any(_means(name, each.topic) for each in there):
                names = ", ".join(sorted({each.topic for each in there}))
                raise InputError(f"{self._bag}: holds no topic {name}; there are: {names}.")
        return [
            each
            for each in there
            if not wanted
            or _means(EXPERIMENT_TOPIC, each.topic)
            or any(_means(name, each.topic) for name in wanted)
        ]

    def _can_play(self, connection: Connection) -> bool:
        """Take a connection's topic in, or note why it is left out."""
        if connection.topic in self._played:
            return True
        kind = _message_class(connection.msgtype)
        encoding = getattr(connection.ext, "serialization_format", "cdr")
        if kind is None or encoding != "cdr":
            why = f"the type {connection.msgtype} is not installed" if kind is None else encoding
            self.notes.append(f"{connection.topic} is left out: {why}.")
            return False
        offers = [
            qos
            for each in self._reader.connections
            if each.topic == connection.topic
            for qos in getattr(each.ext, "offered_qos_profiles", ())
        ]
        self._played[connection.topic] = PlayedTopic(connection.topic, kind, to_offer(offers))
        return True

    def _described(self, text: object) -> TimedMessage | None:
        """Return the description of metadata.yaml if no message gives one."""
        if not isinstance(text, str) or any(
            _means(EXPERIMENT_TOPIC, name) for name in self._played
        ):
            return None
        topic = PlayedTopic(f"{NAMESPACE}/{EXPERIMENT_TOPIC}", String, ros.EXPERIMENT_QOS)
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
        begin_ns = now_ns = None
        for connection, logged_ns, data in self._logged():
            if self._keeper is None:
                stamp_ns = logged_ns
            elif connection.topic == self._keeper:
                seconds, nanoseconds = _STAMP.unpack_from(data)
                stamp_ns = seconds * 1_000_000_000 + nanoseconds
            else:
                stamp_ns = -1
            now_ns = max(stamp_ns, -1 if now_ns is None else now_ns)
            if begin_ns is None and now_ns >= 0:
                begin_ns = now_ns
            offset_ns = 0 if begin_ns is None else now_ns - begin_ns
            logged_s = (logged_ns - self._reader.start_time) * 1e-9
            topic = self._played[connection.topic]
            yield TimedMessage(topic, data, offset_ns, now_ns, logged_s)

    def _logged(self) -> Iterator[tuple[Connection, int, bytes]]:
        messages = self._reader.messages(self._connections) if self._connections else iter(())
        while True:
            with self._readable():
                message = next(messages, None)
            if message is None:
                return
            yield message


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


def _message_class(name: str) -> Any:
    """Return the class of `package/msg/Name`; None if it is not installed."""
    package, _, kind = name.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except (ImportError, AttributeError):
        return None
