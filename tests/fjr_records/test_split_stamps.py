"""Stamps of ROS in two columns: whole seconds and the nanoseconds of each."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fjr_cli.import_summary import held_by
from fjr_records.importers.columns import read_columns
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions

NS = 1_700_000_000_990_000_000 + 1_000_000 * np.arange(3000)
SECS, NSECS = NS // 10**9, NS % 10**9
U = np.random.default_rng(3).normal(size=NS.size)
Y = np.cumsum(np.cumsum(U)) / 1e4
NAMES = [
    ("secs", "nsecs"),
    ("header.stamp.sec", "header.stamp.nanosec"),
    ("/joint/header/stamp/sec", "/joint/header/stamp/nanosec"),
    ("Stamp_Seconds", "Stamp_NanoSeconds"),
]


def write(path, names, seconds=SECS, nanoseconds=NSECS):
    """Write a log of two columns of stamps, in the format of its suffix; return its path."""
    columns = dict(zip((*names, "u", "y"), (seconds, nanoseconds, U, Y), strict=True))
    rows = [dict(zip(columns, row, strict=True)) for row in zip(
        *(each.tolist() for each in columns.values()), strict=True
    )]  # fmt: skip
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".jsonl":
        path.write_text("\n".join(map(json.dumps, rows)))
    else:
        lines = [",".join(map(str, row.values())) for row in rows]
        path.write_text("\n".join([",".join(columns), *lines]))
    return path


@pytest.mark.parametrize("names", NAMES)
@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_nanoseconds_are_added_to_the_seconds_that_are_mapped(tmp_path, names, suffix):
    file = write(tmp_path / f"a{suffix}", names)
    columns = parse_map(["torque=u", "position=y", f"time={names[0]}"])
    (record,) = read_files([file], ImportOptions(columns)).records
    assert record.sample_rate_hz == 1000.0 and record.samples == 3000
    assert f"time is {names[0]} with the nanoseconds of {names[1]}" in record.notes
    assert f"time={names[0]}" in list(held_by(file))[-1]


def test_seconds_are_found_by_their_number_too(tmp_path):
    file = write(tmp_path / "a.csv", NAMES[0])
    found, headings = read_columns(file, ["0"])
    np.testing.assert_allclose(found["0"] - SECS[0], 1e-9 * (NS - 10**9 * SECS[0]), atol=1e-6)
    assert headings["0"].nanoseconds == "nsecs" and headings["0"].unit == "s"


def test_seconds_that_are_not_whole_stand_alone(tmp_path):
    file = write(tmp_path / "a.csv", NAMES[0], seconds=NS / 1e9)
    found, headings = read_columns(file, ["secs"])
    np.testing.assert_array_equal(found["secs"], NS / 1e9)
    assert not headings["secs"].nanoseconds


def test_where_another_column_is_the_time_it_is_the_likely_one(tmp_path):
    file = write(tmp_path / "a.npz", ("time", "nsecs"), seconds=NS / 1e9)
    assert "time=time" in list(held_by(file))[-1]
