"""Noise of records: from repeats, standstill or the highest lines; and when nothing shows it."""

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from fjr_interface.experiment import Experiment, RecordDescription
from fjr_records.record_noise import band_lines, record_noise
from fjr_records.records import Record, RecordSet

RATE, STD = 500.0, 2e-5


def smooth(rng: np.random.Generator, samples: int) -> np.ndarray:
    low = butter(4, 5.0, fs=RATE, output="sos")
    motion = sosfilt(low, rng.standard_normal(samples))
    return 0.01 * motion / motion.std()


def records(*positions: np.ndarray, references: list[np.ndarray] | None = None) -> RecordSet:
    made = []
    for index, position in enumerate(positions):
        reference = None if references is None else references[index]
        description = RecordDescription.of("test", sample_rate_hz=RATE, realization=index)
        made.append(Record(f"r{index}", description, reference, position * 0, position, None))
    return RecordSet("test", RATE, tuple(made))


@pytest.mark.parametrize("seed", range(5))
def test_the_highest_lines_show_white_noise(seed):
    rng = np.random.default_rng(seed)
    position = smooth(rng, 8000) + STD * rng.standard_normal(8000)
    found = record_noise(records(position))
    assert found.source == "residual" and found.std_rad == pytest.approx(STD, rel=0.15)


def test_repeats_show_noise_whatever_the_motion():
    rng = np.random.default_rng(0)
    motion = 1e-3 * rng.standard_normal(8000)  # as white as noise
    runs = [motion + STD * rng.standard_normal(8000) for _ in range(2)]
    found = record_noise(records(*runs, references=[motion, motion]))
    assert found.source == "repeats" and found.std_rad == pytest.approx(STD, rel=0.15)


def test_periods_show_noise_whatever_the_motion():
    rng = np.random.default_rng(1)
    period, length, count = 1e-3 * rng.standard_normal(2000), 2000, 4
    experiment = Experiment.of(
        "test", sample_rate_hz=RATE, samples_per_period=length, periods=count - 1,
        transient_periods=1, amplitude_rad=1e-3, excited_harmonics=[1, 3],
    )  # fmt: skip
    position = np.tile(period, count) + STD * rng.standard_normal(count * length)
    position[:length] *= 0.5  # the transient differs, and says nothing
    whole = np.append(position, 0.0)  # and so does what is no whole period
    found = record_noise(
        RecordSet("test", RATE, (Record("r", experiment, None, whole * 0, whole, None),))
    )
    assert found.source == "repeats" and found.std_rad == pytest.approx(STD, rel=0.15)


def test_a_standstill_shows_noise():
    rng = np.random.default_rng(3)
    moving = np.cumsum(smooth(rng, 3000))
    still = np.full(1500, moving[-1])
    position = np.concatenate([moving, still]) + STD * rng.standard_normal(4500)
    found = record_noise(records(position))
    assert found.source == "standstill" and found.std_rad == pytest.approx(STD, rel=0.2)


def test_a_motion_that_settles_does_not_stand_still():
    """An axis creeps to its place after each move, by less than a thousandth of what it moved."""
    rng = np.random.default_rng(7)
    time = np.arange(2000) / RATE
    settling = 5e-3 * np.exp(-time / 0.4)
    moves = [np.cumsum(smooth(rng, 500)) for _ in range(3)]
    position = np.concatenate([np.append(move, move[-1] + settling) for move in moves])
    position += STD * rng.standard_normal(position.size)
    found = record_noise(records(position))
    assert found.source == "standstill" and found.std_rad == pytest.approx(STD, rel=0.2)


def test_an_axis_that_starts_does_not_stand_beside_many_turns():
    """Within a thousandth of the way it has yet to go, it swings into motion."""
    rng = np.random.default_rng(8)
    time = np.arange(8000) / RATE
    turning = 5.0 * np.maximum(time - 0.5, 0.0)
    starting = 0.02 * np.sin(2.0 * np.pi * 3.0 * time) * (time < 1.0)
    position = turning + starting + STD * rng.standard_normal(time.size)
    found = record_noise(records(position))
    assert found.source == "residual" and found.std_rad == pytest.approx(STD, rel=0.2)


def test_a_standstill_whose_noise_is_not_white_counts_where_no_lines_are_flat():
    rng = np.random.default_rng(9)
    low = butter(4, 20.0, fs=RATE, output="sos")
    slow = sosfilt(low, rng.standard_normal(4500))
    moving = np.cumsum(smooth(rng, 3000))
    still = np.full(1500, moving[-1])
    position = np.concatenate([moving, still]) + STD * slow / slow.std()
    found = record_noise(records(position))
    assert found.source == "standstill" and 0.4 * STD < found.std_rad < STD


@pytest.mark.parametrize("zero", [0.0, 0.12345678])
def test_an_encoder_that_stands_still_on_one_count_is_not_without_noise(zero):
    """It rounds: a variance of step^2/12, whatever the standstill or repeats show."""
    step = 1e-4
    moving = np.cumsum(smooth(np.random.default_rng(3), 3000))
    whole = np.concatenate([moving, np.full(1500, moving[-1])])
    position = np.round(whole / step) * step + zero
    again = [whole, whole]
    for references in (None, again):
        found = record_noise(records(position, position, references=references))
        assert found.step_rad == pytest.approx(step)
        assert found.known and 0.9 < found.std_rad * np.sqrt(12.0) / step < 1.6


def test_noise_above_the_step_counts_as_it_is():
    rng = np.random.default_rng(6)
    position = smooth(rng, 8000) + STD * rng.standard_normal(8000)
    found = record_noise(records(np.round(position / 1e-6) * 1e-6))
    assert found.std_rad == pytest.approx(STD, rel=0.15)


def test_a_motion_up_to_the_highest_lines_shows_no_noise():
    rng = np.random.default_rng(4)
    falling = sosfilt(butter(1, 2.0, fs=RATE, output="sos"), rng.standard_normal(8000))
    found = record_noise(records(np.diff(falling, prepend=0.0, n=1) + falling))
    assert not found.known and np.isnan(found.std_rad)


def test_the_band_ends_where_noise_begins():
    rng = np.random.default_rng(5)
    power = np.concatenate([np.full(40, 100.0), np.full(60, 1.0)]) * rng.uniform(0.8, 1.2, 100)
    assert 38 <= band_lines(power, 1.0) <= 44
    assert band_lines(power, 1e9) == 8
