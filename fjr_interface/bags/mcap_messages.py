"""Finds the messages of unpacked MCAP records, in bounded pieces and bounded work."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any, NoReturn

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from .blocks import BLOCK_BYTES, BLOCK_MESSAGES, Block, Topic
from .mcap_index import MESSAGE_HEAD, gather, indexed_messages

RECORD = struct.Struct("<BQ")

_FREE_BYTES = 256 * 2**20
_BYTES_PER_BYTE = 64
_FREE_RECORDS = 2**20
_MAX_DEFINITIONS = 16 * 2**20
QOS = "offered_qos_profiles"


class MessageFinder:
    """Turns the records of chunks, and those outside of chunks, into blocks of messages.

    A small file may claim much work: chunks that unpack to a thousand times their size, full of
    records without content. What is unpacked, and the number of records that must be looked at one
    by one, are therefore bounded by the size of the file.

    Attributes:
        messages: number of messages found.
        topics: where the messages of each channel come from.
    """

    def __init__(self, file_bytes: int, broken: Callable[[str], NoReturn]) -> None:
        """Begin a file of this size; `broken` refuses it."""
        self.messages = 0
        self.topics: dict[int, Topic] = {}
        self._broken = broken
        self._bytes_left = _FREE_BYTES + _BYTES_PER_BYTE * file_bytes
        self._records_left = _FREE_RECORDS + file_bytes
        self._definitions_left = _MAX_DEFINITIONS
        self._schemas: dict[int, tuple[bytes, Schema]] = {}
        self._channels: dict[int, bytes] = {}

    def unpacked(self, size: int) -> None:
        """Take note of bytes that will be unpacked; refuse the file if they are too many."""
        self._bytes_left -= size
        if self._bytes_left < 0:
            self._broken(
                f"unpacks to more than {_FREE_BYTES} bytes and {_BYTES_PER_BYTE} times its size"
            )

    def find(self, data: bytes, index: list[bytes]) -> Iterator[Block]:
        """Yield the messages of a chunk; its index is a hint, every byte is accounted for."""
        view = np.frombuffer(data, np.uint8)
        for messages in self._offsets(data, view, index):
            yield from self._blocks(view, messages)

    def _offsets(self, data: bytes, view: np.ndarray, index: list[bytes]) -> Iterator[np.ndarray]:
        """Yield the offsets of the message records, rising, in pieces for one block each."""
        indexed, gaps = indexed_messages(view, index)
        if len(indexed) and not any(len(part) for gap in gaps for part in self._walk(data, *gap)):
            yield from _pieces(indexed)
        else:
            yield from self._walk(data, 0, len(data))

    def _blocks(self, view: np.ndarray, messages: np.ndarray) -> Iterator[Block]:
        self.messages += len(messages)
        lengths = gather(view, messages + 1, "<u8").astype(np.int64)
        channels = gather(view, messages + 9, "<u2")
        times = gather(view, messages + 15, "<i8")
        order = np.argsort(channels, kind="stable")
        bounds = np.flatnonzero(np.diff(channels[order], prepend=-1, append=2**16))
        for first, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
            mine = order[first:end]
            channel = int(channels[mine[0]])
            if channel not in self.topics:
                self._broken(f"has messages on the unknown channel {channel}")
            yield Block(
                self.topics[channel],
                view,
                messages[mine] + 9 + MESSAGE_HEAD,
                lengths[mine] - MESSAGE_HEAD,
                times[mine],
            )

    def _walk(self, data: bytes, at: int, end: int) -> Iterator[np.ndarray]:
        """Take in the schemas and channels between `at` and `end`; yield offsets of messages."""
        messages: list[int] = []
        while at < end:
            if at + 9 > end:
                self._broken("has a corrupted chunk")
            opcode, length = RECORD.unpack_from(data, at)
            body = at + 9
            if length > end - body or opcode == 0:
                self._broken("has a corrupted chunk")
            self._records_left -= 1
            if self._records_left < 0:
                self._broken("has more records than a file of its size can honestly hold")
            if opcode == Opcode.MESSAGE:
                if length < MESSAGE_HEAD:
                    self._broken("has a corrupted message")
                if messages and body + length - messages[0] > BLOCK_BYTES:
                    yield np.array(messages, np.int64)
                    messages.clear()
                messages.append(at)
                if len(messages) == BLOCK_MESSAGES:
                    yield np.array(messages, np.int64)
                    messages.clear()
            elif opcode == Opcode.SCHEMA:
                self._add_schema(data[body : body + length])
            elif opcode == Opcode.CHANNEL:
                self._add_channel(data[body : body + length])
            at = body + length
        if messages:
            yield np.array(messages, np.int64)

    def _add_schema(self, content: bytes) -> None:
        number = int.from_bytes(content[:2], "little")
        if number in self._schemas:
            if self._schemas[number][0] != content:
                self._broken(f"defines schema {number} twice, differently")
            return
        self._keep(content)
        schema: Schema = self.parse(Schema, content)
        self._schemas[schema.id] = content, schema

    def _add_channel(self, content: bytes) -> None:
        number = int.from_bytes(content[:2], "little")
        if number in self._channels:
            if self._channels[number] != content:
                self._broken(f"defines channel {number} twice, differently")
            return
        self._keep(content)
        channel: Channel = self.parse(Channel, content)
        self._channels[channel.id] = content
        if channel.schema_id not in self._schemas:
            self._broken(f"has the topic {channel.topic} without a message definition")
        schema = self._schemas[channel.schema_id][1]
        self.topics[channel.id] = Topic(
            channel.topic,
            schema.name,
            schema.data.decode("utf-8", "replace"),
            schema.encoding,
            channel.message_encoding,
            channel.metadata.get(QOS, ""),
        )

    def _keep(self, content: bytes) -> None:
        self._definitions_left -= len(content)
        if self._definitions_left < 0:
            self._broken(f"has message definitions of more than {_MAX_DEFINITIONS} bytes")

    def parse(self, kind: Any, content: bytes) -> Any:
        """Parse a record with the mcap library; refuse the file if it cannot be."""
        try:
            return kind.read(ReadDataStream(BytesIO(content)))
        except (McapError, struct.error, UnicodeDecodeError, OverflowError):
            self._broken(f"has a corrupted {kind.__name__} record")


def _pieces(offsets: np.ndarray) -> Iterator[np.ndarray]:
    """Cut rising offsets into pieces that span a block each."""
    while len(offsets):
        within = int(np.searchsorted(offsets, offsets[0] + BLOCK_BYTES))
        count = max(1, min(within, BLOCK_MESSAGES))
        yield offsets[:count]
        offsets = offsets[count:]
