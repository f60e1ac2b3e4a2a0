"""Uses the message index of an MCAP chunk without trusting it."""

from __future__ import annotations

import numpy as np
from mcap.opcode import Opcode

MESSAGE_HEAD = 22
"""Bytes of a message record between its length and its payload."""


def gather(data: np.ndarray, offsets: np.ndarray, dtype: str) -> np.ndarray:
    """Return the items of a type that begin at byte offsets into the contiguous uint8 `data`.

    Raises:
        IndexError: an item runs beyond the data.
    """
    if not len(offsets):
        return np.empty(0, dtype)
    items = max(0, len(data) - np.dtype(dtype).itemsize + 1)
    return np.ndarray((items,), dtype, data, strides=(1,))[offsets]


def indexed_messages(
    data: np.ndarray, index: list[bytes]
) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Find the messages of an unpacked chunk by its index records.

    Returns:
        (offsets, gaps): int64 offsets of message records, rising, and the ranges of bytes that they
        leave over, in which there may be more. If the index is absent or points anywhere but at
        messages that do not overlap, there are no offsets and one gap, the whole chunk.
    """
    nothing = np.empty(0, np.int64), [(0, len(data))]
    if not index or any(len(part) < 6 or (len(part) - 6) % 16 for part in index):
        return nothing
    columns = [np.frombuffer(part, "<u8", offset=6)[1::2] for part in index]
    unsigned = np.sort(np.concatenate(columns), kind="stable")
    last = len(data) - 9 - MESSAGE_HEAD
    if not len(unsigned) or last < 0 or unsigned[-1] > last:
        return nothing
    offsets = unsigned.astype(np.int64)
    lengths = gather(data, offsets + 1, "<u8")
    if (data[offsets] != Opcode.MESSAGE).any() or (lengths > len(data)).any():
        return nothing
    ends = offsets + 9 + lengths.astype(np.int64)
    following = np.append(offsets[1:], len(data))
    if (ends > following).any() or (lengths < MESSAGE_HEAD).any():
        return nothing
    holes = np.flatnonzero(ends != following)
    between = zip(ends[holes].tolist(), following[holes].tolist(), strict=True)
    return offsets, [(0, int(offsets[0])), *between]
