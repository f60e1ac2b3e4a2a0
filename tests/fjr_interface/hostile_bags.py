"""Small bags that mean much: each a few kilobytes that once cost gigabytes or minutes."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from pathlib import Path

from bag_tools import MS, WHOLE, foreign_bag, rig_streams, serialize
from mcap.data_stream import RecordBuilder
from mcap.records import Message
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as LibraryWriter
from rosbags.rosbag2 import StoragePlugin

MAP = (
    "reference=none",
    "torque=/rig/motor_torque:effort",
    "position=/rig/motor_position:position",
)
STRANGE = "strange_msgs/msg/Strange"
SIGNAL = serialize(MS, "", ["joint"], position=[1.0], effort=[1.0])


def add_empty_messages(writer: LibraryWriter, channel: int, count: int) -> None:
    """Add messages without a payload to the chunk under way, all at once: millions are soon added.

    The library adds each by itself, so this does what it does, by its private names.
    """
    one = RecordBuilder()
    Message(channel_id=channel, log_time=0, data=b"", publish_time=0, sequence=0).write(one)
    chunk, statistics = writer._Writer__chunk_builder, writer._Writer__statistics
    chunk.record_writer.write(one.end() * count)
    chunk.num_messages += count
    statistics.channel_message_counts[channel] += count
    statistics.message_count += count
    chunk.message_start_time = statistics.message_start_time = 0


def mcap_bag(
    folder: Path,
    messages: list[tuple[str, int, bytes]],
    definition: tuple[str, str, str],
    empty: int = 0,
    **options,
) -> Path:
    """Write messages (topic, time, payload) of one type: its name, its encoding and definition.

    Then as many without a payload as `empty` says, on the topic of the first.
    """
    bag = folder / "bag"
    bag.mkdir()
    counts = Counter(topic for topic, _, _ in messages)
    counts[messages[0][0]] += empty
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": ["bag.mcap"],
        "message_count": len(messages) + empty,
        "topics_with_message_count": [
            {"message_count": count, "topic_metadata": {"name": topic, "type": definition[0]}}
            for topic, count in counts.items()
        ],
    }
    text = json.dumps({"rosbag2_bagfile_information": information})
    (bag / "metadata.yaml").write_text(text)  # JSON is YAML
    with (bag / "bag.mcap").open("wb") as sink:
        writer = LibraryWriter(sink, compression=CompressionType.ZSTD, **options)
        writer.start(profile="ros2")
        name, encoding, text = definition
        schema = writer.register_schema(name, encoding, text.encode())
        channels = {topic: writer.register_channel(topic, "cdr", schema) for topic in counts}
        for topic, time, payload in messages:
            writer.add_message(channels[topic], time, payload, time)
        if empty:
            add_empty_messages(writer, channels[messages[0][0]], empty)
        writer.finish()
    return bag


def described(folder: Path, definition: str, encoding: str = "ros2msg") -> Path:
    """Return a bag of signals whose type has this definition."""
    topics = ("/rig/motor_position", "/rig/motor_torque")
    messages = [(topic, k * MS, SIGNAL) for k in range(1, 9) for topic in topics]
    return mcap_bag(folder, messages, (STRANGE, encoding, definition))


def _idl(constant: str) -> str:
    return (
        f"module strange_msgs {{ module msg {{ {constant} struct Strange {{ double x; }}; }}; }};"
    )


def parentheses(folder: Path) -> Path:
    return described(folder, _idl("const long A = (((1)));"), "ros2idl")


def shift(folder: Path) -> Path:
    return described(folder, _idl("const long A = 1 << 40000000000;"), "ros2idl")


def constants(folder: Path) -> Path:
    many = "".join(f"const long A{i} = {i};" for i in range(50_000))
    return described(folder, _idl(many), "ros2idl")


def strings(folder: Path) -> Path:
    return described(folder, "std_msgs/Header header\nstring[1000000] position\n")


def nested_arrays(folder: Path) -> Path:
    parts = [f"{'=' * 80}\nMSG: strange_msgs/P{k}\nP{k + 1}[100] position\n" for k in range(8)]
    last = f"{'=' * 80}\nMSG: strange_msgs/P8\nuint8[0] position\n"
    return described(folder, "P0[100] position\n" + "".join(parts) + last)


def fields(folder: Path) -> Path:
    return described(folder, "".join(f"float64 x{i}\n" for i in range(60_000)))


def tiny_messages(folder: Path) -> Path:
    """31 bytes each, 100 MB unpacked in one chunk, without an index, on a topic of no interest."""
    return beside_signals(folder, [], 2**28, empty=100 * 2**20 // 31)


def tiny_chunks(folder: Path) -> Path:
    """Chunks of a megabyte of zeros."""
    return beside_signals(folder, [bytes(2**20)] * 4000, 2**20)


def beside_signals(folder: Path, payloads: list[bytes], chunk_size: int, empty: int = 0) -> Path:
    """Return a file of messages on one topic beside the signals, without an index."""
    names = ("/other", "/rig/motor_position", "/rig/motor_torque")
    messages = [(name, k * MS, SIGNAL) for k in range(1, 9) for name in names]
    return mcap_bag(
        folder,
        [*messages, *(("/other", 0, payload) for payload in payloads)],
        ("sensor_msgs/msg/JointState", "ros2msg", ""),
        empty,
        chunk_size=chunk_size,
        index_types=IndexType.NONE,
        enable_crcs=False,
    )


def many_names(folder: Path) -> Path:
    """One JointState of five million joints without a name."""
    count = 5_000_000
    payload = SIGNAL[:12] + b"\1\0\0\0\0\0\0\0" + count.to_bytes(4, "little")
    payload += b"\1\0\0\0\0\0\0\0" * count
    messages = [("/rig/motor_position", 0, payload), ("/rig/motor_torque", 0, payload)]
    return mcap_bag(
        folder,
        messages,
        ("sensor_msgs/msg/JointState", "ros2msg", ""),
        chunk_size=2**28,
    )


def merge_keys(folder: Path) -> Path:
    bag = foreign_bag(folder / "bag", rig_streams(dict.fromkeys("ryu", WHOLE)))
    lines = ["a0: &a0 {k: 1}"]
    for i in range(1, 40):
        lines.append(f"a{i}: &a{i} {{<<: [*a{i - 1}, *a{i - 1}, *a{i - 1}]}}")
    path = bag / "metadata.yaml"
    path.write_text("\n".join(lines) + "\n" + path.read_text())
    return bag


def aliases(folder: Path) -> Path:
    bag = foreign_bag(folder / "bag", rig_streams(dict.fromkeys("ryu", WHOLE)))
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    for i in range(1, 12):
        lines.append(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]")
    path = bag / "metadata.yaml"
    text = path.read_text().replace("custom_data: {}", "custom_data: {experiment: *a11}")
    path.write_text("\n".join(lines) + "\n" + text)
    return bag


def sqlite_bag(folder: Path) -> tuple[Path, sqlite3.Connection]:
    bag = foreign_bag(
        folder / "bag", rig_streams(dict.fromkeys("ryu", WHOLE)), plugin=StoragePlugin.SQLITE3
    )
    return bag, sqlite3.connect(bag / "bag.db3")


def generated_column(folder: Path) -> Path:
    bag, database = sqlite_bag(folder)
    with database:
        database.executescript(
            """
            ALTER TABLE messages RENAME TO stored;
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
                data BLOB GENERATED ALWAYS AS (zeroblob(900000000)) VIRTUAL);
            INSERT INTO messages(id, topic_id, timestamp)
                SELECT id, topic_id, timestamp FROM stored;
            """
        )
    database.close()
    return bag


def endless_view(folder: Path) -> Path:
    bag, database = sqlite_bag(folder)
    with database:
        database.executescript(
            """
            DROP TABLE message_definitions;
            CREATE VIEW message_definitions AS WITH RECURSIVE c(x) AS
                (SELECT 1 UNION ALL SELECT x + 1 FROM c)
                SELECT x AS id, 'a' AS topic_type, 'ros2msg' AS encoding,
                    '' AS encoded_message_definition, '' AS type_description_hash FROM c;
            """
        )
    database.close()
    return bag


HOSTILE = [
    parentheses,
    shift,
    constants,
    strings,
    nested_arrays,
    fields,
    tiny_messages,
    tiny_chunks,
    many_names,
    merge_keys,
    aliases,
    generated_column,
    endless_view,
]
