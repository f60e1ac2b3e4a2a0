"""Lines above a table: names, units, descriptions and values, as scopes and loggers write them."""

from __future__ import annotations

import time
from itertools import permutations

import numpy as np
import pytest

from fjr_kit.errors import InputError
from fjr_records.importers.columns import read_columns
from fjr_records.importers.text import open_text

T = np.arange(30) / 1000.0
POS, TRQ = np.sin(7.0 * T), np.cos(9.0 * T)


def rows(*columns: np.ndarray, delimiter: str = ",", end: str = "") -> str:
    return "".join(f"{delimiter.join(map(repr, row))}{end}\n" for row in zip(
        *(each.tolist() for each in columns), strict=True
    ))  # fmt: skip


TWINCAT = (
    "Name\tScope YT\nFile\tC:\\a.csv\n\nName\tpos\tName\ttrq\nSymbolComment\t\tSymbolComment\t\n"
    "Data-Type\tREAL64\tData-Type\tREAL64\nSymbolName\tMAIN.pos\tSymbolName\tMAIN.trq\n"
    "Port\t851\tPort\t851\nOffset\t0\tOffset\t0\nScale factor\t1\tScale factor\t1\n"
)
LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    "Date\t2011/10/13\t2011/10/13\t\nY_Unit_Label\tdeg\tN m\t\nX0\t0.0\t0.1\t\n"
    "Delta_X\t0.001\t0.001\t\n"
    "***End_of_Header***\t\t\t\nX_Value\tpos\ttrq\tComment\n"
)
RIGOL = "X,pos,trq,CH3,Start,Increment,\nSequence,Volt,Volt,Volt,0,1e-4\n"
HEADS = {
    "a time before each channel": (
        TWINCAT + rows(T, POS, T, TRQ, delimiter="\t"),
        ("pos", "trq", "MAIN.pos", "MAIN.trq"),
    ),
    "one time": (
        TWINCAT + rows(T, POS, TRQ, delimiter="\t"),
        ("pos", "trq", "MAIN.pos", "MAIN.trq"),
    ),
    "semicolons": (
        TWINCAT.replace("\t", ";") + rows(T, POS, T, TRQ, delimiter=";").replace(".", ","),
        ("pos", "trq"),
    ),
    "few rows": (
        "Name\tpos\tName\ttrq\nOffset\t0\tOffset\t0\nScale\t1\tScale\t1\n"
        + rows(T[:3], POS[:3], T[:3], TRQ[:3], delimiter="\t"),
        ("pos", "trq"),
    ),
    "LabVIEW": (LABVIEW + rows(T, POS, TRQ, delimiter="\t", end="\t"), ("pos", "trq")),
    "Keysight": ("x-axis,1,2\nsecond,Volt,Volt\n" + rows(T, POS, TRQ), ("1", "2")),
    "Rigol": (RIGOL + rows(T, POS, TRQ, TRQ, end=","), ("pos", "trq")),
    "Rigol without a comma": (RIGOL + rows(T, POS, TRQ, TRQ), ("pos", "trq")),
}


@pytest.mark.parametrize("kind", HEADS)
def test_the_table_begins_below_lines_of_words_and_values(tmp_path, kind):
    text, names = HEADS[kind]
    (tmp_path / "a.csv").write_text(text)
    found = read_columns(tmp_path / "a.csv", names)[0]
    for name, expected in zip(names, 2 * (POS, TRQ), strict=False):
        np.testing.assert_array_equal(found[name], expected[: found[name].size])
    assert found[names[0]].size == (3 if kind == "few rows" else 30)


def test_a_channel_that_is_called_by_another_number_goes_by_that_of_its_column(tmp_path):
    (tmp_path / "a.csv").write_text("x-axis,2,4\nsecond,Volt,Volt\n" + rows(T, POS, TRQ))
    opened = open_text(tmp_path / "a.csv")
    assert opened.known == ["x-axis", "1", "2"]
    np.testing.assert_array_equal(opened.column("2"), TRQ)


@pytest.mark.parametrize("head", [TWINCAT, "t\tpos\tt\ttrq\n", "s\tdeg\ts\tN m\nt\tpos\tt\ttrq\n"])
@pytest.mark.parametrize("at", [0, 1, 7, 29])
def test_a_damaged_row_is_refused_with_its_line(tmp_path, head, at):
    lines = rows(T, POS, T, TRQ, delimiter="\t").splitlines()
    cells = lines[at].split("\t")
    lines[at] = "\t".join([cells[0], "oops", *cells[2:]])
    (tmp_path / "a.csv").write_text(head + "\n".join(lines))
    with pytest.raises(InputError, match=rf"line {head.count(chr(10)) + at + 1}: 'oops' in column"):
        read_columns(tmp_path / "a.csv", ["pos"])


def test_names_beyond_the_rows_are_refused_where_nothing_says_what_they_are(tmp_path):
    (tmp_path / "a.csv").write_text("t,pos,trq,more\ns,deg,N m,A\n" + rows(T, POS, TRQ))
    with pytest.raises(InputError, match="line 3 has 3 columns, not 4"):
        read_columns(tmp_path / "a.csv", ["pos"])


LINES = ("t,pos,trq", "ms,deg,N m", "elapsed time,angle of the motor,torque of the drive")


@pytest.mark.parametrize("order", permutations(range(3)))
@pytest.mark.parametrize("bracket", ["", "[]", "()"])
def test_names_units_and_descriptions_are_found_in_any_order(tmp_path, order, bracket):
    begin, end = bracket[:1], bracket[1:]
    units = ",".join(f"{begin}{unit}{end}" for unit in LINES[1].split(","))
    head = [(LINES[0], units, LINES[2])[at] for at in order]
    (tmp_path / "a.csv").write_text("\n".join(head) + "\n" + rows(T, POS, TRQ))
    opened = open_text(tmp_path / "a.csv")
    listed = LINES[min(order.index(0), order.index(2)) == order.index(2) and 2]
    assert opened.known == listed.split(",")
    assert [opened.headings[name].unit for name in opened.known] == ["ms", "deg", "N m"]
    for line in (LINES[0], LINES[2]):
        np.testing.assert_array_equal(opened.column(line.split(",")[1]), POS)


def test_units_in_the_descriptions_below_the_names_are_found(tmp_path):
    head = "t,pos,trq\ntime [ms],angle of the motor (deg),torque\n"
    (tmp_path / "a.csv").write_text(head + rows(T, POS, TRQ))
    opened = open_text(tmp_path / "a.csv")
    assert [opened.headings[name].unit for name in ("t", "pos", "trq")] == ["ms", "deg", ""]


def test_labels_of_lines_are_no_units(tmp_path):
    (tmp_path / "a.lvm").write_text(HEADS["LabVIEW"][0])
    opened = open_text(tmp_path / "a.lvm")
    assert [opened.headings[name].unit for name in opened.known] == ["", "deg", "N m"]


@pytest.mark.parametrize("label", ["Unit", "Units", "Einheit"])
def test_the_label_of_a_line_of_units_is_none(tmp_path, label):
    head = TWINCAT + f"SampleTime[ms]\t1\tSampleTime[ms]\t1\n{label}\tdeg\t{label}\tN m\n"
    (tmp_path / "a.csv").write_text(head + rows(T, POS, T, TRQ, delimiter="\t"))
    opened = open_text(tmp_path / "a.csv")
    assert [opened.headings[name].unit for name in opened.known] == ["ms", "deg", "ms", "N m"]


def test_what_a_line_of_units_says_below_the_names_is_taken_for_one_though_nobody_knows_it(
    tmp_path,
):
    (tmp_path / "a.csv").write_text(HEADS["Rigol"][0])
    opened = open_text(tmp_path / "a.csv")
    assert opened.headings["X"].unit == "Sequence"


def test_prose_above_names_nothing(tmp_path):
    head = (
        "# bench of Monday\n# by the drive\n# seen from behind\n# t pos trq\n# ms deg Nm\n# - - -\n"
    )
    (tmp_path / "a.txt").write_text(head + rows(T, POS, TRQ, delimiter=" "))
    assert open_text(tmp_path / "a.txt").known == ["t", "pos", "trq"]


WIDE = [",".join(f"{k:x}{line}x" for k in range(3000)) for line in range(40)]


@pytest.mark.parametrize("head", [WIDE, [",".join(["a"] * 3000)] * 40, [",".join(["1 A"] * 3000)]])
def test_a_megabyte_of_lines_above_a_table_is_read_in_seconds(tmp_path, head):
    table = [",".join(["1"] * 3000)] * ((1_000_000 - sum(map(len, head))) // 6000)
    (tmp_path / "a.csv").write_text("\n".join([*head, *table]))
    begin = time.process_time()
    opened = open_text(tmp_path / "a.csv")
    assert len(opened.known) == 3000
    assert time.process_time() - begin < 10.0
