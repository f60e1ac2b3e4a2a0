"""A closed brake in a run: found where the axis takes a torque at other times, and left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_records.any_folder import open_folder
from fjr_records.drive_off import off_times, spans_of, without_off_times
from fjr_records.encoder_step import position_step
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet

RATE, REST, STD = 500.0, 600, 1e-5
HOLD = 100


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
    off = off_times(*axis(noise=noise), RATE)
    assert off is not None
    assert REST < off.begin < REST + 30 and REST < off.end < REST + 30
    assert 10.0 < off.takes < 20.0 and off.seen == pytest.approx(0.05, rel=0.2)
    assert "first 1.22 s and the last 1.2" in off.told(RATE)


def test_a_brake_at_one_end_is_found_there():
    u, y = axis()
    off = off_times(u[REST:], y[REST:], RATE)
    assert off is not None and off.begin == 0 and off.end > REST


def twice(braked: bool = True, drift: float = 0.0, noise: float = 0.0) -> list[np.ndarray]:
    """Return torque and position of two such runs one after the other, a brake between them.

    The servo holds the weight for 0.2 s before and after that. The position goes on by a drift
    (rad) while the brake is closed.
    """
    (u, y), (u2, y2) = axis(braked=braked, noise=noise), axis(braked=braked, noise=noise, seed=1)
    hold, rest = np.full(HOLD, 14.0), np.zeros(HOLD)
    return [
        np.concatenate([u[:-REST], hold, u[-REST:], u2[:REST], hold, u2[REST:]]),
        np.concatenate(
            [y[:-REST], rest, y[-REST:], y2[:REST] + drift, rest + drift, y2[REST:] + drift]
        ),
    ]


@pytest.mark.parametrize("noise", [0.0, STD])
def test_a_brake_that_closes_in_mid_run_is_found(noise):
    off = off_times(*twice(noise=noise), RATE)
    assert off is not None
    first, middle, last = spans_of(off.at)
    assert 4600 < middle.start <= 4700 and 5900 <= middle.stop < 6000
    assert first.start == 0 and last.stop == off.at.size
    told = off.told(RATE)
    assert "the first 1.22 s, the last 1.22 s and 2.45 s between (once; from 9.38 s on)" in told


def test_a_peak_of_torque_does_not_part_the_time_of_a_brake():
    u, y = twice()
    u[5300:5302] = 5.0
    whole, parted = off_times(*twice(), RATE), off_times(u, y, RATE)
    assert whole is not None and parted is not None
    assert np.array_equal(whole.at, parted.at)


def test_a_servo_at_rest_in_mid_run_holds_its_weight():
    assert off_times(*twice(braked=False), RATE) is None


@pytest.mark.parametrize("drift", [0.0, 8e-4])
def test_what_is_left_beside_a_brake_in_mid_run_is_joined(drift):
    u, y = twice(drift=drift)
    cut = without_off_times(record_set((u, y))).records[0]
    assert 8100 < cut.samples < 8200 and len(cut.held) == 3
    assert np.abs(np.diff(cut.position)).max() <= np.abs(np.diff(axis()[1])).max()
    middle = slice(cut.samples // 2 - 20, cut.samples // 2 + 20)
    assert np.abs(np.diff(cut.position[middle])).max() < 1e-9
    assert cut.torque[middle].min() > 9.0


def test_what_is_joined_keeps_the_steps_of_its_encoder():
    u, y = twice(drift=7e-4)
    step = 1e-4
    cut = without_off_times(record_set((u, step * np.rint(y / step)))).records[0]
    assert position_step([cut.position]) == pytest.approx(step)


@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_an_axis_that_takes_no_torque_rests_by_itself(weight):
    assert off_times(*axis(weight), RATE) is None


def test_a_servo_at_rest_holds_its_weight():
    assert off_times(*axis(braked=False), RATE) is None


def test_a_spin_one_way_needs_a_torque_for_friction_alone():
    u, y = axis(0.0)
    one_way = np.cumsum(np.abs(np.gradient(y)))
    assert off_times(np.where(u == 0.0, 0.0, np.abs(u)) * (np.abs(u) > 1.0), one_way, RATE) is None


def test_nothing_is_off_without_any_torque_or_motion():
    time = np.arange(3000) / RATE
    swings = np.exp(-time) * np.cos(20.0 * time)
    assert off_times(np.zeros(3000), swings, RATE) is None
    assert off_times(np.ones(3000), np.zeros(3000), RATE) is None
    assert off_times(np.ones(10), np.arange(10.0), RATE) is None


def test_off_ends_of_records_are_left_out_and_their_noise_is_kept():
    cut = without_off_times(record_set(axis(noise=STD), axis(0.0, seed=1)))
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
    cut = without_off_times(RecordSet("test", RATE, pair))
    assert cut.repeats == ((0, 1),)
    longer = [
        replace(r, torque=np.tile(r.torque, 2), position=np.tile(r.position, 2)) for r in pair
    ]
    cut = without_off_times(RecordSet("test", RATE, tuple(longer)))
    assert cut.repeats == ((0, 1),) and cut.records[0].samples < 8000


def test_periods_stay_whole():
    u, y = axis()
    periodic = Experiment.of(
        "test", sample_rate_hz=RATE, samples_per_period=1300, periods=3, transient_periods=1,
        amplitude_rad=0.1, excited_harmonics=[1, 3],
    )  # fmt: skip
    (whole,) = without_off_times(
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
