"""Topics and counts of an MCAP file: from its summary if it has one, else by a scan of it all."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Schema, Statistics

from fjr_kit.errors import InputError

from .blocks import MAX_RECORD, Topic
from .mcap_blocks import MAGIC, McapFile, is_closed
from .mcap_messages import QOS, RECORD
from .metadata import TopicMetadata

_FOOTER = RECORD.size + 20


@dataclass(frozen=True)
class Contents:
    """What an MCAP file holds.

    Attributes:
        topics: its topics.
        counts: number of messages of each topic.
        first_ns: time of recording of the first message.
        last_ns: time of recording of the last message.
        note: what is missing of a file that was never closed; None if it was closed.
    """

    topics: list[TopicMetadata]
    counts: dict[str, int]
    first_ns: int
    last_ns: int
    note: str | None = None


def survey(path: Path) -> Contents:
    """Return what a file holds; raise InputError if it cannot be read."""
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            size = file.tell()
            closed = is_closed(file, size)
            found = _summary(file, size) if closed else None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    return found or _scan(path)


def _summary(file: Any, size: int) -> Contents | None:
    """Return what the summary says; None if it is absent, incomplete or damaged."""
    end = size - len(MAGIC) - _FOOTER
    try:
        file.seek(max(0, end))
        opcode, length = RECORD.unpack(file.read(RECORD.size))
        start = _parse(Footer, file.read(length if length == 20 else 0)).summary_start
        if opcode != Opcode.FOOTER or not 0 < start < end or end - start > MAX_RECORD:
            return None
        file.seek(start)
        return _contents(file.read(end - start))
    except (McapError, struct.error, UnicodeDecodeError, OverflowError, KeyError):
        return None


def _contents(summary: bytes) -> Contents | None:
    types: dict[int, str] = {}
    channels: dict[int, Channel] = {}
    statistics: Statistics | None = None
    at = 0
    while at < len(summary):
        opcode, length = RECORD.unpack_from(summary, at)
        content = summary[at + RECORD.size : at + RECORD.size + length]
        if opcode == Opcode.SCHEMA:
            schema: Schema = _parse(Schema, content)
            types[schema.id] = schema.name
        elif opcode == Opcode.CHANNEL:
            channel: Channel = _parse(Channel, content)
            channels[channel.id] = channel
        elif opcode == Opcode.STATISTICS:
            statistics = _parse(Statistics, content)
        at += RECORD.size + length
    if statistics is None or sum(statistics.channel_message_counts.values()) != (
        statistics.message_count
    ):
        return None
    topics = [
        TopicMetadata(
            name=each.topic,
            type=types[each.schema_id],
            serialization_format=each.message_encoding,
            offered_qos_profiles=each.metadata.get(QOS, ""),
        )
        for each in channels.values()
    ]
    counts: Counter[str] = Counter()
    for number, count in statistics.channel_message_counts.items():
        counts[channels[number].topic] += count
    return Contents(topics, +counts, statistics.message_start_time, statistics.message_end_time)


def _parse(kind: Any, content: bytes) -> Any:
    return kind.read(ReadDataStream(BytesIO(content)))


def _scan(path: Path) -> Contents:
    file = McapFile(path, unclosed=True)
    topics: dict[Topic, None] = {}
    counts: Counter[str] = Counter()
    first, last = 2**63 - 1, 0
    for block in file.blocks():
        topics[block.topic] = None
        counts[block.topic.name] += len(block.starts)
        first, last = min(first, int(block.times.min())), max(last, int(block.times.max()))
    return Contents(
        [describe(topic) for topic in topics],
        counts,
        first,
        last,
        None if file.lost_bytes is None else _unclosed(path, file.lost_bytes, counts.total()),
    )


def describe(topic: Topic) -> TopicMetadata:
    """Return a topic as metadata.yaml would have it."""
    return TopicMetadata(
        name=topic.name,
        type=topic.type,
        serialization_format=topic.encoding,
        offered_qos_profiles=topic.qos,
    )


def _unclosed(path: Path, lost_bytes: int, messages: int) -> str:
    also = (
        f", and its last {lost_bytes} bytes, an incomplete record, are lost" if lost_bytes else ""
    )
    return (
        f"{path.name} was never closed, so its recorder crashed or still runs: its summary is "
        f"missing{also}; the {messages} messages that are there are read."
    )
