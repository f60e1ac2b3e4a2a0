"""What publishing a bag takes, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from fjr_interface.topics import NAMESPACE


@dataclass(frozen=True)
class Publishing:
    """How a bag is published.

    Attributes:
        rate: times real time; infinite: as fast as the readers take it.
        topics: the topics to publish, by their last words; empty for all.
        start_offset_s: how far into the bag it begins (s).
        loop: whether it begins again at the end.
        wait_for: nodes that must read one of the topics before it begins.
        follow_clock: whether another program's /clock keeps the time, instead of this machine's.
        namespace: where the topics go that the bag has in `/rig`.
    """

    rate: float = 1.0
    topics: tuple[str, ...] = ()
    start_offset_s: float = 0.0
    loop: bool = False
    wait_for: tuple[str, ...] = ()
    follow_clock: bool = False
    namespace: str = NAMESPACE


@dataclass(frozen=True)
class PublishedTopic:
    """What became of one topic: messages published and subscriptions at the end."""

    topic: str
    messages: int
    qos: str
    readers: int


@dataclass(frozen=True)
class Published:
    """What was published of a bag.

    Attributes:
        topics: one by one.
        played_s: rig time that was played (s).
        took_s: wall time that it took (s).
        late_s: how late a message was at worst (s); None if none had a time.
    """

    topics: tuple[PublishedTopic, ...]
    played_s: float
    took_s: float
    late_s: float | None
