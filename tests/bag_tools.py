"""Draws bags of every kind for the tests: whole ones by BagWriter, any other by rosbags or mcap."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer as LibraryWriter
from rosbags.interfaces import Qos
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionFormat, CompressionMode
from rosbags.typesys import Stores, get_typestore

from fjr_interface.bags.joint_state import FIELDS, JointStateWriter
from fjr_interface.bags.reader import audit
from fjr_interface.bags.signals import SignalMap
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import CUSTOM_DATA_KEY, Experiment
from fjr_interface.topics import JOINT, JOINT_STATE, SIGNALS, STRING, Signal
from fjr_kit.errors import InputError

STORE = get_typestore(Stores.ROS2_JAZZY)
MS = 1_000_000

WHOLE = list(range(1, 61))
"""The stamps in ms of `experiment()`."""

Stream = list[tuple[int, bytes]]


def experiment(**changes) -> Experiment:
    values = {
        "sample_rate_hz": 1000.0,
        "samples_per_period": 20,
        "periods": 2,
        "transient_periods": 1,
        "amplitude_rad": 0.007,
        "excited_harmonics": [1, 3],
        "detection_harmonics": [5],
        "phase_seed": 7,
    }
    return Experiment(**{**values, **changes})


def signals(description: Experiment, seed: int = 0, symbols: str = "ryu") -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    return {symbol: rng.normal(size=description.samples) for symbol in symbols}


def write_bag(folder: Path, description: Experiment, **options) -> dict[str, np.ndarray]:
    """Write a whole bag with random signals; return the signals."""
    chosen = options.get("signals", SIGNALS)
    values = signals(description, symbols="".join(signal.symbol for signal in chosen))
    with BagWriter(folder, description, **options) as writer:
        writer.write_arrays(**values)
    return values


def stream(signal: Signal, stamps, values) -> Stream:
    """Return the (log time, payload) of a signal with these header stamps."""
    encoder = JointStateWriter(signal.field, JOINT)
    pairs = zip(np.asarray(stamps).tolist(), np.asarray(values, float).tolist(), strict=True)
    return [(stamp, encoder.encode(stamp, value)) for stamp, value in pairs]


def serialize(stamp: int, frame: str, names: list[str], **fields: list[float]) -> bytes:
    """Return the CDR bytes of any JointState, by rosbags."""
    seconds, nanoseconds = divmod(stamp, 10**9)
    header = STORE.types["std_msgs/msg/Header"](
        STORE.types["builtin_interfaces/msg/Time"](seconds, nanoseconds), frame
    )
    values = {name: np.array(fields.get(name, ()), np.float64) for name in FIELDS}
    message = STORE.types[JOINT_STATE](header=header, name=names, **values)
    return bytes(STORE.serialize_cdr(message, JOINT_STATE))


def rig_streams(timelines: dict[str, list[int]]) -> dict[str, Stream]:
    """Return the three signals, each with its stamps in ms and the stamps as values."""
    return {
        signal.absolute_topic: stream(
            signal, np.array(timelines[signal.symbol]) * MS, timelines[signal.symbol]
        )
        for signal in SIGNALS
    }


def foreign_bag(
    folder: Path,
    streams: dict[str, Stream],
    *,
    types: dict[str, str] | None = None,
    description: Experiment | None = None,
    custom: str | None = None,
    compression: CompressionMode = CompressionMode.STORAGE,
    plugin: StoragePlugin = StoragePlugin.MCAP,
    qos: Sequence[Qos] = (),
) -> Path:
    """Write any streams with plain rosbags, merged by log time (ties in order of the streams)."""
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if plugin == StoragePlugin.MCAP or compression != CompressionMode.STORAGE:
        writer.set_compression(compression, CompressionFormat.ZSTD)
    if custom is not None:
        writer.set_custom_data(CUSTOM_DATA_KEY, custom)
    with writer:
        if description is not None:
            at = writer.add_connection("/rig/experiment", STRING, typestore=STORE)
            message = STORE.types[STRING](description.to_json())
            writer.write(at, MS, STORE.serialize_cdr(message, STRING))
        connections = {
            topic: writer.add_connection(
                topic,
                (types or {}).get(topic, JOINT_STATE),
                typestore=STORE,
                offered_qos_profiles=qos,
            )
            for topic in streams
        }
        merged = [(time, topic, data) for topic, items in streams.items() for time, data in items]
        for time, topic, data in sorted(merged, key=lambda item: item[0]):
            writer.write(connections[topic], time, data)
    return folder


def rewrite(bag: Path, **options) -> None:
    """Write the bag's mcap file anew with the mcap library's writer and its options."""
    path = bag / f"{bag.name}.mcap"
    fresh = path.with_suffix(".fresh")
    with path.open("rb") as source, fresh.open("wb") as sink:
        writer = LibraryWriter(sink, **options)
        writer.start(profile="ros2")
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, number, channel.metadata
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        writer.finish()
    fresh.replace(path)


def refusal(bag: Path, signal_map: SignalMap | None = None) -> str:
    """Return the sentence with which a bag is refused."""
    with pytest.raises(InputError) as caught:
        audit(bag, signal_map or SignalMap())
    sentence = str(caught.value)
    assert str(bag) in sentence and "\n" not in sentence and sentence.endswith(".")
    return sentence.replace(str(bag), "BAG")


def edit(folder: Path, old: str, new: str) -> None:
    path = folder / "metadata.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def boundaries(path: Path) -> list[int]:
    """Return the offsets at which an MCAP file's top-level records begin, and its end."""
    data = path.read_bytes()
    offsets, at = [0], 8
    while at < len(data) - 8:
        offsets.append(at)
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    return [*offsets, at, len(data)]
