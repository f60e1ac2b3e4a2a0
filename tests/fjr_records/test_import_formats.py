"""Every format in the forms in which loggers write it, and each broken in each way."""

from __future__ import annotations

import gzip
import importlib
import json
from datetime import datetime, timedelta
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from fjr_cli.import_summary import held_by
from fjr_kit.errors import InputError
from fjr_records.importers.clock_stamps import since
from fjr_records.importers.columns import READERS, held_columns, read_columns

T = np.arange(40) / 100.0
R, Y = np.sin(7 * T), 0.5 * np.sin(7 * T - 0.3)
ROWS = list(zip(T.tolist(), R.tolist(), Y.tolist(), strict=True))


def table(delimiter: str, comma: bool = False, end: str = "\n", after: str = "") -> str:
    lines = (delimiter.join(map(repr, row)) + after for row in ROWS)
    text = end.join(lines) + end
    return text.replace(".", ",") if comma else text


TEXTS = {
    "names.csv": ("t,r,y\n" + table(","), "ry"),
    "none.csv": (table(","), "12"),
    "none_by_bracket.csv": (table(","), ("[1]", "[2]")),
    "names_by_number.csv": ("t,r,y\n" + table(","), "12"),
    "units.csv": ("t,r,y\ns,rad,rad\n" + table(","), "ry"),
    "title.csv": ("Bench 3, run of Monday\nt,r,y\n" + table(","), "ry"),
    "comments.csv": ("# bench 3\n# second line, too\nt,r,y\n" + table(",") + "# end\n", "ry"),
    "commented_names.txt": ("# t r y\n" + table(" "), "ry"),
    "decimal_comma.csv": ("t;r;y\n" + table(";", comma=True), "ry"),
    "decimal_comma_tabs.tsv": ("t\tr\ty\n" + table("\t", comma=True), "ry"),
    "decimal_comma_spaces.txt": (table("  ", comma=True), "12"),
    "spaces.dat": ("  t   r  y\n" + table("   "), "ry"),
    "windows.csv": ("t,r,y\r\n" + table(",", end="\r\n"), "ry"),
    "closing_delimiter.csv": ("t,r,y,\n" + table(",", after=","), "ry"),
    "quoted.csv": ('"t","r, set","y"\n' + table(","), ("r, set", "y")),
    "bars.txt": ("t | r | y\n" + table(" | "), "ry"),
    "blank_lines.csv": ("\n\nt,r,y\n\n" + table(",").replace("\n", "\n\n"), "ry"),
    "fortran.txt": (table(" ").replace("e-", "D-"), "12"),
    "unknown_suffix.lvm": ("X t\n***End***\nt\tr\ty\tComment\n" + table("\t", after="\t"), "ry"),
    "quoted_decimal_comma.csv": (
        "t,r,y\n" + '"' + table('";"', comma=True, end='"\n"').replace('";"', '","')[:-1],
        "ry",
    ),
    "old_mac.csv": ("t,r,y\r" + table(",", end="\r"), "ry"),
    "slashes.csv": ("/t,/r,/y\n" + table(","), ("/r", "/y")),
    "packed.txt.gz": ("Time, Goal Angle, y\n" + table(", "), ("Goal Angle", "y")),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text(tmp_path, name):
    text, names = TEXTS[name]
    write = gzip.compress if name.endswith(".gz") else bytes
    (tmp_path / name).write_bytes(write(text.encode()))
    for found, expected in zip(
        read_columns(tmp_path / name, list(names))[0].values(), (R, Y), strict=True
    ):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("name", TEXTS)
def test_what_a_text_holds_can_be_read_by_the_names_that_are_listed(tmp_path, name):
    text, _ = TEXTS[name]
    write = gzip.compress if name.endswith(".gz") else bytes
    (tmp_path / name).write_bytes(write(text.encode()))
    held, more = held_columns(tmp_path / name)
    assert more == 0
    read = read_columns(tmp_path / name, [one.name for one in held])[0]
    assert len(held) == 3
    for one, column in zip(held, read.values(), strict=True):
        assert one.shape == (40,) and one.range == (column.min(), column.max())


OTHERS = {
    "words": "AUTO",
    "truths": "True",
    "hexadecimals": "0x1A37",
    "nothing": "",
    "two words": "not ready",
    "decimal comma": "1,5 A",
}


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
@pytest.mark.parametrize("place", [0, 1, 3])
@pytest.mark.parametrize("kind", OTHERS)
def test_columns_that_hold_no_numbers_are_no_obstacle(tmp_path, kind, place, delimiter):
    if delimiter in OTHERS[kind]:
        pytest.skip("such a cell would be two")
    rows = [["t", "r", "y"], *([repr(x) for x in row] for row in ROWS)]
    for row in rows:
        row.insert(place, OTHERS[kind] if row[-1] != "y" else "mode")
    (tmp_path / "a.csv").write_text("\n".join(map(delimiter.join, rows)))
    found = read_columns(tmp_path / "a.csv", ["r", "y"])[0]
    np.testing.assert_array_equal(list(found.values()), [R, Y])
    assert [one.name for one in held_columns(tmp_path / "a.csv")[0] if one.range] == ["t", "r", "y"]
    with pytest.raises(InputError, match=f"line 2: '{OTHERS[kind]}' in column mode is not a num"):
        read_columns(tmp_path / "a.csv", ["mode"])


def test_a_slow_signal_beside_fast_ones_is_no_obstacle(tmp_path):
    rows = [f"{r},{y},{25.0 if k % 10 == 0 else ''}" for k, (_, r, y) in enumerate(ROWS)]
    (tmp_path / "a.csv").write_text("r,y,temperature\n" + "\n".join(rows))
    found = read_columns(tmp_path / "a.csv", ["r", "y"])[0]
    np.testing.assert_array_equal(list(found.values()), [R, Y])


STAMPS = {
    "iso": ("2026-01-31 23:59:59.750", "2026-02-01 00:00:00.250"),
    "zone": ("2026-01-31T23:59:59.750Z", "2026-02-01T01:00:00.250+01:00"),
    "dots": ("31.01.2026 23:59:59,75", "1.2.2026 0:00:00,25"),
    "slashes": ("2026/1/31_23:59:59.75", "2026/2/1_00:00:00.25"),
    "clock": ("9:59:59.75", "10:00:00.25"),
    "month first": ("12/31/2026 23:59:59.750", "01/01/2027 00:00:00.250"),
    "day first": ("31/12/2026 23:59:59.750", "01/01/2027 00:00:00.250"),
    "one day": ("03/12/2026 23:59:58.750", "03/12/2026 23:59:59.250"),
    "afternoon": ("03/12/2026 11:59:59.75 AM", "03/12/2026 12:00:00.25 PM"),
    "midnight": ("3/12/2026 11:59:59.75 pm", "3/13/2026 12:00:00.25 am"),
    "afternoon without a day": ("12:59:59.75 PM", "1:00:00.25 PM"),
}


@pytest.mark.parametrize("delimiter", [";", "\t", " "])
@pytest.mark.parametrize("kind", STAMPS)
def test_stamps_of_calendar_and_clock_are_seconds_from_the_first(tmp_path, kind, delimiter):
    rows = [delimiter.join([stamp, "1.5", "2.5"]) for stamp in STAMPS[kind]]
    (tmp_path / "a.txt").write_text("\n".join([delimiter.join("try"), *rows]))
    found, headings = read_columns(tmp_path / "a.txt", ["t", "y"])
    np.testing.assert_allclose(found["t"], [0.0, 0.5], atol=1e-9)
    np.testing.assert_array_equal(found["y"], [2.5, 2.5])
    assert headings["t"].unit == "s"


@given(st.datetimes(datetime(1990, 1, 1), datetime(2090, 1, 1)), st.integers(0, 10**10))
def test_any_two_stamps_differ_as_their_instants_do(first, later_us):
    second = first + timedelta(microseconds=later_us)
    elapsed = since(first.isoformat(" ", "microseconds"))
    assert elapsed(second.isoformat("T", "microseconds")) == pytest.approx(
        1e-6 * later_us, abs=1e-7
    )


def test_structures_in_arrays_as_the_scopes_of_simulink_keep_them(tmp_path):
    signals = np.zeros(2, dtype=[("values", object), ("label", object)])
    signals["values"], signals["label"] = [R[:, None], Y[:, None]], ["r", "y"]
    cells = np.array([{"values": R}, {"values": Y}], dtype=object)
    savemat(tmp_path / "a.mat", {"scope": {"time": T, "signals": signals}, "cells": cells})
    names = [f"{where}[{k}].values" for where in ("scope.signals", "cells") for k in range(2)]
    found = read_columns(tmp_path / "a.mat", names)[0]
    np.testing.assert_array_equal(list(found.values()), [R, Y, R, Y])


def test_what_a_mat_file_holds_is_listed_whatever_it_is(tmp_path):
    bad = np.array([1.0, np.nan])
    content = {"rec": {"pos": np.array([R, Y]), "who": "me"}, "k": 3.0, "bad": bad}
    savemat(tmp_path / "run.mat", content)
    held = {one.name: (one.shape, one.range) for one in held_columns(tmp_path / "run.mat")[0]}
    assert held["rec.pos"] == ((2, 40), (min(R.min(), Y.min()), max(R.max(), Y.max())))
    assert held["bad"] == ((2,), None)


def test_a_file_of_many_columns_says_how_many_are_not_shown(tmp_path):
    np.savez(tmp_path / "run.npz", **{f"a{k:03d}": R for k in range(203)})
    held, more = held_columns(tmp_path / "run.npz")
    assert len(held) == 200 and more == 3
    assert "  and 3 more, not shown" in list(held_by(tmp_path / "run.npz"))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_names_in_any_encoding(tmp_path, encoding):
    (tmp_path / "rig.csv").write_bytes(("t,µ (°),y\n" + table(",")).encode(encoding))
    np.testing.assert_array_equal(read_columns(tmp_path / "rig.csv", ["µ (°)"])[0]["µ (°)"], R)


JSONS = {
    "entries": ({"kp": 4, "entries": [{"r": r, "y": y} for _, r, y in ROWS]}, "entries.{}"),
    "deep": ({"a": {"log": [{"q": {"r": r, "y": y}} for _, r, y in ROWS]}}, "a.log.q.{}"),
    "list": ([{"r": r, "y": y} for _, r, y in ROWS], "{}"),
    "lists": ({"log": {"r": R.tolist(), "y": Y.tolist()}}, "log.{}"),
}


@pytest.mark.parametrize("name", JSONS)
@pytest.mark.parametrize("suffix", [".json", ".json.gz"])
def test_json(tmp_path, name, suffix):
    content, path = JSONS[name]
    packed = gzip.compress if suffix.endswith(".gz") else bytes
    (tmp_path / f"log{suffix}").write_bytes(packed(json.dumps(content).encode()))
    names = [path.format(each) for each in "ry"]
    found = read_columns(tmp_path / f"log{suffix}", names)[0]
    np.testing.assert_array_equal(list(found.values()), [R, Y])
    with pytest.raises(InputError, match=rf"there is no speed; the file holds .*{names[0]}"):
        read_columns(tmp_path / f"log{suffix}", ["speed"])


def test_json_of_rows_and_of_lines(tmp_path):
    (tmp_path / "rows.json").write_text(json.dumps({"data": ROWS}))
    found = read_columns(tmp_path / "rows.json", ["data[2]"])[0]
    np.testing.assert_array_equal(found["data[2]"], Y)
    lines = "\n".join(json.dumps({"t": t, "y": y}) for t, _, y in ROWS)
    (tmp_path / "log.jsonl").write_text(lines)
    np.testing.assert_array_equal(read_columns(tmp_path / "log.jsonl", ["y"])[0]["y"], Y)


def test_json_of_one_line_is_one_entry(tmp_path):
    (tmp_path / "rig.jsonl").write_text('{"r": 1.5, "y": 2}\n')
    assert read_columns(tmp_path / "rig.jsonl", ["r"])[0]["r"].tolist() == [1.5]


def test_mat_with_signals_in_rows(tmp_path):
    savemat(tmp_path / "rig.mat", {"rec": {"pos": np.stack([R, Y]), "t": T[None, :]}})
    found = read_columns(tmp_path / "rig.mat", ["rec.pos[1]", "rec.t"])[0]
    np.testing.assert_array_equal(list(found.values()), [Y, T])
    with pytest.raises(InputError, match=r"a matrix \(2 x 40\); name one of its rows, such as rec"):
        read_columns(tmp_path / "rig.mat", ["rec.pos"])


def test_mat_of_version_7_3(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    with h5py.File(tmp_path / "rig.mat", "w", userblock_size=512) as file:
        file["rec/pos"] = np.stack([R, Y]).T  # MATLAB writes its rows as columns
        file["rec/t"] = T[:, None]
    with (tmp_path / "rig.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    found = read_columns(tmp_path / "rig.mat", ["rec.pos[1]", "rec.t"])[0]
    np.testing.assert_array_equal(list(found.values()), [Y, T])
    with (tmp_path / "rig.mat").open("r+b") as file:
        file.truncate(900)
    with pytest.raises(InputError, match=r"is not a readable MATLAB 7\.3 file"):
        read_columns(tmp_path / "rig.mat", ["rec.t"])


def test_hdf5_of_groups_and_tables(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    with h5py.File(tmp_path / "rig.h5", "w") as file:
        file["run/signals"] = np.stack([R, Y])
        file["run/t"] = T
        rows = np.zeros(T.size, [("time", float), ("joint", "S4"), ("y", np.float32)])
        rows["time"], rows["y"] = T, Y
        file["table"] = rows
    names = ["run.signals[1]", "run.t", "table.time"]
    found = read_columns(tmp_path / "rig.h5", names)[0]
    np.testing.assert_array_equal(list(found.values()), [Y, T, T])
    held, more = held_columns(tmp_path / "rig.h5")
    listed = {"run.signals", "run.t", "table.time", "table.y"}
    assert {one.name for one in held} == listed and more == 0


def test_a_single_numpy_array(tmp_path):
    np.save(tmp_path / "rows.npy", np.stack([T, R, Y]))
    np.save(tmp_path / "columns.npy", np.stack([T, R, Y], axis=1))
    for name in ("rows.npy", "columns.npy"):
        found = read_columns(tmp_path / name, ["2", "[1]"])[0]
        np.testing.assert_array_equal(list(found.values()), [Y, R])
        assert [one.name for one in held_columns(tmp_path / name)[0]] == ["0", "1", "2"]
    fields = np.rec.fromarrays([T, Y], names="t,y")
    np.save(tmp_path / "fields.npy", fields)
    np.testing.assert_array_equal(read_columns(tmp_path / "fields.npy", ["y"])[0]["y"], Y)
    np.save(tmp_path / "one.npy", Y)
    np.testing.assert_array_equal(read_columns(tmp_path / "one.npy", ["0"])[0]["0"], Y)
    np.save(tmp_path / "cube.npy", np.zeros((3, 4, 5)))
    with pytest.raises(InputError, match="there is no 0; the file holds nothing"):
        read_columns(tmp_path / "cube.npy", ["0"])


BROKEN = [
    ("a.csv", "", "the file holds nothing"),
    ("a.csv", "r,y\n", "holds no numbers below the line of names"),
    ("a.csv", "r,y\n1,2\n3,x\n", "line 3: 'x' in column y is not a number"),
    ("a.csv", "1,x\n3,4\n5,6\n", "there is no r; the file holds 0, 1"),
    ("a.csv", "r,y\n1,nan\n3,4\n", "y holds nan at sample 0"),
    ("a.csv", "r,y\n1,\n3,4\n", "line 2: '' in column y is not a number"),
    ("a.csv", "r,y,y\n1,2,3\n3,4,5\n", "the column y is there 2 times; rename one, or name it by"),
    ("a.csv", "r,y\n1\n2\n", "line 2 has 1 columns, not 2"),
    ("a.csv", "a\0b", "is not a text file"),
    ("a.csv.gz", "r,y\n1,2\n", "is not a whole gzip file"),
    ("a.npy", "r,y\n1,2\n", "is not a NPY array of numbers"),
    ("a.h5", "r,y\n1,2\n", "HDF5|h5py"),
    ("a.json", "", "is not JSON"),
    ("a.json", '{"r": [1, 2', "is not JSON"),
    ("a.json", '{"r": [], "y": []}', "there is no r; the file holds nothing"),
    ("a.json", '[{"r": 1, "y": 2}, {"r": 1}]', "entry 1 has no y"),
    ("a.json", '[{"r": 1, "y": 2}, {"r": 1, "y": null}]', "y is None in entry 1, not a number"),
    ("a.json", '[{"r": 1, "y": 2}, {"r": 1, "y": "x"}]', "y is 'x' in entry 1, not a number"),
    ("a.json", '{"log": [{"r": 1, "y": "x"}]}', "there is no r; the file holds log.r"),
    ("a.json", '[{"r": 1, "y": "x"}, {"r": 1, "y": "z"}]', "y is 'x' in entry 0, not a number"),
    ("a.json", '[{"r": 1, "y": 2}, {"r": 1, "y": NaN}]', "y holds nan at sample 1"),
    ("a.json", '[{"r": 1, "y": [2]}, {"r": 1, "y": [2, 3]}]', "y has rows of different lengths"),
    ("a.json", "[" * 100_000, "(is not JSON|nested too deeply)"),
    ("a.jsonl", '{"r": 1, "y": 2}\n{"r": 1,\n', "entry 2"),
    ("a.jsonl", '{"r": 1, "y": 2}\n{"r": [1\n2], "y": 2}\n', "entry 2"),
    ("a.jsonl", '{"r": 1, "y": 2}\n' * 1500 + "{", "entry 1501"),
    ("a.mat", "x" * 100, "is not a readable MAT file"),
    ("a.npz", "x" * 300, "is not a NPZ archive"),
    ("a.parquet", "PAR1", r"files .parquet are not read here; write it as CSV or NPZ"),
    ("a.xlsx", "PK", r"files .xlsx are not read here; save its sheet as CSV"),
    ("a.mf4", "MDF", r"files .mf4 are not read here; export it as CSV"),
    ("a.bag", "#ROSBAG V2.0", r"is a bag of ROS 1; rosbags-convert --src \S*a.bag --dst FOLDER"),
    ("a.bin", "r,y\n\1\2\n", "cannot tell the format"),
    ("a.lvm", "r y\nup down\n", "holds no numbers below the line of names"),
    ("a.csv", "r,y\n12:00:00,1\noops,2\n", "line 3: 'oops' in column r is not a stamp of cal"),
    ("a.csv", "r,y\n12:00:00,1\n12:00:01,on\n", "line 3: 'on' in column y is not a number"),
    ("a.csv", "r,y\n2026-02-30 1:00:00,1\n", "line 2: '2026-02-30 1:00:00' in column r is not a"),
    ("a.csv", "r,y\n3/11/2026 23:59:59,1\n3/12/2026 0:00:00,1\n", "if a number above 12 tells da"),
    ("a.csv", "r,y\n31 Jan 2026 1:00:00,1\n", "write it as 2026-01-31 12:00:00.125, 31.01.2026 12"),
    ("a.csv", "r,y\n0.1 rad,0.2rad\n0.2 rad,0.3rad\n", "line 2: '0.1 rad' in column r is not a num"
     "ber; write the unit in the name of the column, not in each cell"),
    ("a.gz", "", "cannot tell the format"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "says"), BROKEN)
def test_broken_files_are_refused_in_a_sentence(tmp_path, name, content, says):
    (tmp_path / name).write_bytes(content.encode())
    with pytest.raises(InputError, match=says) as refused:
        read_columns(tmp_path / name, ["r", "y"])
    sentence = str(refused.value)
    assert sentence.startswith(f"{tmp_path / name}: ") and "\n" not in sentence
    assert sentence.endswith(".") and len(sentence) < 400


def test_a_folder_is_no_file(tmp_path):
    for read in (held_columns, lambda path: read_columns(path, ["r"])):
        with pytest.raises(InputError, match=r"is a folder, not a file; name the files in it"):
            read(tmp_path)


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.csv.gz"])
def test_an_empty_file_is_said_to_be_empty(tmp_path, name):
    (tmp_path / name).write_bytes(gzip.compress(b"") if name.endswith("gz") else b"")
    for read in (held_columns, lambda path: read_columns(path, ["r"])):
        with pytest.raises(
            InputError, match=r"the file holds nothing, it is empty; copy or record it"
        ):
            read(tmp_path / name)


def test_a_packed_file_that_stands_for_gigabytes_is_refused(tmp_path):
    (tmp_path / "bomb.csv.gz").write_bytes(gzip.compress(b"1,2\n" * 2**24, 9))
    (tmp_path / "bomb.json.gz").write_bytes(gzip.compress(b"[" + b"[]," * 2**23 + b"[]]", 9))
    for name in ("bomb.csv.gz", "bomb.json.gz"):
        with pytest.raises(InputError, match=r"bytes stand for .* bytes of numbers"):
            read_columns(tmp_path / name, ["0"])


def _whole(suffix: str, folder) -> bytes:
    """Return the bytes of a good file."""
    file = folder / f"whole{suffix}"
    if suffix == ".mat":
        savemat(file, {"r": R, "y": Y, "s": {"m": np.stack([R, Y])}}, do_compression=True)
    elif suffix == ".npz":
        np.savez_compressed(file, r=R, y=Y)
    elif suffix == ".npy":
        np.save(file, np.rec.fromarrays([R, Y], names="r,y"))
    elif suffix in (".h5", ".hdf5") and find_spec("h5py"):
        h5py = importlib.import_module("h5py")
        with h5py.File(file, "w") as stored:
            stored["r"], stored["y"] = R, Y
            stored.create_dataset("m", data=np.stack([R, Y]), compression="gzip")
    elif suffix in (".json", ".jsonl", ".ndjson"):
        file.write_text(json.dumps([{"r": r, "y": y} for _, r, y in ROWS]))
    else:
        file.write_text("t,r,y\n" + table(","))
    return file.read_bytes()


@settings(max_examples=300)
@given(suffix=st.sampled_from(sorted(READERS)), data=st.data())
def test_whatever_the_bytes_there_are_numbers_or_a_sentence(tmp_path_factory, suffix, data):
    folder = tmp_path_factory.getbasetemp()
    content = bytearray(_whole(suffix, folder))
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=4))
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content))) :]
    file = folder / f"fuzzed{suffix}"
    file.write_bytes(content)
    for names in (["r", "y"], ["0"], ["s.m[1]"]):
        try:
            found = read_columns(file, names)[0]
        except InputError as refused:
            assert "\n" not in str(refused) and str(refused).startswith(str(file))
        else:
            assert all(np.isfinite(each).all() and each.ndim == 1 for each in found.values())
