"""Magnitudes in place of signed signals, jumps, words with a bit for the sign, odd names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.impossible import jump, magnitude_of_speed, magnitude_of_torque
from fjr_records.importers.record_file import ImportOptions, Record
from fjr_records.importers.words import with_sign

RATE = 500.0
TIME = np.arange(5000) / RATE
SPEED = np.sin(2 * np.pi * 0.7 * TIME) + 0.5 * np.sin(2 * np.pi * 1.9 * TIME)
ANGLE = np.cumsum(SPEED) / RATE
TORQUE = 0.1 * np.gradient(SPEED) * RATE + 0.4 * np.tanh(20 * SPEED)
NOISE = 0.01 * np.random.default_rng(0).standard_normal(TIME.size)


def imported(folder: Path, *specs: str, **columns: np.ndarray) -> Record:
    np.savez(folder / "a.npz", **columns)
    asked = ImportOptions(parse_map(specs), sample_rate_hz=RATE)
    return read_files([folder / "a.npz"], asked).records[0]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_magnitude_in_place_of_a_torque_is_told(sign):
    said = magnitude_of_torque(sign * np.abs(TORQUE + NOISE), ANGLE)
    assert said is not None and "magnitude" in said and "map a column that has the sign" in said


@pytest.mark.parametrize("weight", [0.0, 0.5, 1.0, 3.0])
def test_a_torque_with_its_sign_or_of_a_weight_is_none(weight):
    assert magnitude_of_torque(weight + TORQUE + NOISE, ANGLE) is None


def test_a_motion_one_way_may_take_one_sign():
    assert magnitude_of_torque(np.abs(TORQUE), np.cumsum(np.abs(SPEED))) is None


def test_a_magnitude_in_place_of_a_speed_is_told():
    assert "magnitude" in str(magnitude_of_speed(np.abs(SPEED), TORQUE + NOISE))
    assert magnitude_of_speed(SPEED, TORQUE + NOISE) is None


def test_an_axis_that_stops_and_goes_on_has_its_speed():
    speed = np.maximum(SPEED, 0.0)
    torque = 0.1 * np.gradient(speed) * RATE + 0.4 * np.tanh(20 * speed) + NOISE
    assert magnitude_of_speed(speed, torque) is None
    assert magnitude_of_speed(np.zeros(50), np.ones(50)) is None


def test_a_position_that_jumps_is_told_with_its_place(tmp_path):
    joined = np.where(np.arange(ANGLE.size) > 1999, ANGLE + 0.3, ANGLE)
    said = str(jump(joined, TIME))
    assert "after sample 1999, at 3.998 s" in said and "--skip-samples" in said
    doubts = imported(tmp_path, "torque=u", "position=y", u=TORQUE, y=joined).doubts
    assert any("jumps from" in doubt for doubt in doubts)


@pytest.mark.parametrize("step", [0.0, 1e-4, 1e-2, 0.05])
def test_steps_of_an_encoder_and_fast_starts_are_no_jumps(step):
    moves = np.where(TIME > 2.0, 1.0 - np.exp(-30.0 * np.maximum(TIME - 2.0, 0.0)), 0.0)
    for motion in (ANGLE, moves, np.where(TIME > 9.0, ANGLE, ANGLE[4500])):
        read = np.rint(motion / step) * step if step else motion
        assert jump(read, TIME) is None
    assert jump(np.zeros(100), TIME[:100]) is None


@pytest.mark.parametrize(("bit", "full"), [(1024, 120), (1024, 900), (128, 100)])
def test_a_bit_for_the_direction_is_taken_as_a_sign(bit, full):
    load = np.rint(full * TORQUE / np.abs(TORQUE).max())
    word = np.where(load < 0, bit - load, load)
    signed, said = with_sign("torque", word)
    assert said is not None and f"{bit} and above" in said
    assert signed == pytest.approx(load)
    assert with_sign("position", word)[1] is None


@pytest.mark.parametrize("offset", [0.0, 1024.0, 2000.0])
def test_other_whole_numbers_keep_their_values(offset):
    counts = np.rint(offset + 900.0 * TORQUE / np.abs(TORQUE).max())
    same, said = with_sign("torque", counts)
    assert said is None and same is counts


@pytest.mark.parametrize("name", ["pwm", "duty_cycle", "motor current", "counts", "Voltage"])
def test_a_name_that_is_no_torque_is_doubted_without_a_factor(tmp_path, name):
    record = imported(tmp_path, f"torque={name}", "position=y", **{name: TORQUE, "y": ANGLE})
    assert any("by its name it is not" in doubt for doubt in record.doubts)
    meant = imported(tmp_path, f"torque={name}:0.1", "position=y", **{name: TORQUE, "y": ANGLE})
    assert not any("by its name" in doubt for doubt in meant.doubts)


def test_one_cause_is_told_alone(tmp_path):
    columns = {"u": np.abs(TORQUE + NOISE), "y": ANGLE}
    record = imported(tmp_path, "torque=u", "position=y", **columns)
    assert len(record.doubts) == 1 and not any("drive is off" in note for note in record.notes)
