"""Reads the sqlite3 storage of rosbag2 through rosbags, message by message: slower than MCAP."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from .errors import InputError
from .mcap_blocks import MEND, Block, Topic

_BATCH = 4096


def read_sqlite_blocks(path: Path) -> Iterator[Block]:
    """Yield the messages of one sqlite3 file in the order of their log times.

    The format has no checksums: a flipped byte inside a value cannot be found.

    Raises:
        InputError: the file cannot be read as a bag.
    """
    reader = Sqlite3Reader(path)
    try:
        reader.open()
        topics = {each.id: _topic(each) for each in reader.connections}
        messages = iter(reader.messages(reader.connections))
        while batch := list(islice(messages, _BATCH)):
            yield from _blocks(batch, topics)
    except InputError:
        raise
    except Exception:  # sqlite and rosbags raise many kinds on a damaged file
        raise InputError(
            f"{path}: the file is not a readable sqlite3 bag; convert it to mcap with "
            f"`ros2 bag convert` or {MEND}."
        ) from None
    finally:
        if reader.dbconn:
            reader.close()


def _topic(connection) -> Topic:
    definition = connection.msgdef
    kind = "ros2idl" if definition.format == MessageDefinitionFormat.IDL else "ros2msg"
    encoding = connection.ext.serialization_format
    return Topic(connection.topic, connection.msgtype, definition.data, kind, encoding)


def _blocks(batch: list, topics: dict[int, Topic]) -> Iterator[Block]:
    by_topic: dict[int, list[bytes]] = {}
    for connection, _, data in batch:
        by_topic.setdefault(connection.id, []).append(data)
    for number, payloads in by_topic.items():
        sizes = np.array([len(payload) for payload in payloads], np.int64)
        data = np.frombuffer(b"".join(payloads), np.uint8)
        yield Block(topics[number], data, np.cumsum(sizes) - sizes, sizes)
