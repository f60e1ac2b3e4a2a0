"""MAT, HDF5 and JSON files as recorders write them: versions, structures, cells, stamps, rows."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io.matlab
from scipy.io import savemat

from fjr_cli.import_summary import held_by
from fjr_kit.errors import InputError
from fjr_records.importers.columns import held_columns, read_columns
from fjr_records.importers.import_map import Column

T = np.arange(40) / 100.0
R, Y = np.sin(7 * T), 0.5 * np.sin(7 * T - 0.3)


def names_in(path) -> list[str]:
    return [one.name for one in held_columns(path)[0]]


def test_mat_of_version_4(tmp_path):
    savemat(tmp_path / "a.mat", {"t": T, "y": Y[:, None], "m": np.array([R, Y])}, format="4")
    found = read_columns(tmp_path / "a.mat", ["t", "y", "m[0]"])[0]
    np.testing.assert_array_equal(list(found.values()), [T, Y, R])
    big = np.random.default_rng(0).normal(size=10**6)
    savemat(tmp_path / "big.mat", {"t": big}, format="4")
    np.testing.assert_array_equal(read_columns(tmp_path / "big.mat", ["t"])[0]["t"], big)


@pytest.mark.parametrize("kind", [0, 50, 2])
@pytest.mark.parametrize("rows", [2**31 - 1, -5, 10**6])
def test_mat_of_version_4_that_lies_about_its_size_is_refused(tmp_path, kind, rows):
    head = struct.pack("<5i", kind, rows, 900, 1, 2)
    (tmp_path / "a.mat").write_bytes(head + b"y\0" + bytes(800))
    with pytest.raises(InputError, match=r"a\.mat: is not a readable MAT file"):
        read_columns(tmp_path / "a.mat", ["y"])


@pytest.mark.parametrize("kind", [0, 8, 10, 11, 19, 200, 70000])
@pytest.mark.parametrize("content", [{"y": Y}, {"s": {"y": Y}}])
def test_a_damaged_type_in_a_mat_file_ends_in_a_sentence_and_not_the_process(
    tmp_path, content, kind
):
    savemat(tmp_path / "a.mat", content)
    whole = (tmp_path / "a.mat").read_bytes()
    damaged = whole.replace(struct.pack("<II", 9, 320), struct.pack("<II", kind, 320))
    assert damaged != whole
    (tmp_path / "a.mat").write_bytes(damaged)
    with pytest.raises(InputError, match=r"a\.mat: is not a readable MAT file; save it again\.$"):
        read_columns(tmp_path / "a.mat", ["y"])


SCIPYS = sorted((Path(scipy.io.matlab.__file__).parent / "tests" / "data").glob("*.mat"))


@pytest.mark.skipif(not SCIPYS, reason="SciPy is installed without its tests")
def test_files_that_matlab_wrote_are_read():
    damaged = {"bad_miuint32", "bad_miutf8_array_name", "corrupted_zlib_checksum",
               "corrupted_zlib_data", "debigged_m4", "malformed1"}  # fmt: skip
    refused = set()
    for file in SCIPYS:
        try:
            held_columns(file)
        except InputError as why:
            if "read by h5py, not installed" not in str(why):
                refused.add(file.stem)
    assert refused <= damaged


def dspace(names, units) -> dict:
    """Return a recording as dSPACE ControlDesk exports it."""
    kinds = [(field, object) for field in ("Name", "Data", "Unit", "XIndex")]
    signals = np.zeros(len(names), kinds)
    signals["Name"], signals["Unit"], signals["XIndex"] = names, units, 1.0
    for at, values in enumerate([R, Y, T][: len(names)]):
        signals["Data"][at] = values
    time = {"Name": "", "Data": 1e3 * T, "Unit": "ms"}
    return {"exp_001": {"X": time, "Y": signals, "Description": "Bench", "Capture": {"Delay": 0}}}


def as_7_3(path, content) -> None:
    """Write variables as MATLAB does with `-v7.3`: texts as words, elements behind references."""
    h5py = pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    with h5py.File(path, "w", userblock_size=512) as file:

        def behind(value):
            put(place := f"#refs#/{len(file.require_group('#refs#'))}", value)
            return file[place].ref

        def references(place, values):
            cells = np.array([[behind(value)] for value in values], h5py.ref_dtype)
            return file.create_dataset(place, data=cells)

        def put(place, value):
            if isinstance(value, dict):
                file.require_group(place).attrs["MATLAB_class"] = np.bytes_("struct")
                for field, inner in value.items():
                    put(f"{place}/{field}", inner)
            elif isinstance(value, str):
                words = np.frombuffer(value.encode("utf-16-le"), np.uint16)[:, None]
                file[place] = words if value else np.zeros(2, np.uint64)
                file[place].attrs["MATLAB_class"] = np.bytes_("char")
                if not value:
                    file[place].attrs["MATLAB_empty"] = np.uint8(1)
            elif isinstance(value, list):
                references(place, value).attrs["MATLAB_class"] = np.bytes_("cell")
            elif isinstance(value, np.ndarray) and value.dtype.names:
                file.require_group(place).attrs["MATLAB_class"] = np.bytes_("struct")
                for field in value.dtype.names:
                    references(f"{place}/{field}", value[field])
            else:
                file[place] = np.atleast_2d(value).T
                file[place].attrs["MATLAB_class"] = np.bytes_("double")

        for name, value in content.items():
            put(name, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")


WRITERS = {"5": savemat, "7.3": as_7_3}


@pytest.mark.parametrize("version", WRITERS)
def test_channels_of_dspace_have_their_names_and_units(tmp_path, version):
    names = ["motor angle", "Platform()://Model Root/iq", "Model Root/t"]
    WRITERS[version](tmp_path / "a.mat", dspace(names, ["deg", "A", ""]))
    listed = ["exp_001.X.Data", "motor angle", "exp_001.Y[1].Data", "Model Root/t"]
    assert sorted(names_in(tmp_path / "a.mat")) == sorted(listed)
    assert ", called 'Platform()://Model Root/iq'" in "\n".join(held_by(tmp_path / "a.mat"))
    asked = [*names, "exp_001.Y[0].Data", "exp_001.X.Data"]
    found, headings = read_columns(tmp_path / "a.mat", asked)
    np.testing.assert_array_equal(list(found.values()), [R, Y, T, R, 1e3 * T])
    for text, factor in ((names[0], math.pi / 180.0), (asked[3], math.pi / 180.0), (names[2], 1.0)):
        column = Column.parse("position", text)
        read = column.read_as(tmp_path / "a.mat", "position", headings[text])
        assert read.factor == factor and read.stated == (factor != 1.0)
    time = Column.parse("time", asked[4]).read_as(tmp_path / "a.mat", "time", headings[asked[4]])
    assert time.unit == "ms"
    current = Column("exp_001.Y[1].Data")
    with pytest.raises(InputError, match=r"a\.mat: torque is mapped to Plat.* says to be in A; gi"):
        current.read_as(tmp_path / "a.mat", "torque", headings[names[1]])


def test_degrees_that_a_recording_of_dspace_states_are_taken_as_such(tmp_path, run):
    content = dspace(["angle", "torque"], ["deg", "Nm"])
    savemat(tmp_path / "a.mat", content)
    words = ("--dry-run", "--map", "position=angle,torque=torque,time=exp_001.X.Data")
    done = run("import", tmp_path / "a.mat", *words)
    assert "(angle in deg as the file says, times 0.0174533)" in done.stdout, done.stderr
    assert "0.39 s at 100 Hz" in done.stdout or "0.4 s at 100 Hz" in done.stdout


@pytest.mark.parametrize("version", WRITERS)
def test_channels_of_one_name_keep_their_places(tmp_path, version):
    WRITERS[version](tmp_path / "a.mat", dspace(["Out1", "Out1"], ["", ""]))
    listed = ["exp_001.X.Data", "exp_001.Y[0].Data", "exp_001.Y[1].Data"]
    assert sorted(names_in(tmp_path / "a.mat")) == listed
    with pytest.raises(InputError, match="there is no Out1; the file holds exp_001"):
        read_columns(tmp_path / "a.mat", ["Out1"])


@pytest.mark.parametrize("version", WRITERS)
@pytest.mark.parametrize("name", ["a" * 200, "\x07bell", " ", "-q", "exp_001.X.Data"])
def test_a_name_that_no_map_can_hold_is_not_listed(tmp_path, version, name):
    WRITERS[version](tmp_path / "a.mat", dspace([name, "iq"], ["x" * 200, "A"]))
    assert sorted(names_in(tmp_path / "a.mat")) == ["exp_001.X.Data", "exp_001.Y[0].Data", "iq"]
    found, headings = read_columns(tmp_path / "a.mat", ["exp_001.Y[0].Data", "exp_001.X.Data"])
    np.testing.assert_array_equal(list(found.values()), [R, 1e3 * T])
    assert [each.unit for each in headings.values()] == ["", "ms"]


@pytest.mark.parametrize("version", WRITERS)
def test_a_timeseries_as_a_structure_states_the_unit_of_its_data_alone(tmp_path, version):
    series = {"Name": "q", "Time": T, "Data": np.array([R, Y]), "Units": "deg"}
    WRITERS[version](tmp_path / "a.mat", {"ts": series, "enc": {"unit": "rev", "x": R}})
    found, headings = read_columns(tmp_path / "a.mat", ["ts.Time", "ts.Data[1]", "q[0]", "enc.x"])
    np.testing.assert_array_equal(list(found.values()), [T, Y, R, R])
    assert [each.unit for each in headings.values()] == ["", "deg", "deg", "rev"]


@pytest.mark.parametrize("version", WRITERS)
def test_cells_of_vectors_are_columns(tmp_path, version):
    cells, uneven = np.zeros((2, 2), object)
    cells[:], uneven[:] = [R, Y], [R, Y[:9]]
    if version == "7.3":
        cells, uneven = list(cells), list(uneven)
    nested = {"log": {"c": cells}, "u": uneven, "words": ["a", "bc"]}
    WRITERS[version](tmp_path / "a.mat", nested)
    assert sorted(names_in(tmp_path / "a.mat")) == ["log.c[0]", "log.c[1]", "u[0]", "u[1]"]
    found = read_columns(tmp_path / "a.mat", ["log.c[1]", "u[1]"])[0]
    np.testing.assert_array_equal(found["log.c[1]"], Y)
    np.testing.assert_array_equal(found["u[1]"], Y[:9])


def test_hdf5_states_units_in_attributes_and_what_is_empty_is_no_obstacle(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/q"], file["run/none"] = np.array([R, Y]), h5py.Empty(float)
        file["run/q"].attrs["units"] = "deg"
        file["enc/data"], file["enc/unit"], file["Log/t"] = R, "mrad", T
        file["Log/t"].attrs["unit_string"] = "ms"
    found, headings = read_columns(tmp_path / "a.h5", ["run.q[1]", "enc.data", "Log.t"])
    np.testing.assert_array_equal(list(found.values()), [Y, R, T])
    assert [each.unit for each in headings.values()] == ["deg", "mrad", "ms"]
    assert sorted(names_in(tmp_path / "a.h5")) == ["Log.t", "enc.data", "run.q"]


def test_references_that_lead_in_circles_end(tmp_path):
    h5py = pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for k in range(30):
            group = file.create_group(f"g{k}")
            group["x"] = R
            group.create_dataset("c", (30, 1), h5py.ref_dtype)
        for k in range(30):
            file[f"g{k}/c"][:] = np.array([[file[f"g{at}"].ref] for at in range(30)], object)
            file[f"g{k}/c"].attrs["MATLAB_class"] = np.bytes_("cell")
    with (tmp_path / "a.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    assert "g3.x" in names_in(tmp_path / "a.mat") and len(names_in(tmp_path / "a.mat")) == 60


ISO = "2023-11-14T22:13:{}"
QUOTED = [{"t": ISO.format("20.001"), "y": 1}, {"t": ISO.format("20.251"), "y": 2}]
CLOCKS = {
    "entries": json.dumps(QUOTED),
    "lists": json.dumps({"t": [ISO.format("59.875Z"), ISO.format("60.125Z")], "y": [1, 2]}),
    "lines": '{"t": "23:59:58.5", "y": "1"}\n{"t": "23:59:58.75", "y": "2"}\n',
}  # fmt: skip


@pytest.mark.parametrize("kind", CLOCKS)
def test_json_with_stamps_of_calendar_and_clock_and_numbers_in_quotes(tmp_path, kind):
    (tmp_path / "a.json").write_text(CLOCKS[kind])
    found, headings = read_columns(tmp_path / "a.json", ["t", "y"])
    np.testing.assert_allclose(found["t"], [0.0, 0.25], atol=1e-9)
    assert found["y"].tolist() == [1.0, 2.0]
    assert headings["t"].unit == "s" and headings["y"].unit == ""
    assert names_in(tmp_path / "a.json") == ["t", "y"]


def test_json_stamps_of_two_columns_count_from_one_origin(tmp_path):
    rows = [{"a": ISO.format("20.0"), "b": ISO.format("20.5")}] * 2
    (tmp_path / "a.json").write_text(json.dumps(rows))
    found = read_columns(tmp_path / "a.json", ["b", "a"])[0]
    np.testing.assert_allclose(found["b"] - found["a"], 0.5, atol=1e-9)


@pytest.mark.parametrize(("sec", "ns"), [("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs")])
def test_json_with_stamps_of_ros(tmp_path, sec, ns):
    stamps = [(1_700_000_000, 999_999_999), (1_700_000_001, 1_000_999)]
    rows = [
        {"header": {"stamp": {sec: s, ns: n}, "frame_id": ""}, "effort": [float(n)]}
        for s, n in stamps
    ]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, rows)))
    assert names_in(tmp_path / "a.jsonl") == ["header.stamp", "effort"]
    names = ["header.stamp", f"header.stamp.{ns}"]
    found, headings = read_columns(tmp_path / "a.jsonl", names)
    assert np.diff(found[names[0]]) == pytest.approx(0.001001, rel=1e-9)
    assert found[names[1]].tolist() == [999_999_999.0, 1_000_999.0]
    assert [headings[name].unit for name in names] == ["s", ""]


@pytest.mark.parametrize("rows", [["0", "1", "2"], ["0.0", "0.5", "1.0"], ["7", "3", "5"]])
def test_json_as_pandas_writes_it(tmp_path, rows):
    columns = {"r": dict(zip(rows, R[:3], strict=True)), "y": dict(zip(rows, Y[:3], strict=True))}
    (tmp_path / "a.json").write_text(json.dumps(columns))
    found = read_columns(tmp_path / "a.json", ["r", "y"])[0]
    np.testing.assert_array_equal(list(found.values()), [R[:3], Y[:3]])
    if rows[0] == "0":
        assert names_in(tmp_path / "a.json") == ["r", "y"]
    else:
        index = read_columns(tmp_path / "a.json", ["index"])[0]["index"]
        assert index.tolist() == [float(row) for row in rows]


def test_json_lines_of_several_topics_whose_values_are_lists(tmp_path):
    rows = []
    for k in range(40):
        rows.append({"t": T[k], "position": [R[k], Y[k]], "effort": [] if k % 2 else [Y[k], R[k]]})
        rows += [{"t": T[k] + 0.001, "cmd": 0.5}, {"t": T[k] + 0.002, "mode": "idle"}]
    (tmp_path / "a.jsonl").write_text("\n".join(map(json.dumps, rows)))
    found = read_columns(tmp_path / "a.jsonl", ["t", "position[1]", "effort[0]", "cmd"])[0]
    assert all(each.size == 120 for each in found.values())
    np.testing.assert_array_equal(found["position[1]"][::3], Y)
    np.testing.assert_array_equal(found["effort[0]"][::6], Y[::2])
    assert np.isnan(found["position[1]"]).sum() == 80 and np.isnan(found["effort[0]"]).sum() == 100


JSON_BROKEN = [
    ('[{"t": "22:13:20"}, {"t": 5}]', "t is 5 in entry 1, not a stamp of calendar and clock; repa"),
    ('[{"t": "22:13:20"}, {"t": "x"}]', "t is 'x' in entry 1, not a stamp of calendar and clock"),
    ('[{"t": "1.5"}, {"t": "x"}]', "t is 'x' in entry 1, not a number; repair or cut the record"),
    ('[{"t": {"sec": 1, "nanosec": 2}}, {"t": 3}]', "t is 3 in entry 1, not a stamp of sec and"),
    ('[{"t": 1}, {"t": {"sec": 1, "nanosec": 2}}]', "in entry 1, not a number; repair or cut"),
    ('[{"t": 1' + "0" * 400 + '}, {"t": 2}]', "t does not hold real numbers; choose another"),
    ('[{"t": [1, "x"]}, {"t": [1, 2]}]', "t does not hold real numbers; choose another column"),
    ("[" + '{"t": [' + "1," * 9000 + "1]}" + ',{"s": 1}' * 9000 + "]", "entry 1 has no t"),
    ('{"t": ["' + "x" * 200_000 + '"' + ', "a"' * 200_000 + "]}", "not a number; repair or cut"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "says"), JSON_BROKEN)
def test_json_that_is_broken_is_refused_in_a_sentence(tmp_path, text, says):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=says) as refused:
        read_columns(tmp_path / "a.json", ["t"])
    assert (
        str(refused.value).startswith(f"{tmp_path / 'a.json'}: ") and len(str(refused.value)) < 400
    )


@pytest.mark.parametrize("suffix", [".mat", ".json", ".jsonl", ".npz", ".npy", ".h5"])
def test_an_empty_file_and_a_folder_are_called_so(tmp_path, suffix):
    if suffix == ".h5":
        pytest.importorskip("h5py", reason="h5py, of the extra hdf5, is not installed")
    (tmp_path / f"empty{suffix}").touch()
    with pytest.raises(InputError, match=r"is not .*: the file is empty; copy or record it again"):
        read_columns(tmp_path / f"empty{suffix}", ["t"])
    (tmp_path / f"folder{suffix}").mkdir()
    for use in (held_columns, lambda path: read_columns(path, ["t"])):
        with pytest.raises(
            InputError, match="is a folder, not a file; name the files in it, as in"
        ):
            use(tmp_path / f"folder{suffix}")
