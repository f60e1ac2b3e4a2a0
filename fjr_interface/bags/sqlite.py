"""Reads the sqlite3 storage of rosbag2: slower than MCAP, but no more of it than is asked for.

The format has no checksums: a flipped byte inside a value cannot be found.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from .blocks import BLOCK_BYTES, BLOCK_MESSAGES, MAX_RECORD, MEND, Block, Topic

_NEEDED = ("topics", "messages")
_DEFINITIONS = "message_definitions"
_STEPS = 100_000
_FREE_STEPS = 10_000_000
_STEPS_PER_BYTE = 10


class SqliteFile:
    """One sqlite3 file.

    A stranger's database may compute its columns, follow its pages in circles, or point many rows
    at the same bytes. Only plain tables are read, and steps and bytes are bounded by the size of
    the file.
    """

    def __init__(self, path: Path) -> None:
        """Open the file when it is read."""
        self._path = path

    def survey(self) -> tuple[list[tuple[Topic, int]], int, int]:
        """Return all topics with their numbers of messages, and the first and last time in ns.

        Raises:
            InputError: the file cannot be read as a bag.
        """
        with self._open() as database:
            ((first, last),) = database.execute(
                "SELECT min(timestamp), max(timestamp) FROM messages"
            )
            return list(_topics(database).values()), int(first or 0), int(last or 0)

    def blocks(self, wanted: Collection[str]) -> Iterator[Block]:
        """Yield the messages of the wanted topics by time of recording, and count the others.

        Raises:
            InputError: the file cannot be read as a bag.
        """
        with self._open() as database:
            topics = _topics(database)
            asked = {number for number, (topic, _) in topics.items() if topic.name in wanted}
            yield from self._read(database, {number: topics[number][0] for number in asked})
            for number in topics.keys() - asked:
                yield Block.unread(*topics[number])

    def _read(self, database: sqlite3.Connection, topics: dict[int, Topic]) -> Iterator[Block]:
        rows = database.execute(
            "SELECT topic_id, timestamp, CASE WHEN length(data) <= ? THEN data END FROM messages "
            f"WHERE topic_id IN ({','.join('?' * len(topics))}) ORDER BY timestamp, id",
            (MAX_RECORD, *topics),
        )
        left = self._path.stat().st_size
        batch: list[tuple[int, int, bytes]] = []
        size = 0
        for row in rows:
            number, time, data = row
            if not isinstance(time, int) or not isinstance(data, bytes):
                raise ValueError("a message must have a time and bytes")
            left -= len(data)
            if left < 0:
                raise ValueError("the messages have more bytes than the file")
            if batch and (len(batch) == BLOCK_MESSAGES or size + len(data) > BLOCK_BYTES):
                yield from _blocks(batch, topics)
                batch, size = [], 0
            batch.append((number, time, data))
            size += len(data)
        yield from _blocks(batch, topics)

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        log = self._path.with_name(f"{self._path.name}-wal")
        try:
            if log.exists() and log.stat().st_size:
                raise InputError(
                    f"{self._path}: some messages are still in {log.name}; open the file once with "
                    "`sqlite3`, which takes them in."
                )
            # As a URI, in which %, # and ? of a path would have a meaning of their own.
            uri = f"{self._path.absolute().as_uri()}?mode=ro&immutable=1"
            opened = sqlite3.connect(uri, uri=True, check_same_thread=False)
        except (OSError, sqlite3.Error):
            raise self._unreadable() from None
        try:
            with closing(opened) as database:
                database.execute("PRAGMA trusted_schema = OFF")
                self._limit_steps(database)
                _refuse_computed(database)
                yield database
        except Exception:  # sqlite raises many kinds on a damaged file
            raise self._unreadable() from None

    def _limit_steps(self, database: sqlite3.Connection) -> None:
        left = _FREE_STEPS + _STEPS_PER_BYTE * self._path.stat().st_size

        def spent() -> bool:
            nonlocal left
            left -= _STEPS
            return left < 0

        database.set_progress_handler(spent, _STEPS)

    def _unreadable(self) -> InputError:
        return InputError(
            f"{self._path}: the file is not a readable sqlite3 bag; convert it to mcap with "
            f"`ros2 bag convert` or {MEND}."
        )


def _refuse_computed(database: sqlite3.Connection) -> None:
    """Raise ValueError unless the tables to read are there, and are tables of stored values."""
    for name in (*_NEEDED, _DEFINITIONS):
        found = database.execute(
            "SELECT type, rootpage FROM sqlite_master WHERE name = ?", (name,)
        ).fetchall()
        if not found and name == _DEFINITIONS:
            continue
        if [kind for kind, _ in found] != ["table"] or not found[0][1]:
            raise ValueError(f"{name} is no table")
        columns = database.execute(f"PRAGMA table_xinfo({name})").fetchall()
        if any(column[6] for column in columns):
            raise ValueError(f"{name} has computed columns")


def _topics(database: sqlite3.Connection) -> dict[int, tuple[Topic, int]]:
    """Return the topics by id, and how many messages each has."""
    definitions: dict[str, tuple[str, str]] = {}
    if _columns(database, _DEFINITIONS):
        for kind, encoding, text in database.execute(
            f"SELECT topic_type, encoding, encoded_message_definition FROM {_DEFINITIONS}"
        ):
            definitions.setdefault(kind, (text, encoding))
    counts = dict(database.execute("SELECT topic_id, count(*) FROM messages GROUP BY topic_id"))
    qos = "offered_qos_profiles" if "offered_qos_profiles" in _columns(database, "topics") else "''"
    topics = {}
    for number, name, kind, encoding, offered in database.execute(
        f"SELECT id, name, type, serialization_format, {qos} FROM topics ORDER BY id"
    ):
        text, form = definitions.get(kind, ("", "ros2msg"))
        if not all(isinstance(each, str) for each in (name, kind, encoding, offered, text, form)):
            raise ValueError("a topic must be described by texts")
        topics[number] = Topic(name, kind, text, form, encoding, offered), counts.pop(number, 0)
    if counts:
        raise ValueError("there are messages without a topic")
    return topics


def _columns(database: sqlite3.Connection, table: str) -> set[str]:
    return {column[1] for column in database.execute(f"PRAGMA table_info({table})")}


def _blocks(batch: list[tuple[int, int, bytes]], topics: dict[int, Topic]) -> Iterator[Block]:
    if not batch:
        return
    numbers = np.array([number for number, _, _ in batch])
    times = np.array([time for _, time, _ in batch], np.int64)
    sizes = np.array([len(payload) for _, _, payload in batch], np.int64)
    starts = np.cumsum(sizes) - sizes
    data = np.frombuffer(b"".join(payload for _, _, payload in batch), np.uint8)
    for number in dict.fromkeys(numbers.tolist()):
        mine = np.flatnonzero(numbers == number)
        yield Block(topics[number], data, starts[mine], sizes[mine], times[mine])
