from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from bag_tools import (
    WHOLE,
    edit,
    experiment,
    foreign_bag,
    refusal,
    rewrite,
    rig_streams,
    signals,
    stream,
    write_bag,
)
from mcap.writer import CompressionType, IndexType
from paths import SHARED
from rosbags.rosbag2 import StoragePlugin

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader, Record, read_record
from fjr_interface.bags.signals import SignalMap
from fjr_interface.topics import LINK_POSITION, SIGNALS
from fjr_kit.errors import InputError

SEALED = SHARED / "sealed" / "case_01"


def assert_record(record: Record, description, values) -> None:
    assert record.stamps_ns.tolist() == description.stamps_ns.tolist()
    assert record.reference.tobytes() == values["r"].tobytes()
    assert record.position.tobytes() == values["y"].tobytes()
    assert record.torque.tobytes() == values["u"].tobytes()


@pytest.fixture
def bag(tmp_path) -> Path:
    write_bag(tmp_path / "bag", experiment())
    return tmp_path / "bag"


@pytest.mark.parametrize("rate", [100.0, 1000.0, 20000.0, 3000.0, 7.3])
def test_a_bag_comes_back_bit_by_bit(tmp_path, rate):
    description = experiment(sample_rate_hz=rate, samples_per_period=1500)
    values = write_bag(tmp_path / "bag", description)
    reader = BagReader(tmp_path / "bag")
    assert reader.experiment == description
    assert reader.sample_rate_hz == rate
    assert_record(read_record(tmp_path / "bag"), description, values)


@pytest.mark.parametrize("size", [1, 7, 60, 61, 1000])
def test_blocks_have_the_asked_size_and_join_to_the_whole(bag, size):
    blocks = list(BagReader(bag).blocks(size))
    lengths = [len(block.stamps_ns) for block in blocks]
    assert lengths[:-1] == [size] * (len(blocks) - 1)
    assert sum(lengths) == 60 and 0 < lengths[-1] <= size
    whole = read_record(bag)
    for name in ("stamps_ns", "reference", "torque", "position"):
        joined = np.concatenate([getattr(block, name) for block in blocks])
        assert joined.tobytes() == getattr(whole, name).tobytes()
    assert all(block.link is None for block in blocks)


def test_a_reader_can_be_used_again_and_side_by_side(bag):
    reader = BagReader(bag)
    pairs = zip(reader.blocks(25), reader.blocks(25), strict=True)
    assert all((a.torque == b.torque).all() for a, b in pairs)
    with pytest.raises(ValueError, match="at least one"):
        next(reader.blocks(0))


def test_link_position_is_read_where_it_is(tmp_path):
    values = write_bag(tmp_path / "bag", experiment(), signals=(*SIGNALS, LINK_POSITION))
    assert (read_record(tmp_path / "bag").link == values["q"]).all()
    assert read_record(tmp_path / "bag", SignalMap(link=None)).link is None


def test_memory_does_not_grow_with_the_bag(tmp_path):
    peaks = []
    for periods in (3, 30):
        folder = tmp_path / f"periods_{periods}"
        write_bag(folder, experiment(samples_per_period=2000, periods=periods))
        reader = BagReader(folder)
        tracemalloc.start()
        assert sum(len(block.torque) for block in reader.blocks(2000)) == 2000 * (periods + 1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0] + 100_000


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.ZSTD, "chunk_size": 300},
        {"compression": CompressionType.ZSTD, "index_types": IndexType.NONE},
        {"use_chunking": False},
        {"use_chunking": False, "enable_crcs": False, "use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False, "use_summary_offsets": False},
    ],
    ids=lambda options: ",".join(f"{key}={value}" for key, value in options.items()),
)
def test_all_ways_to_store_messages_in_mcap(bag, options):
    expected = read_record(bag)
    rewrite(bag, **options)
    record = read_record(bag)
    assert record.torque.tobytes() == expected.torque.tobytes()
    assert record.stamps_ns.tolist() == expected.stamps_ns.tolist()


def test_a_bag_of_several_files(tmp_path):
    description = experiment()
    values = signals(description)
    streams = {s.absolute_topic: (s, values[s.symbol]) for s in SIGNALS}
    halves = []
    for number, part in enumerate((slice(0, 25), slice(25, 60))):
        cut = {t: stream(s, description.stamps_ns[part], v[part]) for t, (s, v) in streams.items()}
        halves.append(foreign_bag(tmp_path / f"bag_{number}", cut))
    whole = foreign_bag(
        tmp_path / "bag",
        {t: stream(s, description.stamps_ns, v) for t, (s, v) in streams.items()},
        custom=description.to_json(),
    )
    (whole / "bag.mcap").unlink()
    for half in halves:
        (half / f"{half.name}.mcap").rename(whole / f"{half.name}.mcap")
    edit(
        whole, "relative_file_paths:\n  - bag.mcap", "relative_file_paths: [bag_0.mcap, bag_1.mcap]"
    )
    assert_record(read_record(whole), description, values)


def test_a_sqlite3_bag(tmp_path):
    streams = rig_streams({"r": WHOLE, "y": WHOLE, "u": WHOLE})
    plain = foreign_bag(
        tmp_path / "bag", streams, description=experiment(), plugin=StoragePlugin.SQLITE3
    )
    assert read_record(plain).torque.tolist() == WHOLE
    assert BagReader(plain).experiment == experiment()
    (plain / "bag.db3").write_bytes((plain / "bag.db3").read_bytes()[:5000])
    assert "not a readable sqlite3 bag" in refusal(plain)


@pytest.mark.skipif(not SEALED.is_dir(), reason="the shared sealed cases are not here")
def test_real_bags_of_another_emulator():
    bags = find_bags(SEALED)
    assert len(bags) == 6
    for folder in bags:
        reader = BagReader(folder)
        assert reader.experiment.phase_seed is None and reader.sample_rate_hz == 1000.0
        record = read_record(folder)
        assert len(record.torque) == reader.experiment.samples == 12000
        assert np.abs(record.torque).max() > 1.0


def test_bags_are_found(tmp_path):
    for name in ("b", "a", ".hidden"):
        write_bag(tmp_path / name, experiment())
    (tmp_path / "figures").mkdir()
    (tmp_path / "crashed").mkdir()
    (tmp_path / "crashed" / "crashed.mcap").touch()
    (tmp_path / "notes.txt").touch()
    assert [path.name for path in find_bags(tmp_path)] == ["a", "b", "crashed"]
    assert find_bags(str(tmp_path / "a")) == [tmp_path / "a"]
    for nothing in ("figures", "absent", "notes.txt"):
        with pytest.raises(InputError, match=r"holds no bag|not a readable folder"):
            find_bags(tmp_path / nothing)
