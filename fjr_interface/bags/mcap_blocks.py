"""Reads an MCAP file chunk by chunk into blocks of messages, fast, and trusting nothing.

Every length is checked against the file before it is used, so a damaged file costs an InputError
and never more memory than two chunks of `MAX_RECORD` bytes. All checksums of the format are
verified where they are present: the bags of `writer` carry all of them. Many foreign recorders
(plain rosbags among them) leave them out; in their bags a flipped byte inside a sample's value
cannot be told from a measurement unless the compression stumbles over it.

A recorder that crashed leaves a file without its end: no summary, no footer, perhaps half a record.
`McapFile` reads what is there of such a file if asked to; a file that was closed is always read in
full or refused.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, DataEnd, Footer, Statistics

from fjr_kit.errors import InputError

from .blocks import MAX_RECORD, MEND, Block
from .mcap_messages import RECORD, MessageFinder

MAGIC = b"\x89MCAP0\r\n"
_LOOSE_BYTES = 2**20


class _CutOff(Exception):
    """The file ends early."""


class McapFile:
    """One MCAP file, read once.

    Attributes:
        lost_bytes: length of the incomplete record at the end of a file that was never closed, zero
            if only its summary is cut off; None if it was closed. Known when all blocks were read.
    """

    def __init__(self, path: Path, *, unclosed: bool = False) -> None:
        """Read `path`; `unclosed` says that a file which was never closed is good up to its end."""
        self.lost_bytes: int | None = None
        self._path = path
        self._allowed = unclosed
        self._unclosed = False
        self._file: Any = None
        self._size = self._at = self._crc = 0
        self._zstd = zstandard.ZstdDecompressor()

    def blocks(self) -> Iterator[Block]:
        """Yield the messages in file order, blocks of one topic of one chunk each.

        Raises:
            InputError: the file is truncated, corrupted, absurd, or cannot be read.
        """
        try:
            with self._path.open("rb") as self._file:
                self._size = os.fstat(self._file.fileno()).st_size
                self._unclosed = self._allowed and not is_closed(self._file, self._size)
                self._finder = MessageFinder(self._size, self._broken)
                yield from self._data()
                if not self._unclosed:
                    self._finish()
                elif self.lost_bytes is None:  # only the summary was cut off
                    self.lost_bytes = 0
        except OSError as error:
            raise InputError(f"{self._path}: cannot be read ({error.strerror}).") from None

    def _data(self) -> Iterator[Block]:
        """Read up to the end of data; that of an unclosed file is behind its last whole record."""
        if self._take(8) != MAGIC:
            self._broken("is not an MCAP file")
        loose = bytearray()
        chunk: bytes | None = None
        index: list[bytes] = []
        while True:
            crc_before, start = self._crc, self._at
            try:
                opcode, content = self._record()
            except _CutOff:
                self.lost_bytes = self._size - start
                opcode, content = Opcode.DATA_END, bytes(4)
            if opcode == Opcode.MESSAGE_INDEX and chunk is not None:
                index.append(content)
                continue
            if chunk is not None:
                yield from self._unpacked(chunk, index)
                chunk, index = None, []
            if opcode in (Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
                loose += RECORD.pack(opcode, len(content)) + content
            if loose and (opcode in (Opcode.CHUNK, Opcode.DATA_END) or len(loose) > _LOOSE_BYTES):
                yield from self._finder.find(bytes(loose), [])
                loose.clear()
            if opcode == Opcode.CHUNK:
                chunk = content
            elif opcode == Opcode.FOOTER:
                self._broken("has no end of data")
            elif opcode == Opcode.DATA_END:
                end: DataEnd = self._finder.parse(DataEnd, content)
                self._check_crc(end.data_section_crc, crc_before)
                return

    def _finish(self) -> None:
        """Read the summary, the footer and the closing magic."""
        self._crc, start = 0, self._at
        while True:
            crc_before = self._crc
            opcode, content = self._record()
            if opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                self._broken("has messages behind its end of data")
            if opcode == Opcode.STATISTICS:
                count = self._finder.parse(Statistics, content).message_count
                found = self._finder.messages
                if count != found:
                    self._broken(f"holds {found} messages but its statistics say {count}")
            if opcode == Opcode.FOOTER:
                break
        footer = self._finder.parse(Footer, content)
        if footer.summary_start not in (0, start):
            self._broken("has a summary in the wrong place")
        head = RECORD.pack(opcode, len(content)) + content[:16]
        self._check_crc(footer.summary_crc, zlib.crc32(head, crc_before))
        if self._take(8) != MAGIC or self._at != self._size:
            self._broken("does not end where it should")

    def _take(self, length: int) -> bytes:
        if length > self._size - self._at:
            if self._unclosed:
                raise _CutOff
            self._broken("ends early: the recording was cut off", self._size)
        data = self._file.read(length)
        if len(data) != length:
            self._broken("ends early: the recording was cut off")
        self._at += length
        self._crc = zlib.crc32(data, self._crc)
        return data

    def _record(self) -> tuple[int, bytes]:
        start = self._at
        opcode, length = RECORD.unpack(self._take(9))
        if opcode == 0:
            self._broken("is corrupted", start)
        if MAX_RECORD < length <= self._size - self._at:
            self._broken(f"has a record of {length} bytes, more than the {MAX_RECORD} allowed")
        return opcode, self._take(length)

    def _check_crc(self, expected: int, actual: int) -> None:
        if expected not in (0, actual):
            self._broken("is corrupted: a checksum does not match")

    def _unpacked(self, content: bytes, index: list[bytes]) -> Iterator[Block]:
        """Unpack a chunk and yield its messages."""
        chunk: Chunk = self._finder.parse(Chunk, content)
        size = chunk.uncompressed_size
        if size > MAX_RECORD:
            self._broken(
                f"has a chunk that claims {size} bytes, more than the {MAX_RECORD} allowed"
            )
        self._finder.unpacked(size)
        data = self._decompress(chunk.compression, chunk.data, size)
        if len(data) != size:
            self._broken(f"has a chunk of {len(data)} bytes that claims {size}")
        self._check_crc(chunk.uncompressed_crc, zlib.crc32(data))
        yield from self._finder.find(data, index)

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

    def _broken(self, what: str, at: int | None = None) -> NoReturn:
        where = self._at if at is None else at
        raise InputError(f"{self._path}: the file {what} (near byte {where}); {MEND}.")


def is_closed(file: Any, size: int) -> bool:
    """Tell whether an open MCAP file ends as one that its recorder closed; rewind it."""
    file.seek(max(0, size - len(MAGIC)))
    closed: bool = size > len(MAGIC) and file.read() == MAGIC
    file.seek(0)
    return closed
