"""Units that a file states itself: names of columns, rows of units, and what contradicts them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fjr_kit.errors import InputError
from fjr_records.importers.import_map import UNITS, parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.importers.stated_units import stated_unit

RATE = 100.0
T = np.arange(400) / RATE
U = np.random.default_rng(5).normal(size=T.size)
Y = np.cumsum(U) / 50.0  # rad
DEGREE = math.pi / 180.0


@pytest.mark.parametrize(
    ("quantity", "title", "unit"),
    [
        ("position", "act [deg]", "deg"),
        ("position", "Angle (°)", "deg"),
        (
            "position",
            "Winkel / Grad",
            "Grad",
        ),  # degrees in German, else a hundredth of a right angle
        ("position", "phi/°", "deg"),
        ("position", "Istwinkel [Grad]", "Grad"),
        ("position", "pos [arcsec]", "arcsec"),
        ("position", "pos [turns]", "rev"),
        ("position", "pos_inc", "inc"),
        ("position", "CMD_DEG", "deg"),
        ("position", "pos [deg.]", "deg"),
        ("position", "pos (motor)", ""),
        ("position", "pos [xyz]", "xyz"),
        ("position", "log/theta", ""),
        ("position", "pos [1]", ""),
        ("position", "x [in]", "in"),
        ("torque", "Torque [Ncm]", "Ncm"),
        ("torque", "cur_mA", "mA"),
        ("torque", "I_q [Arms]", "Arms"),
        ("time", "t/s", "s"),
        ("time", "Time [min]", "min"),
        ("time", "TIME_MS", "ms"),
        ("time", "stamp [usec]", "us"),
        ("time", "log/t", ""),
        ("position", "rec.act_pos_mot_deg[0]", "deg"),
        ("position", "position_mrad", "mrad"),
        ("position", "qd_rad_s", "rad/s"),
        ("position", "speed [1/min]", "rpm"),
        ("position", "pos_m", ""),  # of the motor, perhaps
        ("position", "x [m]", "m"),
        ("position", "pos_rev", ""),  # the other way round, perhaps
        ("position", "enc [counts]", "counts"),
        ("position", "q[1]", ""),
        ("position", "rad", ""),
        ("torque", "tau_Nm", "Nm"),
        ("torque", "tau_nm", "Nm"),
        ("torque", "Torque [N·m]", "N m"),
        ("torque", "T [MNm]", "MNm"),
        ("torque", "Iq {A}", "A"),
        ("torque", "torque_deg", ""),
        ("time", "time_ms", "ms"),
        ("time", "Time (sec)", "s"),
        ("time", "stamp [µs]", "us"),
    ],
)
def test_the_name_of_a_column_states_its_unit(quantity, title, unit):
    assert stated_unit(title, "", UNITS[quantity]) == unit


def test_a_row_of_units_comes_before_the_name():
    assert stated_unit("pos [rad]", "deg", UNITS["position"]) == "deg"
    assert stated_unit("pos [rad]", "-", UNITS["position"]) == "rad"


def table(path, names, position=Y / DEGREE, time=T, units=None):
    """Write a table of time, torque and position; return its path."""
    rows = np.column_stack([time, U, position])
    head = ",".join(names) + ("\n" + ",".join(units) if units else "")
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=head, comments="")
    return path


def understood(files, *specs):
    return read_files(files, ImportOptions(parse_map(specs)))


@pytest.mark.parametrize(
    ("names", "units", "specs"),
    [
        (("t [ms]", "u", "y [deg]"), None, ("torque=u", "position=y [deg]", "time=t [ms]")),
        (("t", "u", "y"), ("ms", "N m", "deg"), ("torque=u", "position=y", "time=t")),
        (("t_ms", "u_Nm", "y_deg"), None, ("torque=1", "position=2", "time=0")),
        (("t", "u", "y"), None, ("torque=u", "position=y:degrees", "time=t:msec")),
        (("t [s]", "u", "y [rad]"), None, ("torque=u", "position=y [rad]:deg", "time=t [s]:ms")),
    ],
)
def test_a_stated_unit_is_taken_where_the_map_gives_none(tmp_path, names, units, specs):
    file = table(tmp_path / "run.csv", names, time=1000.0 * T, units=units)
    (record,) = understood([file], *specs).records
    assert record.sample_rate_hz == pytest.approx(RATE)
    np.testing.assert_allclose(record.signals["y"], Y, rtol=1e-7, atol=1e-9)
    assert any("its column says rad" in doubt for doubt in record.doubts) is ("[rad]" in names[2])


def test_a_stated_length_makes_the_axis_linear(tmp_path):
    file = table(tmp_path / "run.csv", ("t", "f", "x [mm]"), position=1000.0 * Y)
    found = understood([file], "torque=f", "position=x [mm]", "time=t")
    assert found.descriptions[0].linear
    np.testing.assert_allclose(found.records[0].signals["y"], Y, rtol=1e-7, atol=1e-9)
    with pytest.raises(InputError, match=r"run\.csv: has position in mm, as of a linear axis"):
        understood([file], "torque=f:N m", "position=x [mm]", "time=t")


def test_a_current_and_counts_need_a_factor(tmp_path):
    file = table(tmp_path / "run.csv", ("t", "I [A]", "y [counts]"))
    with pytest.raises(InputError, match=r"torque is mapped to I \[A\], .* in A; give the unit"):
        understood([file], "torque=I [A]", "position=y [counts]:0.01", "time=t")
    with pytest.raises(InputError, match=r"position=y \[counts\]:0\.25"):
        understood([file], "torque=I [A]:0.5", "position=y [counts]", "time=t")
    (record,) = understood([file], "torque=I [A]:0.5", "position=2:0.01", "time=t").records
    np.testing.assert_allclose(record.signals["u"], 0.5 * U, rtol=1e-7, atol=1e-9)
    assert not record.doubts


def test_files_that_state_other_units_are_each_read_in_their_own(tmp_path):
    files = [
        table(tmp_path / "old.csv", ("t", "u", "y [deg]")),
        table(tmp_path / "new.csv", ("t", "u", "y [rad]"), position=Y),
    ]
    one, other = understood(files, "torque=u", "position=2", "time=t").records
    np.testing.assert_allclose(one.signals["y"], other.signals["y"], rtol=1e-7, atol=1e-9)
    files[1] = table(tmp_path / "sled.csv", ("t", "u", "x [m]"), position=Y)
    with pytest.raises(InputError, match=r"old\.csv and .*sled\.csv state units of different kind"):
        understood(files, "torque=u", "position=2", "time=t")


def test_the_summary_says_whose_unit_it_is(run, tmp_path):
    file = table(tmp_path / "run.csv", ("t", "u", "y [deg]"))
    done = run("import", file, "--map", "torque=u,position=y [deg],time=t", "--dry-run")
    assert done.exit_code == 0
    assert "(y [deg] in deg as the file says, times 0.0174533)" in done.output


def test_a_unit_that_is_not_known_is_refused_in_brackets_and_in_a_row(tmp_path):
    for names, units in ((("t", "u", "y [furlong]"), None), (("t", "u", "y"), ("s", "Nm", "xyz"))):
        file = table(tmp_path / "run.csv", names, units=units)
        with pytest.raises(InputError, match=r"which the file says to be in (furlong|xyz); give"):
            understood([file], "torque=u", "position=2", "time=t")
        (record,) = understood([file], "torque=u", "position=2:deg", "time=t").records
        np.testing.assert_allclose(record.signals["y"], Y, rtol=1e-7, atol=1e-9)


def test_minutes_and_newton_centimetres_are_what_they_are(tmp_path):
    file = table(tmp_path / "run.csv", ("t [min]", "u [Ncm]", "y [turns]"), time=T / 60.0)
    (record,) = understood([file], "torque=1", "position=2", "time=0").records
    assert record.sample_rate_hz == pytest.approx(RATE, rel=1e-6)
    np.testing.assert_allclose(record.signals["u"], U / 100.0, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(record.signals["y"], 360.0 * Y, rtol=1e-7, atol=1e-7)


def test_one_column_is_not_two_signals():
    with pytest.raises(InputError, match="reference and position in one column, y; map the column"):
        parse_map(["reference=y", "torque=u", "position=y:deg"])
