"""`fjr check`: a table, a sentence for each fault, and the exit status."""

from __future__ import annotations

import pytest
from bag_tools import WHOLE, experiment, foreign_bag, rig_streams, write_bag


def test_a_whole_bag_is_well(run, tmp_path):
    write_bag(tmp_path / "bag", experiment())
    done = run("check", tmp_path / "bag")
    assert done.exit_code == 0, done.output
    assert "/rig/motor_torque" in done.stdout and "Nothing is wrong." in done.stdout
    assert "every sample is there once" in done.stdout


def test_on_eighty_columns_there_are_tables_and_no_list(run, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    write_bag(tmp_path / "bag", experiment())
    lines = run("check", tmp_path / "bag").stdout.splitlines()
    rows = [line.split() for line in lines if line.strip().startswith("/rig/motor_torque ")]
    times, words = rows
    assert times[1:3] == [str(len(WHOLE)), "1000"] and words[1:4] == ["0", "0", "Jazzy"]
    assert max(map(len, lines[1:])) <= 80


def test_every_bag_is_looked_at_and_one_fault_is_status_1(run, tmp_path):
    write_bag(tmp_path / "bags/whole", experiment())
    lossy = {"r": WHOLE, "y": sorted({*WHOLE} - {9}), "u": WHOLE}
    foreign_bag(tmp_path / "bags/lossy", rig_streams(lossy))
    (tmp_path / "bags/cut").mkdir()
    data = next((tmp_path / "bags/whole").glob("*.mcap")).read_bytes()
    (tmp_path / "bags/cut/cut.mcap").write_bytes(data[:100] + b"x" + data[101:])
    done = run("check", tmp_path / "bags")
    assert done.exit_code == 1, done.output
    assert "/rig/motor_position: 1 message is missing between the others." in done.stdout
    assert "1 of 3 bags are well." in done.stdout
    assert "cut" in done.stdout and "Nothing is wrong." in done.stdout


def test_a_map_audits_the_signals_of_another_rig(run, tmp_path):
    write_bag(tmp_path / "bag", experiment())
    source = ("--map", "position=/rig/motor_position:position[elbow]")
    done = run("check", tmp_path / "bag", *source)
    assert done.exit_code == 1 and "joint 'elbow' is not among joint" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("/no/bag",), "/no/bag: is not a readable folder"),
        (("{bag}", "--topic", "speed"), "holds no topic speed; there are: /rig/experiment"),
    ],
)
def test_what_is_not_there_is_status_2(run, tmp_path, arguments, says):
    write_bag(tmp_path / "bag", experiment())
    done = run("check", *(each.format(bag=tmp_path / "bag") for each in arguments))
    assert done.exit_code == 2 and says in done.stderr and "Traceback" not in done.output


def test_a_chosen_topic_must_have_messages(run, tmp_path):
    foreign_bag(tmp_path / "bag", {**rig_streams(dict.fromkeys("ryu", WHOLE)), "/empty": []})
    assert run("check", tmp_path / "bag").exit_code == 0
    done = run("check", tmp_path / "bag", "--topic", "empty")
    assert done.exit_code == 1 and "/empty: no message." in done.stdout
