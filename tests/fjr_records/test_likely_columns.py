"""Which columns are proposed for a map, by names as loggers give them."""

from __future__ import annotations

import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.likely_columns import likely_map


@pytest.mark.parametrize(
    ("names", "specs"),
    [
        (
            ["time [s]", "cmd [deg]", "act [deg]", "I [A]"],
            "time=time [s] reference=cmd [deg] torque=I [A]:FACTOR position=act [deg]",
        ),
        (["t", "r", "u", "y"], "time=t reference=r torque=u position=y"),
        (
            ["log.goal_position", "log.load", "log.speed"],
            "reference=log.goal_position torque=log.load",
        ),
        (["MotorAngle", "MotorTorque"], "torque=MotorTorque position=MotorAngle"),
        (["load_angle", "torque_ref"], "position=load_angle"),
        (["para.k_T", "run.t", "y_T"], "time=run.t position=y_T"),
        (["q1", "q2", "tau1", "tau2"], ""),
        (
            ["Zeit [ms]", "Soll [mm]", "Ist [mm]", "Kraft [N]"],
            "time=Zeit [ms] reference=Soll [mm] torque=Kraft [N] position=Ist [mm]",
        ),
        (
            ["Zeit", "Weg", "Strom [A]"],
            "time=Zeit torque=Strom [A]:FACTOR position=Weg",
        ),
        (
            ["temps", "consigne", "couple", "position"],
            "time=temps reference=consigne torque=couple position=position",
        ),
        (["a,b", "0", "1", "torque:x"], ""),
    ],
)
def test_a_column_is_proposed_where_its_name_alone_says_so(names, specs):
    found = likely_map(names)
    assert " ".join(f"{quantity}={column}" for quantity, column in found.items()) == specs


def test_what_is_proposed_can_be_given(run, tmp_path):
    rows = "\n".join(f"{k / 100},{k % 7},{(k % 11) / 10}" for k in range(200))
    (tmp_path / "run.csv").write_text(f"Time (s),Motor Torque [Nm],Motor Angle [deg]\n{rows}\n")
    listed = run("import", tmp_path / "run.csv")
    proposed = listed.output.split("--map ")[1].strip().strip("'")
    assert set(parse_map(proposed.split(","))) == {"torque", "position", "time"}
    assert "as the names suggest" in listed.output
    done = run("import", tmp_path / "run.csv", "--map", proposed, "--dry-run")
    assert done.exit_code == 0 and "in deg as the file says" in done.output
    (tmp_path / "bare.csv").write_text(rows + "\n")
    bare = run("import", tmp_path / "bare.csv").output
    assert "torque=COLUMN:UNIT,position=COLUMN:UNIT" in bare and "suggest" not in bare
