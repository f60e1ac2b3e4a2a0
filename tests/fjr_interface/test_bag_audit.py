from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from bag_tools import (
    MS,
    WHOLE,
    edit,
    experiment,
    foreign_bag,
    refusal,
    rig_streams,
    signals,
    stream,
    write_bag,
)
from rosbags.rosbag2.enums import CompressionMode

from fjr_interface.bags.metadata import read_metadata
from fjr_interface.bags.reader import BagReader, audit
from fjr_interface.bags.writer import BagWriter
from fjr_interface.topics import REFERENCE, SIGNALS


@pytest.fixture
def bag(tmp_path) -> Path:
    write_bag(tmp_path / "bag", experiment())
    return tmp_path / "bag"


def without(*missing: int) -> list[int]:
    return [k for k in WHOLE if k not in missing]


@pytest.mark.parametrize(
    ("symbol", "timeline", "said"),
    [
        ("u", without(17), "motor_torque: sample 17 at 0.017 s is missing;"),
        (
            "y",
            without(17, 18, 19),
            "motor_position: sample 17 at 0.017 s is missing and so are the 2",
        ),
        ("r", without(1), "reference: sample 1 at 0.001 s is missing;"),
        ("u", without(60), "motor_torque: sample 60 at 0.06 s and all later ones of the 60 are"),
        ("y", [*WHOLE[:30], *WHOLE[29:]], "motor_position: sample 30 at 0.03 s is there twice;"),
        (
            "y",
            [*WHOLE[:30], 5, *WHOLE[30:]],
            "sample 31 at 0.005 s comes after 0.03 s, which is out",
        ),
        ("r", [*WHOLE[:9], 11, 10, *WHOLE[11:]], "sample 10 at 0.01 s comes after 0.011 s, which"),
        ("u", [*WHOLE, 61], "sample 61 at 0.061 s is more than the 60 described"),
        ("u", [], "motor_torque: holds no sample"),
    ],
    ids=str,
)
def test_stamps_are_audited(tmp_path, symbol, timeline, said):
    timelines = {**dict.fromkeys("ryu", WHOLE), symbol: timeline}
    folder = foreign_bag(tmp_path / "bag", by_position(timelines), description=experiment())
    sentence = refusal(folder)
    assert said in sentence and sentence.endswith("; record it again.")


def by_position(timelines: dict[str, list[int]]) -> dict:
    """Streams whose log times keep the order given, whatever the header stamps are."""
    return {
        topic: [((i + 1) * MS, data) for i, (_, data) in enumerate(items)]
        for topic, items in rig_streams(timelines).items()
    }


def test_a_stamp_off_the_grid(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    stamps = np.array(WHOLE) * MS
    stamps[9] += 1
    streams["/rig/reference"] = stream(REFERENCE, stamps, WHOLE)
    assert "sample 10 at 0.010000001 s is off the regular grid: it should be at 0.01 s" in refusal(
        foreign_bag(tmp_path / "bag", streams, description=experiment())
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("symbol", ["r", "y", "u"])
def test_values_that_are_no_numbers(tmp_path, value, symbol):
    description = experiment()
    values = signals(description)
    values[symbol][[31, 40]] = value
    with BagWriter(tmp_path / "bag", description) as writer:
        writer.write_arrays(**values)
    assert f"sample 32 at 0.032 s is {value}, not a number that can be used" in refusal(
        tmp_path / "bag"
    )


def test_missing_topics(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    del streams["/rig/motor_torque"]
    folder = foreign_bag(tmp_path / "bag", streams, description=experiment())
    assert "the topic /rig/motor_torque is missing (there are: /rig/experiment, " in refusal(folder)


def test_two_descriptions_must_agree(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    one, other = experiment(), experiment(phase_seed=8)
    same = foreign_bag(tmp_path / "same", streams, description=one, custom=one.to_json() + " ")
    audit(same)
    differ = foreign_bag(tmp_path / "differ", streams, description=one, custom=other.to_json())
    assert "two different experiment descriptions" in refusal(differ)
    only = foreign_bag(tmp_path / "only", streams, custom=other.to_json())
    assert BagReader(only).experiment == other
    audit(only)


def test_bad_descriptions(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    custom = foreign_bag(tmp_path / "custom", streams, custom='{"schema": "other"}')
    assert "BAG/metadata.yaml: custom_data: experiment description: schema" in refusal(custom)
    assert "samples_per_period" in refusal(
        foreign_bag(
            tmp_path / "field",
            streams,
            custom=experiment()
            .to_json()
            .replace('"samples_per_period":20', '"samples_per_period":1'),
        )
    )


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("version: 9", "version: 10", "version 10 is not supported"),
        ("version: 9", "version: 1", "version 1 is not supported"),
        ("version: 9", "version: new", "rosbag2_bagfile_information.version: "),
        ("storage_identifier: mcap", "storage_identifier: cassette", "'cassette' is not supported"),
        ("compression_mode: ''", "compression_mode: MESSAGE", "compression by message is not"),
        ("  - bag.mcap", "  - ../bag/bag.mcap", "points outside the bag"),
        ("  - bag.mcap", "  - /etc/passwd", "points outside the bag"),
        ("  - bag.mcap", "  - link.mcap", "points outside the bag"),
        ("  - bag.mcap", "  - none.mcap", "'none.mcap' does not exist"),
        ("  - bag.mcap", "  - .", "'.' does not exist"),
        ("  - bag.mcap", '  - "a\\0b"', "is not a file name"),
        ("  - bag.mcap", f"  - {'x' * 5000}", "is not a file name"),
        ("  - bag.mcap", "  - bag.mcap\n  - ./bag.mcap", "names a file twice"),
        ("relative_file_paths:\n  - bag.mcap", "relative_file_paths: []", "relative_file_paths: "),
        ("message_count: 60", "message_count: 61", "is not the sum over the topics"),
        ("message_count: 181", "message_count: 182", "is not the sum over the topics"),
        ("rosbag2_bagfile_information:", "other:", "rosbag2_bagfile_information: is missing"),
        ("version: 9", "version: [9", "is corrupted (not YAML)"),
        ("version: 9", "version: 2024-99-99", "rosbag2_bagfile_information.version: "),
        ("version: 9", "version: " + "[" * 50_000, "is corrupted (not YAML)"),
        ("version: 9", "? {a: 1}\n  : 9", "is corrupted (not YAML)"),
    ],
    ids=lambda text: str(text)[:40],
)
def test_metadata_is_checked(bag, old, new, said):
    (bag.parent / "outside.mcap").write_bytes((bag / "bag.mcap").read_bytes())
    (bag / "link.mcap").symlink_to("../outside.mcap")
    edit(bag, old, new)
    assert said in refusal(bag)


def test_metadata_that_cannot_be_read(bag):
    path = bag / "metadata.yaml"
    path.write_bytes(b"\xff\xfe\xff")
    assert "not UTF-8" in refusal(bag)
    path.write_bytes(b"")
    assert "metadata.yaml" in refusal(bag)
    path.unlink()
    os.mkfifo(path)
    assert "is missing" in refusal(bag)


def test_counts_must_agree_with_the_content(bag):
    edit(bag, "message_count: 181", "message_count: 182")
    edit(bag, "  - message_count: 1\n", "  - message_count: 2\n")
    assert "/rig/experiment: 1 messages are there but metadata.yaml says 2" in refusal(bag)


def test_metadata_without_a_bag_around(bag):
    assert read_metadata(bag).counts == {
        "/rig/experiment": 1,
        **{signal.absolute_topic: 60 for signal in SIGNALS},
    }


def test_file_compression_is_refused_with_a_way_out(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    folder = foreign_bag(tmp_path / "bag", streams, compression=CompressionMode.FILE)
    assert "compression by file is not supported; convert the bag" in refusal(folder)
