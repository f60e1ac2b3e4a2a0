"""What any topic of any bag is like: rate, jitter, losses, stamps, QoS, definition of its messages.

Unlike `audit`, which refuses a signal at its first bad sample, this counts all that is wrong, of
topics of every type. The stamp of a message is the time that it begins with (a header's, or that of
a clock); a message that begins with none has the time at which it was recorded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype, Qos, QosDurability, QosHistory
from rosbags.rosbag2.metadata import parse_qos

from .blocks import Block, Topic
from .definitions import DefinitionError, differs_from_standard, is_standard, typestore
from .files import bag_files
from .mcap_index import gather
from .plain_yaml import load_plain_yaml

_TIME = "builtin_interfaces/msg/Time"
_FIRST = 2**12
"""Steps from which the nominal one is taken: their median."""
_NEAR = 0.5
"""Greatest deviation of a step from the nominal one, as a part of it, that is jitter, no loss."""
_REGULAR = 0.9
"""Part of the steps that must be near the nominal one where the lost messages can be counted."""
_FEWEST = 4
"""Messages from which a topic has a rate."""
_STAMP_BYTES = 12
"""Of CDR: four of its head, then seconds and nanoseconds."""


@dataclass(frozen=True)
class TopicSurvey:
    """What one topic of a bag is like.

    Attributes:
        name: the topic.
        type: of its messages, as `pkg/msg/Name`.
        messages: how many there are.
        stamped: whether the messages begin with a stamp; else all times are those of recording.
        rate_hz: 1 over the nominal step, the median of the first ones; None for a few messages.
        regular: whether most steps are near the nominal one.
        jitter_s: rms of the deviations of the steps near the nominal one from it; None without any.
        worst_jitter_s: the greatest of these deviations.
        lost: messages that are missing in gaps of the stamps; None where the steps are not regular,
            or messages have no stamps.
        longest_gap_s: longest step from one stamp to the next.
        duplicates: messages with the stamp of the one before.
        backward: messages with an earlier stamp than the one before.
        qos: offered by the publishers, in words; empty if it was not recorded.
        definition: where the definition of the type is from, or what is wrong with it.
        problems: sentences on what is wrong, without the topic's name.
    """

    name: str
    type: str
    messages: int
    stamped: bool
    rate_hz: float | None
    regular: bool
    jitter_s: float | None
    worst_jitter_s: float | None
    lost: int | None
    longest_gap_s: float | None
    duplicates: int
    backward: int
    qos: str
    definition: str
    problems: tuple[str, ...]


@dataclass(frozen=True)
class BagSurvey:
    """What a bag is like: its topics by name, and the reader's notes."""

    topics: tuple[TopicSurvey, ...]
    duration_s: float
    notes: tuple[str, ...]


def survey_bag(bag: Path | str) -> BagSurvey:
    """Look at every message of a bag once, in bounded memory.

    Args:
        bag: a folder or a storage file, as `bag_files` takes it.

    Raises:
        InputError: there is no bag, or it is damaged so that the rest cannot be read.
    """
    files = bag_files(Path(bag))
    files.refuse_cut()
    followed: dict[str, _Followed] = {}
    for block in files.blocks(set(files.topics)):
        name = block.topic.name
        if name not in followed:
            followed[name] = _Followed(block.topic)
        followed[name].add(block)
    offered: dict[str, list[Any]] = {}
    for each in files.described:
        offered.setdefault(each.name, []).append(each.offered_qos_profiles)
    found = []
    for name, kind in files.topics.items():
        topic = Topic(name, kind, "", "", "cdr")
        follower = followed.get(name) or _Followed(topic)
        found.append(follower.result(_in_words(offered.get(name, [])), files.counts.get(name, 0)))
    found.sort(key=lambda each: each.name)
    return BagSurvey(tuple(found), max(files.duration_ns, 0) * 1e-9, files.notes)


class _Followed:
    """Follows one topic through the bag."""

    def __init__(self, topic: Topic) -> None:
        self._topic = topic
        self._problems: list[str] = []
        self._messages = self._duplicates = self._backward = self._lost = 0
        self._near = self._far = 0
        self._squares_ns2 = self._worst_ns = self._longest_ns = 0.0
        self._last: int | None = None
        self._step_before = 0
        self._nominal_ns: float | None = None
        self._first: list[np.ndarray] = []
        self._definition, self._stamped = self._look_at_type()

    def _look_at_type(self) -> tuple[str, bool]:
        topic = self._topic
        if topic.encoding != "cdr":
            self._problems.append(f"the encoding {topic.encoding!r} is none that ROS 2 reads")
            return "none", False
        try:
            types = typestore(topic).fielddefs
            kind = "Jazzy" if is_standard(topic) else "bag"
            if differs_from_standard(topic):
                kind = "differs"
                self._problems.append(
                    f"the bag's definition of {topic.type} differs from Jazzy's: subscribers of "
                    "Jazzy cannot read these messages"
                )
        except DefinitionError as error:
            if topic.definition:
                self._problems.append(f"the definition of {topic.type} {error}")
            return ("unusable" if topic.definition else "none"), False
        return kind, _begins_with_time(topic.type, types)

    def add(self, block: Block) -> None:
        """Take the next messages in."""
        stamps = self._stamps(block)
        self._messages += len(stamps)
        if not len(stamps):
            return
        steps = np.diff(stamps) if self._last is None else np.diff(stamps, prepend=self._last)
        self._last = int(stamps[-1])
        if self._nominal_ns is not None:
            self._take(steps)
            return
        self._first.append(steps)
        if sum(map(len, self._first)) >= _FIRST:
            self._begin()

    def _stamps(self, block: Block) -> np.ndarray:
        """Return the stamps of a block's messages, int64 ns."""
        if self._stamped and (block.sizes < _STAMP_BYTES).any():
            self._stamped = False
            self._problems.append("a message is too short for its stamp")
        if not self._stamped:
            return block.times
        little = gather(block.data, block.starts + 1, "u1") & 1 == 1
        words = {}
        for name, at, kind in (("sec", 4, "i4"), ("nanosec", 8, "u4")):
            low = gather(block.data, block.starts + at, f"<{kind}").astype(np.int64)
            high = gather(block.data, block.starts + at, f">{kind}").astype(np.int64)
            words[name] = np.where(little, low, high)
        stamps: np.ndarray = words["sec"] * 1_000_000_000 + words["nanosec"]
        return stamps

    def _begin(self) -> None:
        """Settle the nominal step by the first ones, and take these in."""
        steps = np.concatenate([*self._first, np.empty(0, np.int64)])
        self._first = []
        rising = steps[steps > 0]
        self._nominal_ns = float(np.median(rising)) if len(rising) else 0.0
        self._take(steps)

    def _take(self, steps: np.ndarray) -> None:
        nominal = self._nominal_ns or 0.0
        self._duplicates += int(np.count_nonzero(steps == 0))
        self._backward += int(np.count_nonzero(steps < 0))
        # The step that leads on from a stamp that went back is no gap.
        before = np.append(self._step_before, steps)[: len(steps)]
        rising = steps[(steps > 0) & (before >= 0)]
        self._step_before = int(steps[-1]) if len(steps) else self._step_before
        if not len(rising):
            return
        self._longest_ns = max(self._longest_ns, float(rising.max()))
        deviations = np.abs(rising - nominal)
        near = deviations <= _NEAR * nominal
        self._near += int(np.count_nonzero(near))
        self._far += int(np.count_nonzero(~near))
        self._squares_ns2 += float(np.sum(deviations[near] ** 2))
        self._worst_ns = max(self._worst_ns, float(deviations[near].max(initial=0.0)))
        long = rising[rising > (1.0 + _NEAR) * nominal]
        self._lost += int(np.sum(np.rint(long / nominal) - 1.0)) if nominal else 0

    def result(self, qos: str, expected: int) -> TopicSurvey:
        """Return what was found.

        Args:
            qos: in words.
            expected: number of messages by metadata or summary.
        """
        if self._nominal_ns is None:
            self._begin()
        nominal = self._nominal_ns if self._messages >= _FEWEST else 0.0
        regular = bool(nominal) and self._near >= _REGULAR * (self._near + self._far)
        near = self._near if nominal else 0
        problems = [*self._problems]
        if self._messages != expected:
            problems.append(f"{self._messages} messages are there where the bag says {expected}")
        # Without stamps there is the time of arrival, which a busy machine delays: no loss is told.
        counted = regular and self._stamped
        if counted and self._lost:
            problems.append(f"{_count(self._lost, 'message')} missing between the others")
        if self._duplicates:
            problems.append(f"{_count(self._duplicates, 'stamp')} there twice")
        if self._backward:
            problems.append(f"{_count(self._backward, 'stamp')} earlier than the one before")
        return TopicSurvey(
            name=self._topic.name,
            type=self._topic.type,
            messages=self._messages,
            stamped=self._stamped,
            rate_hz=1e9 / nominal if nominal else None,
            regular=regular,
            jitter_s=(self._squares_ns2 / near) ** 0.5 * 1e-9 if near else None,
            worst_jitter_s=self._worst_ns * 1e-9 if near else None,
            lost=self._lost if counted else None,
            longest_gap_s=self._longest_ns * 1e-9 if self._longest_ns else None,
            duplicates=self._duplicates,
            backward=self._backward,
            qos=qos,
            definition=self._definition,
            problems=tuple(problems),
        )


def _count(number: int, what: str) -> str:
    return f"1 {what} is" if number == 1 else f"{number} {what}s are"


def _begins_with_time(name: str, types: Any) -> bool:
    """Tell whether the first thing in a message of a type is a time."""
    while name != _TIME:
        fields = types[name][1] if name in types else ()
        if not fields or fields[0][1][0] != Nodetype.NAME:
            return False
        name = fields[0][1][1]
    return True


def _in_words(offered: Iterable[Any]) -> str:
    """Return recorded QoS profiles in a few words, those of several publishers apart."""
    words: list[str] = []
    for profiles in offered:
        try:
            given: Any = load_plain_yaml(profiles) if isinstance(profiles, str) else profiles
            words += [_profile(qos) for qos in parse_qos(given or [])]
        except Exception:  # rosbags trusts what it finds here: anything may go wrong
            words.append("damaged")
    return "; ".join(dict.fromkeys(words))


def _profile(qos: Qos) -> str:
    """Return reliability, durability if late readers get something, and depth."""
    reliability = qos.reliability.name.lower().replace("_", " ")
    latched = ", latched" if qos.durability == QosDurability.TRANSIENT_LOCAL else ""
    depth = f", last {qos.depth}" if qos.history == QosHistory.KEEP_LAST and qos.depth else ""
    return f"{reliability}{latched}{depth}{', all' * (qos.history == QosHistory.KEEP_ALL)}"
