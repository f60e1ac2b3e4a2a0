"""A known torque is taken off the recorded one, whatever its unit and its stamps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.known_torque import KNOWN, without_known
from fjr_records.importers.record_file import ImportOptions, Record

RATE, SECONDS = 200.0, 10
TIME = np.arange(int(RATE * SECONDS)) / RATE
ANGLE = np.sin(2.0 * np.pi * 0.4 * TIME) * np.minimum(TIME, 1.0)
TORQUE = 3.0 * np.sin(2.0 * np.pi * 0.4 * TIME + 2.5) * np.minimum(TIME, 1.0)
GRAVITY = 2.0 * np.sin(ANGLE + 0.3)


def read(folder: Path, maps: list[str], **columns: np.ndarray) -> Record:
    """Return a file with these columns as it is understood."""
    file = folder / "run.csv"
    header = ",".join(columns)
    table = np.column_stack(list(columns.values()))
    np.savetxt(file, table, fmt="%.12g", delimiter=",", header=header, comments="")
    (record,) = read_files([file], ImportOptions(parse_map(["position=q", *maps]))).records
    return record


@settings(max_examples=30)
@given(st.floats(-5.0, 5.0), st.integers(0, 10**6))
def test_what_is_left_moves_the_axis_alone(size, seed):
    rng = np.random.default_rng(seed)
    moves, known = rng.standard_normal((2, 100))
    values = {"torque": moves + size * known, KNOWN: size * known, "position": known}
    left, notes = without_known(values)
    assert set(left) == {"torque", "position"} and len(notes) == 1
    assert np.abs(left["torque"] - moves).max() < 1e-12 * (1.0 + abs(size))


@pytest.mark.parametrize(("unit", "factor"), [("N m", 1.0), ("mN m", 1e-3), ("-50", -50.0)])
def test_it_is_taken_off_in_its_own_unit(tmp_path, unit, factor):
    maps = ["time=t", "torque=u:N m", f"known_torque=g:{unit}"]
    record = read(tmp_path, maps, t=TIME, q=ANGLE, u=TORQUE + GRAVITY, g=GRAVITY / factor)
    assert np.abs(record.signals["u"] - TORQUE).max() < 1e-9
    assert any("the known torque" in note for note in record.notes)


def test_it_may_have_stamps_of_its_own(tmp_path):
    """A robot model that runs at another rate, here by numbers in rows of their own."""
    own = TIME + 0.3 / RATE
    later = 2.0 * np.sin(np.interp(own, TIME, ANGLE) + 0.3)
    maps = ["time=t", "torque=u:N m", "known_torque=g:N m", "known_torque_time=s"]
    record = read(tmp_path, maps, t=TIME, q=ANGLE, u=TORQUE + GRAVITY, g=later, s=own)
    inner = slice(20, -20)
    assert (
        np.abs(record.signals["u"] - np.interp(_stamps(record), TIME, TORQUE))[inner].max() < 0.01
    )


def _stamps(record: Record) -> np.ndarray:
    first = max(stamps[0] for stamps in record.timing.stamps_s.values())
    return first + np.arange(record.samples) / record.sample_rate_hz


@pytest.mark.parametrize(
    ("maps", "given_", "mend"),
    [
        (["position=q", "known_torque=g", "reference=r"], {"described": True}, "--controller"),
        (["position=q", "torque=u", "known_torque=g"], {"described": True}, "--controller"),
        (["position=q", "known_torque=g"], {"swings_free": True}, "map torque=COLUMN"),
        (["position=q", "known_torque=g"], {}, "map torque=COLUMN"),
    ],
)
def test_without_a_torque_that_drives_the_model_it_is_refused(maps, given_, mend):
    with pytest.raises(InputError, match="known_torque") as error:
        parse_map(maps, **given_)
    assert mend in str(error.value)
