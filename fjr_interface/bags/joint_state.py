"""sensor_msgs/msg/JointState in CDR: one scalar per message, packed and unpacked at full speed.

The rig's messages have one joint and one value, so their CDR form has a fixed layout and only
16 bytes change. `JointStateWriter` fills those in; `Layout` finds them in any JointState, ours or
foreign, and decodes a whole block of equally laid out messages at once.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from ..topics import Field

_LITTLE_ENDIAN_CDR = b"\x00\x01"
_ORIGIN = 4  # CDR alignment counts from behind the encapsulation header
_STAMP = struct.Struct("<iI")
_DOUBLE = struct.Struct("<d")
FIELDS: tuple[Field, ...] = ("position", "velocity", "effort")


class LayoutError(ValueError):
    """The bytes are not a complete little-endian CDR JointState."""


def _align(offset: int, size: int) -> int:
    return _ORIGIN + -(-(offset - _ORIGIN) // size) * size


@dataclass(frozen=True)
class Layout:
    """Where the parts of a serialized JointState lie.

    Attributes:
        size: length of the payload in bytes, without trailing padding.
        names: joint names.
        offsets: byte offset of the first value of each field.
        counts: number of values of each field.
        padding: byte ranges of alignment, in which Fast CDR leaves whatever was in memory.
    """

    size: int
    names: tuple[str, ...]
    offsets: dict[str, int]
    counts: dict[str, int]
    padding: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, payload: bytes) -> Layout:
        """Parse the layout of one message; raise LayoutError on anything malformed."""
        if len(payload) < 16 or payload[:2] != _LITTLE_ENDIAN_CDR:
            raise LayoutError("not a little-endian CDR message")
        padding: list[tuple[int, int]] = []

        def aligned(at: int, size: int) -> int:
            padding.append((at, _align(at, size)))
            return padding[-1][1]

        def uint32(at: int) -> int:
            if at + 4 > len(payload):
                raise LayoutError("message ends early")
            return int.from_bytes(payload[at : at + 4], "little")

        def string(at: int) -> tuple[str, int]:
            length = uint32(at)
            end = at + 4 + length
            if end > len(payload) or length == 0 or payload[end - 1]:
                raise LayoutError("string runs beyond the message")
            try:
                return payload[at + 4 : end - 1].decode(), end
            except UnicodeDecodeError as error:
                raise LayoutError("string is not UTF-8") from error

        _, at = string(12)
        at = aligned(at, 4)
        count, at = uint32(at), at + 4
        if count > len(payload):
            raise LayoutError("absurd number of joints")
        names = []
        for _ in range(count):
            name, at = string(aligned(at, 4))
            names.append(name)
        offsets: dict[str, int] = {}
        counts: dict[str, int] = {}
        for field in FIELDS:
            at = aligned(at, 4)
            counts[field], at = uint32(at), at + 4
            if counts[field]:
                at = aligned(at, 8)
            offsets[field] = at
            at += 8 * counts[field]
            if at > len(payload):
                raise LayoutError("values run beyond the message")
        return cls(at, tuple(names), offsets, counts, tuple(padding))

    def value_offset(self, field: str, joint: str | None = None) -> int:
        """Return the byte offset of a joint's value (None: the first); LayoutError if absent."""
        if joint is not None and joint not in self.names:
            raise LayoutError(f"joint {joint!r} is not among {', '.join(self.names) or 'no names'}")
        index = 0 if joint is None else self.names.index(joint)
        if index >= self.counts[field]:
            raise LayoutError(f"{field}[{index}] is empty")
        return self.offsets[field] + 8 * index

    def decode(self, block: np.ndarray, field: str, joint: str | None = None):
        """Decode messages that share this layout.

        Args:
            block: uint8 of shape (messages, bytes), bytes >= size.
            field: position, velocity or effort.
            joint: joint name; None takes the first value.

        Returns:
            (stamps, values): int64 nanoseconds and float64, both of shape (messages,).

        Raises:
            LayoutError: a message of the block is laid out differently.
        """
        structural = np.ones(self.size, bool)
        structural[4:12] = False
        for name in FIELDS:
            structural[self.offsets[name] : self.offsets[name] + 8 * self.counts[name]] = False
        for start, end in self.padding:
            structural[start:end] = False
        where = np.flatnonzero(structural)
        if not (block[:, where] == block[0, where]).all():
            raise LayoutError("messages are laid out differently")
        at = self.value_offset(field, joint)
        seconds = block[:, 4:8].view("<i4")[:, 0].astype(np.int64)
        nanoseconds = block[:, 8:12].view("<u4")[:, 0]
        values = block[:, at : at + 8].view("<f8")[:, 0].copy()
        return seconds * 1_000_000_000 + nanoseconds, values


def _template(joint: str, field: Field) -> bytes:
    """Return the CDR bytes of a JointState with one joint and a zero in one field."""
    out = bytearray(_LITTLE_ENDIAN_CDR + bytes(10))

    def pad(size: int) -> None:
        out.extend(bytes(_align(len(out), size) - len(out)))

    def uint32(value: int) -> None:
        pad(4)
        out.extend(value.to_bytes(4, "little"))

    uint32(1)
    out.extend(b"\0")
    uint32(1)
    encoded = joint.encode() + b"\0"
    uint32(len(encoded))
    out.extend(encoded)
    for name in FIELDS:
        uint32(int(name == field))
        if name == field:
            pad(8)
            out.extend(bytes(8))
    return bytes(out)


class JointStateWriter:
    """Serializes one scalar signal: `encode(stamp, value)` gives the CDR bytes of a message."""

    def __init__(self, field: Field, joint: str) -> None:
        """Prepare messages with `name[0] = joint` and the value in `field[0]`."""
        self.template = _template(joint, field)
        self._value_at = Layout.of(self.template).value_offset(field)
        self._buffer = bytearray(self.template)

    def encode(self, stamp_ns: int, value: float) -> bytes:
        """Return the CDR bytes of one message."""
        _STAMP.pack_into(self._buffer, 4, *divmod(stamp_ns, 1_000_000_000))
        _DOUBLE.pack_into(self._buffer, self._value_at, value)
        return bytes(self._buffer)

    def encode_many(self, stamps_ns: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return uint8 (samples, bytes): row i equals `encode(stamps_ns[i], values[i])`."""
        out = np.tile(np.frombuffer(self.template, np.uint8), (len(stamps_ns), 1))
        seconds, nanoseconds = np.divmod(np.asarray(stamps_ns, np.int64), 1_000_000_000)
        out[:, 4:8] = seconds.astype("<i4")[:, None].view(np.uint8)
        out[:, 8:12] = nanoseconds.astype("<u4")[:, None].view(np.uint8)
        at = self._value_at
        out[:, at : at + 8] = np.asarray(values, "<f8")[:, None].view(np.uint8)
        return out


class JointStateReader:
    """Decodes one scalar signal message by message, as the nodes do."""

    def __init__(self, field: Field, joint: str | None = None) -> None:
        """Read `field` of the named joint (None: the first value)."""
        self._field, self._joint = field, joint
        self._size = -1
        self._head = b""
        self._value_at = 0

    def decode(self, payload: bytes) -> tuple[int, float]:
        """Return (stamp in ns, value); raise LayoutError on a malformed message."""
        # The bytes from frame_id to the value fix the layout; a change of them is rare.
        if len(payload) != self._size or payload[12 : self._value_at] != self._head:
            layout = Layout.of(payload)
            self._value_at = layout.value_offset(self._field, self._joint)
            self._size, self._head = len(payload), payload[12 : self._value_at]
            if layout.counts[self._field] != 1 or len(layout.names) > 1:
                self._size = -1  # several values may stand between: parse each message
        seconds, nanoseconds = _STAMP.unpack_from(payload, 4)
        return seconds * 1_000_000_000 + nanoseconds, _DOUBLE.unpack_from(payload, self._value_at)[
            0
        ]
