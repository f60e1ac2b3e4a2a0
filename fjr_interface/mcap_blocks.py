"""Reads an MCAP file chunk by chunk into blocks of messages, fast, and trusting nothing.

Every length is checked against the file before it is used, so a damaged file costs an InputError
and never more memory than two chunks of `MAX_RECORD` bytes. All checksums of the format are
verified where they are present: the bags of `bag_writer` carry all of them. Many foreign recorders
(plain rosbags among them) leave them out; in their bags a flipped byte inside a sample's value
cannot be told from a measurement unless the compression stumbles over it.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, NoReturn

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Schema, Statistics

from .errors import InputError
from .mcap_index import MESSAGE_HEAD, gather, indexed_messages

MAX_RECORD = 128 * 2**20
"""Greatest size in bytes of one record, or of one chunk unpacked."""

MEND = "record it again"
_MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_LOOSE_BYTES = 2**20


@dataclass(frozen=True)
class Topic:
    """Where messages come from: topic, type (as `pkg/msg/Name`) and definition of the type."""

    name: str
    type: str
    definition: str
    definition_format: str
    encoding: str


@dataclass(frozen=True)
class Block:
    """Consecutive messages of one topic.

    Attributes:
        topic: where they come from.
        data: uint8, the bytes in which they lie.
        starts: int64 (messages,), offset of each payload in data.
        sizes: int64 (messages,), length of each payload in bytes.
    """

    topic: Topic
    data: np.ndarray
    starts: np.ndarray
    sizes: np.ndarray

    def payload(self, message: int) -> bytes:
        """Return the bytes of one message."""
        start = self.starts[message]
        return self.data[start : start + self.sizes[message]].tobytes()


def read_blocks(path: Path) -> Iterator[Block]:
    """Yield the messages of one MCAP file in file order, a block for each topic of each chunk.

    Raises:
        InputError: the file is truncated, corrupted, absurd, or cannot be read.
    """
    try:
        with path.open("rb") as file:
            yield from _McapFile(path, file).blocks()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None


class _McapFile:
    def __init__(self, path: Path, file: Any) -> None:
        self._path, self._file = path, file
        self._size = os.fstat(file.fileno()).st_size
        self._at = 0
        self._crc = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._topics: dict[int, Topic] = {}
        self._messages = 0
        self._zstd = zstandard.ZstdDecompressor()

    def blocks(self) -> Iterator[Block]:
        if self._take(8) != _MAGIC:
            self._broken("is not an MCAP file")
        loose = bytearray()
        chunk: bytes | None = None
        index: list[bytes] = []
        while True:
            crc_before = self._crc
            opcode, content = self._record()
            if opcode == Opcode.MESSAGE_INDEX and chunk is not None:
                index.append(content)
                continue
            if chunk is not None:
                yield from self._unpacked(chunk, index)
                chunk, index = None, []
            if opcode in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
                loose += _RECORD.pack(opcode, len(content)) + content
            if loose and (opcode in (Opcode.CHUNK, Opcode.DATA_END) or len(loose) > _LOOSE_BYTES):
                yield from self._split(bytes(loose), [])
                loose.clear()
            if opcode == Opcode.CHUNK:
                chunk = content
            elif opcode == Opcode.FOOTER:
                self._broken("has no end of data")
            elif opcode == Opcode.DATA_END:
                self._check_crc(self._parse(DataEnd, content).data_section_crc, crc_before)
                break
        self._finish()

    def _finish(self) -> None:
        """Read the summary, the footer and the closing magic."""
        self._crc, start = 0, self._at
        while True:
            crc_before = self._crc
            opcode, content = self._record()
            if opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                self._broken("has messages behind its end of data")
            if opcode == Opcode.STATISTICS:
                count = self._parse(Statistics, content).message_count
                if count != self._messages:
                    self._broken(f"holds {self._messages} messages but its statistics say {count}")
            if opcode == Opcode.FOOTER:
                break
        footer = self._parse(Footer, content)
        if footer.summary_start not in (0, start):
            self._broken("has a summary in the wrong place")
        head = _RECORD.pack(opcode, len(content)) + content[:16]
        self._check_crc(footer.summary_crc, zlib.crc32(head, crc_before))
        if self._take(8) != _MAGIC or self._at != self._size:
            self._broken("does not end where it should")

    def _take(self, length: int) -> bytes:
        if length > self._size - self._at:
            self._broken("ends early: the recording was cut off", self._size)
        data = self._file.read(length)
        if len(data) != length:
            self._broken("ends early: the recording was cut off")
        self._at += length
        self._crc = zlib.crc32(data, self._crc)
        return data

    def _record(self) -> tuple[int, bytes]:
        start = self._at
        opcode, length = _RECORD.unpack(self._take(9))
        if opcode == 0:
            self._broken("is corrupted", start)
        if MAX_RECORD < length <= self._size - self._at:
            self._broken(f"has a record of {length} bytes, more than the {MAX_RECORD} allowed")
        return opcode, self._take(length)

    def _parse(self, kind: Any, content: bytes) -> Any:
        try:
            return kind.read(ReadDataStream(BytesIO(content)))
        except (McapError, struct.error, UnicodeDecodeError, OverflowError):
            self._broken(f"has a corrupted {kind.__name__} record")

    def _check_crc(self, expected: int, actual: int) -> None:
        if expected not in (0, actual):
            self._broken("is corrupted: a checksum does not match")

    def _unpacked(self, content: bytes, index: list[bytes]) -> Iterator[Block]:
        """Unpack a chunk and yield its messages."""
        chunk = self._parse(Chunk, content)
        size = chunk.uncompressed_size
        if size > MAX_RECORD:
            self._broken(
                f"has a chunk that claims {size} bytes, more than the {MAX_RECORD} allowed"
            )
        data = self._decompress(chunk.compression, chunk.data, size)
        if len(data) != size:
            self._broken(f"has a chunk of {len(data)} bytes that claims {size}")
        self._check_crc(chunk.uncompressed_crc, zlib.crc32(data))
        yield from self._split(data, index)

    def _decompress(self, compression: str, data: bytes, size: int) -> bytes:
        try:
            if compression == "":
                return data
            if compression == "zstd":
                # The frame's own claim is what zstandard allocates.
                if zstandard.frame_content_size(data) not in (-1, size):
                    self._broken("has a chunk whose claimed sizes differ")
                return self._zstd.decompress(data, size, allow_extra_data=False)
            if compression == "lz4":
                return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        except (zstandard.ZstdError, RuntimeError, EOFError):
            self._broken("has a chunk that cannot be decompressed")
        self._broken(f"has a chunk with the unknown compression {compression!r}")

    def _split(self, data: bytes, index: list[bytes]) -> Iterator[Block]:
        """Find the messages of a chunk; its index is a hint, every byte is accounted for."""
        view = np.frombuffer(data, np.uint8)
        indexed, gaps = indexed_messages(view, index)
        walked = [offset for start, end in gaps for offset in self._walk(data, start, end)]
        messages = np.sort(np.append(indexed, np.array(walked, np.int64)), kind="stable")
        self._messages += len(messages)
        lengths = gather(view, messages + 1, "<u8").astype(np.int64)
        channels = gather(view, messages + 9, "<u2")
        for channel in np.unique(channels).tolist():
            if channel not in self._topics:
                self._broken(f"has messages on the unknown channel {channel}")
            mine = np.flatnonzero(channels == channel)
            yield Block(
                self._topics[channel],
                view,
                messages[mine] + 9 + MESSAGE_HEAD,
                lengths[mine] - MESSAGE_HEAD,
            )

    def _walk(self, data: bytes, at: int, end: int) -> list[int]:
        """Take in the schemas and channels between `at` and `end`; return offsets of messages."""
        messages = []
        while at < end:
            if at + 9 > end:
                self._broken("has a corrupted chunk")
            opcode, length = _RECORD.unpack_from(data, at)
            body = at + 9
            if length > end - body or opcode == 0:
                self._broken("has a corrupted chunk")
            if opcode == Opcode.MESSAGE:
                if length < MESSAGE_HEAD:
                    self._broken("has a corrupted message")
                messages.append(at)
            elif opcode == Opcode.SCHEMA:
                self._add_schema(self._parse(Schema, data[body : body + length]))
            elif opcode == Opcode.CHANNEL:
                self._add_channel(self._parse(Channel, data[body : body + length]))
            at = body + length
        return messages

    def _add_schema(self, schema: Schema) -> None:
        if self._schemas.setdefault(schema.id, schema) != schema:
            self._broken(f"defines schema {schema.id} twice, differently")

    def _add_channel(self, channel: Channel) -> None:
        if self._channels.setdefault(channel.id, channel) != channel:
            self._broken(f"defines channel {channel.id} twice, differently")
        schema = self._schemas.get(channel.schema_id)
        if schema is None:
            self._broken(f"has the topic {channel.topic} without a message definition")
        self._topics[channel.id] = Topic(
            channel.topic,
            schema.name,
            schema.data.decode("utf-8", "replace"),
            schema.encoding,
            channel.message_encoding,
        )

    def _broken(self, what: str, at: int | None = None) -> NoReturn:
        where = self._at if at is None else at
        raise InputError(f"{self._path}: the file {what} (near byte {where}); {MEND}.")
