from __future__ import annotations

import resource
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from bag_tools import STORE, experiment, signals, write_bag
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from paths import ROOT
from rosbags.interfaces import QosDurability, QosHistory, QosReliability
from rosbags.rosbag2 import Reader
from ruamel.yaml import YAML

from fjr_interface.bags.joint_state import JointStateWriter
from fjr_interface.bags.reader import read_record
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.topics import JOINT, LINK_POSITION, SIGNAL_DEPTH, SIGNALS
from fjr_kit.errors import InputError

TOPICS = ["/rig/experiment", "/rig/reference", "/rig/motor_position", "/rig/motor_torque"]


def contents(folder: Path) -> dict[str, bytes]:
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def write_by_sample(folder: Path, description: Experiment, values: dict[str, np.ndarray]) -> None:
    encoders = [JointStateWriter(signal.field, JOINT) for signal in SIGNALS]
    columns = [values[signal.symbol].tolist() for signal in SIGNALS]
    with BagWriter(folder, description) as writer:
        for stamp, *row in zip(description.stamps_ns.tolist(), *columns, strict=True):
            writer.write(stamp, [e.encode(stamp, v) for e, v in zip(encoders, row, strict=True)])


@pytest.mark.parametrize("samples_per_period", [20, 2000], ids=["one chunk", "several chunks"])
def test_same_content_gives_the_same_bytes_by_both_ways(tmp_path, samples_per_period):
    description = experiment(samples_per_period=samples_per_period)
    for place in ("first", "second"):
        values = write_bag(tmp_path / place / "bag", description)
    write_by_sample(tmp_path / "third" / "bag", description, values)
    first = contents(tmp_path / "first")
    assert sorted(first) == ["bag/bag.mcap", "bag/metadata.yaml"]
    assert first == contents(tmp_path / "second") == contents(tmp_path / "third")


def test_rosbags_reads_what_was_written(tmp_path):
    description = experiment()
    values = write_bag(tmp_path / "bag", description)
    with Reader(tmp_path / "bag") as reader:
        messages = [
            (connection.topic, time, STORE.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]
    assert messages[0][0] == "/rig/experiment"
    assert Experiment.from_json(messages[0][2].data, "bag") == description
    assert [topic for topic, _, _ in messages[1:]] == TOPICS[1:] * description.samples
    for signal in SIGNALS:
        mine = [(time, m) for topic, time, m in messages if topic == signal.absolute_topic]
        stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in mine]
        assert stamps == [time for time, _ in mine] == description.stamps_ns.tolist()
        assert [getattr(m, signal.field)[0] for _, m in mine] == values[signal.symbol].tolist()
        assert all(m.name == [JOINT] for _, m in mine)


def test_metadata_keeps_the_interface(tmp_path):
    description = experiment()
    write_bag(tmp_path / "bag", description)
    text = (tmp_path / "bag" / "metadata.yaml").read_text()
    information = YAML(typ="safe").load(text)["rosbag2_bagfile_information"]
    assert information["version"] == 9
    assert information["storage_identifier"] == "mcap"
    assert information["relative_file_paths"] == ["bag.mcap"]
    assert information["message_count"] == 1 + 3 * description.samples
    assert information["starting_time"]["nanoseconds_since_epoch"] == 1_000_000
    assert information["duration"]["nanoseconds"] == (description.samples - 1) * 1_000_000
    assert Experiment.from_json(information["custom_data"]["experiment"], "bag") == description


def test_qos_hashes_and_definitions_are_in_the_bag(tmp_path):
    write_bag(tmp_path / "bag", experiment())
    with Reader(tmp_path / "bag") as reader:
        connections = list(reader.connections)
    assert [connection.topic for connection in connections] == TOPICS
    for number, connection in enumerate(connections):
        (qos,) = connection.ext.offered_qos_profiles
        assert (qos.reliability, qos.history) == (QosReliability.RELIABLE, QosHistory.KEEP_LAST)
        volatile = QosDurability.VOLATILE if number else QosDurability.TRANSIENT_LOCAL
        assert (qos.durability, qos.depth) == (volatile, SIGNAL_DEPTH if number else 1)
    # The hashes that ROS 2 Jazzy itself gives these types.
    string = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    joint_state = "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
    assert [connection.digest for connection in connections] == [string] + [joint_state] * 3
    with (tmp_path / "bag" / "bag.mcap").open("rb") as file:
        schemas = make_reader(file).get_summary().schemas.values()
    assert {schema.encoding for schema in schemas} == {"ros2msg"}
    assert any(b"float64[] effort" in schema.data for schema in schemas)


def test_all_checksums_are_there_and_right(tmp_path):
    description = experiment(samples_per_period=2000)
    write_bag(tmp_path / "bag", description)
    path = tmp_path / "bag" / "bag.mcap"
    with path.open("rb") as file:
        records = list(StreamReader(file, emit_chunks=True).records)
    chunks = [record for record in records if type(record).__name__ == "Chunk"]
    assert len(chunks) > 1
    assert all(chunk.uncompressed_crc and chunk.compression == "zstd" for chunk in chunks)
    (end,) = (record for record in records if type(record).__name__ == "DataEnd")
    assert end.data_section_crc and records[-1].summary_crc
    with path.open("rb") as file:
        messages = [r for r in StreamReader(file, validate_crcs=True).records if hasattr(r, "data")]
    assert len(messages) > 3 * description.samples
    with path.open("rb") as file:
        statistics = make_reader(file, validate_crcs=True).get_summary().statistics
    n = description.samples
    assert statistics.channel_message_counts == {1: 1, 2: n, 3: n, 4: n}
    assert statistics.message_end_time == n * 1_000_000


def test_link_position_can_be_recorded(tmp_path):
    write_bag(tmp_path / "bag", experiment(), signals=(*SIGNALS, LINK_POSITION))
    with Reader(tmp_path / "bag") as reader:
        assert reader.topics["/rig/link_position"].msgcount == experiment().samples


def test_arrays_must_fit_the_experiment(tmp_path):
    description = experiment()
    values = signals(description)
    with BagWriter(tmp_path / "bag", description) as writer:
        with pytest.raises(ValueError, match="shape"):
            writer.write_arrays(**{**values, "u": values["u"][1:]})
        with pytest.raises(ValueError, match="signals"):
            writer.write_arrays(r=values["r"], y=values["y"])
        writer.write_arrays(**values)


def test_a_long_record_takes_no_memory_beside_its_arrays(tmp_path):
    samples = 2**17
    description = RecordDescription.of("test", sample_rate_hz=1000.0)
    values = dict.fromkeys("ruy", np.zeros(samples))
    tracemalloc.start()
    with BagWriter(tmp_path / "bag", description) as writer:
        writer.write_arrays(**values)
        peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 200 * samples
    assert read_record(tmp_path / "bag").position.size == samples


def test_an_existing_folder_is_refused_and_kept(tmp_path):
    write_bag(tmp_path / "bag", experiment())
    before = contents(tmp_path)
    with pytest.raises(InputError, match=r"bag: exists already; choose another"):
        BagWriter(tmp_path / "bag", experiment(phase_seed=8))
    assert contents(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_a_place_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="cannot be made"):
        BagWriter(tmp_path / "file" / "bag", experiment())


def test_nothing_shows_before_the_end_and_nothing_is_left_of_a_failure(tmp_path):
    with pytest.raises(KeyboardInterrupt), BagWriter(tmp_path / "bag", experiment()) as writer:
        writer.write(1_000_000, [b"\0" * 20] * 3)
        assert all(path.name.startswith(".") for path in tmp_path.iterdir())
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    writer = BagWriter(tmp_path / "bag", experiment())
    writer.abort()
    assert list(tmp_path.iterdir()) == []


def test_the_same_bag_cannot_be_written_twice_at_once(tmp_path):
    description = experiment()
    with BagWriter(tmp_path / "bag", description) as writer:
        with pytest.raises(InputError, match="is being written by another process"):
            BagWriter(tmp_path / "bag", description)
        writer.write_arrays(**signals(description))
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_what_a_killed_recorder_left_is_cleared_away(tmp_path):
    script = (
        "import os, sys; from bag_tools import *\n"
        "w = BagWriter(sys.argv[1], experiment()); w.write(1000000, [b'0' * 60] * 3)\n"
        "os.kill(os.getpid(), 9)"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "bag")]
    assert subprocess.run(command, cwd=ROOT / "tests", check=False).returncode == -9
    assert [path.name for path in tmp_path.iterdir()] == [".bag.partial"]
    write_bag(tmp_path / "bag", experiment())
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


@pytest.mark.parametrize("limit", [1000, 200_000], ids=["at the end", "in the middle"])
def test_a_full_disk_is_said_and_leaves_nothing(tmp_path, limit):
    description = experiment(samples_per_period=20 if limit == 1000 else 5000)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        with pytest.raises(InputError, match=r"bag: the bag cannot be written \(File too large\)"):
            write_bag(tmp_path / "bag", description)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert list(tmp_path.iterdir()) == []
