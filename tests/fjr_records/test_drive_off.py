"""A closed brake at the ends of a run: found where the axis takes a torque there, and left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_records.any_folder import open_folder
from fjr_records.drive_off import off_ends, without_off_ends
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet

RATE, REST, STD = 500.0, 600, 1e-5


def axis(
    weight: float = 14.0, braked: bool = True, noise: float = 0.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return torque and position of moves there and back, with 1.2 s of a closed brake around."""
    rng = np.random.default_rng(seed)
    samples = 4000
    y = 0.4 * (1.0 - np.cos(2 * np.pi * 1.0 * np.arange(samples) / RATE))
    v, a = np.gradient(y) * RATE, np.gradient(np.gradient(y)) * RATE**2
    u = weight + 0.3 * a + 3.0 * np.sign(v) + 0.05 * rng.standard_normal(samples)
    ends = 0.05 * rng.standard_normal((2, REST)) + (0.0 if braked else weight)
    y = np.concatenate([np.full(REST, y[0]), y, np.full(REST, y[-1])])
    return np.concatenate([ends[0], u, ends[1]]), y + noise * rng.standard_normal(y.size)


def record_set(*runs: tuple[np.ndarray, np.ndarray]) -> RecordSet:
    made = []
    for index, (u, y) in enumerate(runs):
        about = RecordDescription.of("test", sample_rate_hz=RATE, realization=index)
        made.append(Record(f"r{index}", about, None, u, y, None))
    return RecordSet("test", RATE, tuple(made))


@pytest.mark.parametrize("noise", [0.0, STD])
def test_a_closed_brake_is_found_at_both_ends(noise):
    off = off_ends(*axis(noise=noise), RATE)
    assert off is not None
    assert REST < off.begin < REST + 30 and REST < off.end < REST + 30
    assert 10.0 < off.takes < 20.0 and off.seen == pytest.approx(0.05, rel=0.2)
    assert "first 1.22 s and the last 1.2" in off.told(RATE)


def test_a_brake_at_one_end_is_found_there():
    u, y = axis()
    off = off_ends(u[REST:], y[REST:], RATE)
    assert off is not None and off.begin == 0 and off.end > REST


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_an_axis_that_takes_no_torque_rests_by_itself(weight):
    assert off_ends(*axis(weight), RATE) is None


def test_a_servo_at_rest_holds_its_weight():
    assert off_ends(*axis(braked=False), RATE) is None


def test_a_spin_one_way_needs_a_torque_for_friction_alone():
    u, y = axis(0.0)
    one_way = np.cumsum(np.abs(np.gradient(y)))
    assert off_ends(np.where(u == 0.0, 0.0, np.abs(u)) * (np.abs(u) > 1.0), one_way, RATE) is None


def test_nothing_is_off_without_any_torque_or_motion():
    time = np.arange(3000) / RATE
    swings = np.exp(-time) * np.cos(20.0 * time)
    assert off_ends(np.zeros(3000), swings, RATE) is None
    assert off_ends(np.ones(3000), np.zeros(3000), RATE) is None
    assert off_ends(np.ones(10), np.arange(10.0), RATE) is None


def test_off_ends_of_records_are_left_out_and_their_noise_is_kept():
    cut = without_off_ends(record_set(axis(noise=STD), axis(0.0, seed=1)))
    first, second = cut.records
    assert 3940 < first.samples < 4000 and second.samples == 4000 + 2 * REST
    assert first.torque.size == first.position.size
    assert len(cut.notes) == 1 and "r0: in the first 1.22 s" in cut.notes[0]
    noise = record_noise(replace(cut, records=(first,)))
    assert noise.source == "standstill" and noise.std_rad == pytest.approx(STD, rel=0.2)


def test_runs_that_repeat_each_other_are_cut_alike():
    runs = record_set(axis(), axis(seed=1)).records
    again = runs[1].description.model_copy(update={"repeat_of": 0})
    pair = (runs[0], replace(runs[1], description=again))
    cut = without_off_ends(RecordSet("test", RATE, pair))
    assert cut.repeats == ((0, 1),)


def test_periods_stay_whole():
    u, y = axis()
    periodic = Experiment.of(
        "test", sample_rate_hz=RATE, samples_per_period=1300, periods=3, transient_periods=1,
        amplitude_rad=0.1, excited_harmonics=[1, 3],
    )  # fmt: skip
    (whole,) = without_off_ends(
        RecordSet("test", RATE, (Record("r", periodic, None, u, y, None),))
    ).records
    assert whole.samples == y.size


def test_a_folder_of_records_is_opened_without_them(tmp_path):
    u, y = axis()
    about = RecordDescription.of("test", sample_rate_hz=RATE)
    with BagWriter(tmp_path / "rig" / "a", about) as bag:
        bag.write_arrays(r=y, u=u, y=y)
    opened = open_folder(tmp_path / "rig")
    assert opened.records[0].samples < 4000 and "the drive is off" in opened.notes[-1]


def test_import_says_where_the_drive_is_off(tmp_path):
    u, y = axis()
    np.savez(tmp_path / "a.npz", u=u, y=y)
    asked = ImportOptions(parse_map(["torque=u", "position=y"]), sample_rate_hz=RATE)
    (record,) = read_files([tmp_path / "a.npz"], asked).records
    assert record.samples == y.size
    assert any("the drive is off" in note for note in record.notes)
