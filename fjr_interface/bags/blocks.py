"""Blocks of messages, as every storage of a bag gives them, and the bounds that hold for all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MEND = "record it again"

MAX_RECORD = 128 * 2**20
"""Greatest size in bytes of one record, message, or chunk unpacked."""

BLOCK_MESSAGES = 2**16
BLOCK_BYTES = 8 * 2**20
"""A block holds at most so many messages, and messages of so many bytes, or a single one."""


@dataclass(frozen=True)
class Topic:
    """Where messages come from: topic, type (as `pkg/msg/Name`) and definition of the type.

    `qos` holds the offered QoS profiles as the recorder wrote them (YAML), empty if it did not.
    """

    name: str
    type: str
    definition: str
    definition_format: str
    encoding: str
    qos: str = ""


@dataclass(frozen=True)
class Block:
    """Consecutive messages of one topic.

    Blocks of several topics that were recorded together have the same `data`; their messages were
    recorded in the order of their starts.

    Attributes:
        topic: where they come from.
        data: uint8, the bytes in which they lie.
        starts: int64 (messages,), offset of each payload in data.
        sizes: int64 (messages,), length of each payload in bytes.
        times: int64 (messages,), time of recording in ns.
    """

    topic: Topic
    data: np.ndarray
    starts: np.ndarray
    sizes: np.ndarray
    times: np.ndarray

    def payload(self, message: int) -> bytes:
        """Return the bytes of one message."""
        start = self.starts[message]
        return self.data[start : start + self.sizes[message]].tobytes()

    @classmethod
    def unread(cls, topic: Topic, messages: int) -> Block:
        """Return a block of messages that are only counted: it has no data."""
        none = np.broadcast_to(np.int64(0), (messages,))
        return cls(topic, np.empty(0, np.uint8), none, none, none)
