"""MCAP storage for `rosbags` with checksums, and quick enough to record a lockstep at full speed.

`rosbags` writes every MCAP checksum as zero ("none"), so that a flipped byte of a sample could pass
unseen. This storage fills in the three checksums of the format (each chunk, the data section, the
summary), which any MCAP reader can verify.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log and publish time
_MESSAGE_OPCODE = 5
_MESSAGE_HEAD = 22
_CHUNK_SIZE = 2**20
_CHUNK_CRC_AT = 9 + 24  # behind the record's head, start, end and size
_TAIL = 1 + 8 + 8 + 8 + 4 + 8  # footer record and closing magic
_DATA_END = 1 + 8 + 4


class ChecksummedMcapWriter(McapWriter):
    """The MCAP storage of `rosbags` with checksums and a quick way to append whole samples."""

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        """Compress the chunks with zstd whatever `compression` says; see rosbags for the rest."""
        super().__init__(path, CompressionMode.STORAGE)

    def write_sample(
        self, stamp_ns: int, channels: Iterable[int], payloads: Iterable[bytes]
    ) -> None:
        """Append one message for each channel, all at the same log time.

        Does what `McapWriter.write` does for each of them, without its per-message overhead; the
        counts of messages are kept by the caller (see `count_samples`).
        """
        chunk = self.chunk
        if stamp_ns < chunk.message_start_time:
            chunk.message_start_time = stamp_ns
        if stamp_ns > chunk.message_end_time:
            chunk.message_end_time = stamp_ns
        at = chunk.bio.tell()
        parts: list[bytes] = []
        for channel, payload in zip(channels, payloads, strict=True):
            size = _MESSAGE_HEAD + len(payload)
            head = _MESSAGE.pack(_MESSAGE_OPCODE, size, channel, 0, stamp_ns, stamp_ns)
            parts += (head, payload)
            chunk.msgs[channel].append((stamp_ns, at))
            at += 9 + size
        chunk.bio.write(b"".join(parts))
        if at > _CHUNK_SIZE:
            self.close_chunk()

    def count_samples(self, channels: Iterable[int], samples: int) -> None:
        """Enter into the file's statistics how many samples `write_sample` has appended."""
        for channel in channels:
            self.channel_stats[channel] += samples

    def close_chunk(self) -> None:
        """Write the pending chunk with its checksum."""
        self.message_start_time = min(self.message_start_time, self.chunk.message_start_time)
        self.message_end_time = max(self.message_end_time, self.chunk.message_end_time)
        checksum = zlib.crc32(self.chunk.bio.getvalue())
        chunk_start = self.bio.tell()
        super().close_chunk()
        self.bio.seek(chunk_start + _CHUNK_CRC_AT)
        self.bio.write(checksum.to_bytes(4, "little"))
        self.bio.seek(0, os.SEEK_END)

    def close(self, version: int, metadata: str) -> None:
        """Finish the file, then enter the checksums of its data section and its summary."""
        super().close(version, metadata)
        with self.path.open("r+b") as file:
            _enter_checksums(file)
            file.flush()
            os.fsync(file.fileno())


class ChecksummedWriter(Writer):
    """`rosbags.rosbag2.Writer` on the storage with checksums."""

    STORAGE_PLUGINS = {StoragePlugin.MCAP: ChecksummedMcapWriter}  # noqa: RUF012 as in rosbags


def _enter_checksums(file: BinaryIO) -> None:
    size = file.seek(-_TAIL, os.SEEK_END) + _TAIL
    summary_start = int.from_bytes(file.read(17)[9:], "little")
    data_end = summary_start - _DATA_END
    data_crc = _crc32(file, 0, data_end)
    file.seek(data_end + 9)
    file.write(data_crc.to_bytes(4, "little"))
    summary_crc = _crc32(file, summary_start, size - 12)
    file.seek(size - 12)
    file.write(summary_crc.to_bytes(4, "little"))


def _crc32(file: BinaryIO, start: int, end: int) -> int:
    file.seek(start)
    checksum = 0
    while start < end:
        part = file.read(min(_CHUNK_SIZE, end - start))
        checksum = zlib.crc32(part, checksum)
        start += len(part)
    return checksum
