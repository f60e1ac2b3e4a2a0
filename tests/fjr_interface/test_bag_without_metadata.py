"""Bags as Foxglove, PlotJuggler and crashed recorders leave them, and paths as strangers have."""

from __future__ import annotations

import shutil
import sqlite3
import sys
from pathlib import Path

import numpy as np
import pytest
from bag_tools import (
    MS,
    WHOLE,
    boundaries,
    experiment,
    foreign_bag,
    refusal,
    rewrite,
    rig_streams,
    stream,
    write_bag,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from processes import completed
from rosbags.rosbag2 import StoragePlugin

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.mcap_summary import survey
from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.topics import SIGNALS
from fjr_kit.errors import InputError

LONG = list(range(1, 2001))


def bare(bag: Path) -> Path:
    (bag / "metadata.yaml").unlink()
    return bag


@pytest.fixture
def bag(tmp_path) -> Path:
    write_bag(tmp_path / "bag", experiment())
    return tmp_path / "bag"


@pytest.mark.parametrize(
    "options", [{}, {"use_chunking": False}, {"use_statistics": False}, {"repeat_channels": False}]
)
@pytest.mark.parametrize("by_itself", [False, True])
def test_an_mcap_file_is_a_bag(bag, options, by_itself):
    whole = read_record(bag)
    rewrite(bag, **options)
    path = bare(bag) / "bag.mcap" if by_itself else bare(bag)
    assert find_bags(path) == [path]
    reader = BagReader(path)
    assert reader.experiment == experiment()
    why = "is read without metadata.yaml" if by_itself else "metadata.yaml is missing"
    assert reader.notes == (f"{path.name}: {why}; topics and counts are those of the file itself.",)
    (record,) = reader.blocks(1000)
    assert record.torque.tobytes() == whole.torque.tobytes()


def test_the_summary_is_believed_only_as_far_as_the_data_agrees(tmp_path):
    bag = foreign_bag(tmp_path / "bag", rig_streams(dict.fromkeys("ryu", WHOLE)))
    path = bare(bag) / "bag.mcap"
    data = bytearray(path.read_bytes())
    at = next(at for at in boundaries(path)[1:] if data[at] == Opcode.STATISTICS)
    counts = at + 9 + 8 + 2 + 4 + 4 + 4 + 4 + 8 + 8 + 4  # the map of channel to count
    first, second = counts + 2, counts + 12
    data[first : first + 8] = (59).to_bytes(8, "little")
    data[second : second + 8] = (61).to_bytes(8, "little")
    path.write_bytes(data)
    assert survey(path).counts["/rig/reference"] == 59
    assert "/rig/motor_position: 60 messages are there but its summary says 61" in refusal(bag)


def test_a_bag_without_metadata_is_audited_like_any_other(tmp_path):
    lost = foreign_bag(
        tmp_path / "lost",
        rig_streams({"r": WHOLE, "y": WHOLE, "u": WHOLE[:-1]}),
        description=experiment(),
    )
    assert "motor_torque: sample 60 at 0.06 s and all later ones of the 60" in refusal(bare(lost))
    short = foreign_bag(tmp_path / "short", rig_streams({"r": WHOLE, "y": WHOLE, "u": WHOLE[:-1]}))
    assert "motor_torque: sample 60 and later ones are missing where" in refusal(bare(short))


def crashed(tmp_path: Path, keep: float, **options) -> tuple[Path, list[int]]:
    """Return a bag whose recorder died, and the offsets at which its records begin."""
    bag = foreign_bag(tmp_path / "bag", rig_streams(dict.fromkeys("ryu", LONG)))
    rewrite(bag, **{"chunk_size": 20_000, **options})
    path = bare(bag) / "bag.mcap"
    data, starts = path.read_bytes(), boundaries(path)
    path.write_bytes(data[: round(keep * len(data))])
    return bag, starts


@pytest.mark.parametrize("options", [{}, {"use_chunking": False}], ids=["chunks", "loose"])
@pytest.mark.parametrize("keep", [0.3, 0.62, 0.8])
def test_what_a_crashed_recorder_left_is_read_and_what_is_missing_said(tmp_path, keep, options):
    bag, starts = crashed(tmp_path, keep, **options)
    size = (bag / "bag.mcap").stat().st_size
    reader = BagReader(bag)
    (record,) = reader.blocks(10**6)
    samples = len(record.torque)
    assert 0.2 * len(LONG) < samples < len(LONG)
    assert record.torque.tolist() == record.reference.tolist() == LONG[:samples]
    lost = size - max(start for start in starts if start <= size)
    assert f"and its last {lost} bytes, an incomplete record, are lost" in reader.notes[1]
    counts = set(survey(bag / "bag.mcap").counts.values())
    assert min(counts) == samples
    assert ("the last ones are left out" in reader.notes[-1]) == (len(counts) > 1)


def test_every_cut_of_a_crashed_recording_gives_true_samples_or_a_sentence(tmp_path):
    bag, _ = crashed(tmp_path, 1.0, chunk_size=3000)
    path = bag / "bag.mcap"
    data = path.read_bytes()
    rng = np.random.default_rng(5)
    read = 0
    for cut in np.sort(rng.integers(0, len(data) - 1, 150)).tolist():
        path.write_bytes(data[:cut])
        try:
            record = read_record(bag)
        except InputError as error:
            assert str(bag) in str(error) and str(error).endswith(".")
            continue
        read += 1
        assert record.torque.tolist() == LONG[: len(record.torque)] == record.position.tolist()
    assert read > 100


def test_a_described_experiment_that_was_cut_off_is_refused(bag):
    rewrite(bag, chunk_size=3000)
    path = bare(bag) / "bag.mcap"
    starts = [at for at in boundaries(path)[1:-2] if path.read_bytes()[at] == Opcode.CHUNK]
    path.write_bytes(path.read_bytes()[: starts[-1] + 5])
    assert "and all later ones of the 60 are missing" in refusal(bag)


def test_a_cut_file_beside_its_metadata_is_refused(bag):
    path = bag / "bag.mcap"
    path.write_bytes(path.read_bytes()[:-40])
    assert "ends early: the recording was cut off" in refusal(bag)


def test_which_files_are_one_recording(tmp_path):
    whole = foreign_bag(tmp_path / "one", rig_streams(dict.fromkeys("ryu", WHOLE)))
    file = bare(whole) / "one.mcap"
    apart = tmp_path / "apart"
    apart.mkdir()
    for name in ("b", "a"):
        shutil.copy(file, apart / f"{name}.mcap")
    assert [path.name for path in find_bags(apart)] == ["a.mcap", "b.mcap"]
    with pytest.raises(InputError, match=r"holds several recordings \(a.mcap, b.mcap\)"):
        BagReader(apart)
    assert find_bags(tmp_path) == [apart / "a.mcap", apart / "b.mcap", whole]
    split = tmp_path / "split"
    split.mkdir()
    for number, part in ((9, WHOLE[:25]), (10, WHOLE[25:])):
        half = foreign_bag(tmp_path / f"half_{number}", rig_streams(dict.fromkeys("ryu", part)))
        (half / f"half_{number}.mcap").rename(split / f"split_{number}.mcap")
    assert find_bags(split) == [split]
    assert read_record(split).torque.tolist() == WHOLE


def sqlite_bag(folder: Path, scale: int = 1) -> Path:
    folder.parent.mkdir(exist_ok=True)
    streams = rig_streams({**dict.fromkeys("ryu", WHOLE)})
    if scale != 1:
        streams["/rig/motor_torque"] = streams["/rig/motor_torque"][::-1]
    made = foreign_bag(folder.parent / "made", streams, plugin=StoragePlugin.SQLITE3)
    return made.rename(folder)


def test_a_sqlite_bag_without_metadata(tmp_path):
    bag = bare(sqlite_bag(tmp_path / "bag"))
    assert read_record(bag).torque.tolist() == WHOLE
    assert read_record(bag / "made.db3").torque.tolist() == WHOLE


@pytest.mark.parametrize("name", ["pct%41", "a#b", "a?mode=rwc", "a b", "\u00fc", "%", "a&b;c"])
def test_a_sqlite_bag_is_read_from_its_own_folder(tmp_path, name):
    decoy = sqlite_bag(tmp_path / "pctA")
    with sqlite3.connect(decoy / "made.db3") as database:
        database.execute("DELETE FROM messages")
    assert read_record(sqlite_bag(tmp_path / name)).torque.tolist() == WHOLE


def test_a_sqlite_bag_whose_log_was_not_taken_in_is_refused(tmp_path):
    bag = sqlite_bag(tmp_path / "bag")
    (bag / "made.db3-wal").write_bytes(b"messages")
    assert "some messages are still in made.db3-wal; open the file once with" in refusal(bag)


def test_a_crashed_recording_is_analyzed_with_its_notes(tmp_path):
    stamps = np.arange(1, 2001) * MS
    lines = np.array([1, 3, 7, 9, 13, 15, 19, 21, 25, 27, 31, 33])
    turns = np.outer(stamps / (200 * MS), lines) + np.arange(12) ** 2 / 24
    values = np.sin(2 * np.pi * turns).sum(axis=1)
    streams = {s.absolute_topic: stream(s, stamps, values) for s in SIGNALS}
    bag = foreign_bag(tmp_path / "bag", streams)
    rewrite(bag, chunk_size=20_000)
    path = bare(bag) / "bag.mcap"
    path.write_bytes(path.read_bytes()[: round(0.9 * path.stat().st_size)])
    options = [
        "--nominal",
        "none",
        "--samples-per-period",
        "200",
        "--method",
        "fast",
        "--out",
        str(tmp_path / "out"),
    ]
    done = completed(sys.executable, "-m", "fjr_cli", "analyze", str(path), *options)
    assert done.returncode == 0, done.stderr
    assert "bag.mcap was never closed" in done.stdout.replace("\n", " ")
    assert (tmp_path / "out" / "report.html").exists()


def test_the_folder_is_needed(tmp_path):
    with pytest.raises(InputError, match="is not a bag; name the folder"):
        BagReader(tmp_path / "absent")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"metadata.yaml: is missing, so the bag is not whole"):
        BagReader(tmp_path / "empty")


@settings(
    max_examples=150,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(st.lists(st.tuples(st.integers(0, 2**31), st.binary(min_size=1, max_size=8)), max_size=6))
def test_damaged_sqlite_bags_give_samples_or_a_sentence(tmp_path, spots):
    bag = tmp_path / "bag"
    if not bag.exists():
        bare(sqlite_bag(bag))
        shutil.copy(bag / "made.db3", tmp_path / "whole")
    data = bytearray((tmp_path / "whole").read_bytes())
    for at, junk in spots:
        at %= len(data)
        data[at : at + len(junk)] = junk
    (bag / "made.db3").write_bytes(data)
    try:
        record = read_record(bag)
    except InputError as error:
        assert str(error).endswith(".") and str(bag) in str(error) and "\n" not in str(error)
    else:
        assert len(record.torque) == len(record.position) == len(record.reference) > 1
