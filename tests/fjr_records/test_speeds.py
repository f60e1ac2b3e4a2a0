"""Speeds in place of angles: their integrals, what a record of them is, and their noise."""

import numpy as np
import pytest

from fjr_interface.bags.reader import SPEED
from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet, read_records
from gap_diagnosis.model.lapped import lapped

RATE, SECONDS = 500.0, 20
TIME = np.arange(int(RATE * SECONDS)) / RATE


def angle(at_hz: float = 0.7, amplitude: float = 3.0) -> np.ndarray:
    return amplitude * (1.0 - np.cos(2.0 * np.pi * at_hz * TIME))


def speed(at_hz: float = 0.7, amplitude: float = 3.0) -> np.ndarray:
    return amplitude * 2.0 * np.pi * at_hz * np.sin(2.0 * np.pi * at_hz * TIME)


def imported(folder, maps: list[str], **columns: np.ndarray) -> RecordSet:
    file = folder / "run.csv"
    table = np.column_stack([TIME, *columns.values()])
    header = ",".join(["t", *columns])
    np.savetxt(file, table, fmt="%.12g", delimiter=",", header=header, comments="")
    import_files([file], folder / "bags", ImportOptions(parse_map(["time=t", *maps])))
    return read_records(folder / "bags")


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("rad/s", 1.0),
        ("deg/s", np.pi / 180.0),
        ("rpm", 2.0 * np.pi / 60.0),
        ("rev/s", 2.0 * np.pi),
    ],
)
def test_the_integral_of_a_speed_is_the_angle_from_its_first_sample(tmp_path, unit, factor):
    found = imported(
        tmp_path, [f"position=w:{unit}", "torque=u"], w=speed() / factor, u=np.cos(TIME)
    )
    # Error of the trapezoidal rule: h^2/12 times the greatest change of the acceleration.
    bound = (2.0 * np.pi * 0.7 / RATE) ** 2 / 12.0 * 6.0
    assert np.abs(found.records[0].position - angle()).max() < 1.01 * bound
    assert found.records[0].description.integrated and SPEED in found.notes


def test_a_speed_beyond_half_a_turn_per_second_is_not_unwrapped(tmp_path):
    jumps = np.where(np.sin(TIME) > 0.0, 8.0, -8.0)  # jumps by more than pi, as a wrapped angle
    found = imported(tmp_path, ["position=w:rad/s", "torque=u"], w=jumps, u=np.cos(TIME))
    steps = np.diff(found.records[0].position)
    assert np.abs(steps).max() == pytest.approx(8.0 / RATE)


def test_integrals_begin_at_the_angle_that_was_recorded(tmp_path):
    y = angle()
    reference = imported(
        tmp_path, ["position=y", "torque=u", "reference=r:rad/s"], y=y + 1.5, u=np.cos(TIME),
        r=speed(),
    ).records[0].reference  # fmt: skip
    assert reference is not None and reference[0] == pytest.approx(1.5)
    assert np.abs(reference - 1.5 - y).max() < 1e-3


def test_both_are_linear_speeds_or_both_turn(tmp_path):
    found = imported(tmp_path, ["position=w:mm/s", "torque=u:N"], w=1e3 * speed(), u=np.cos(TIME))
    assert found.records[0].description.linear
    assert np.abs(found.records[0].position - angle()).max() < 1e-3
    with pytest.raises(InputError, match="position in rpm, as of a rotary one"):
        parse_map(["position=w:rpm", "torque=u:N"])


def test_what_repeats_is_a_record_too_for_its_integral_drifts(tmp_path):
    period = np.tile(np.random.default_rng(0).standard_normal(1000), 10)
    columns = {"w": period + 0.1, "u": period, "r": period}
    maps = ["position=w:rad/s", "torque=u", "reference=r:rad/s"]
    found = imported(tmp_path, maps, **columns)
    assert isinstance(found.records[0].description, RecordDescription)
    with pytest.raises(InputError, match="the integral of a speed, which drifts; leave out"):
        import_files(
            [tmp_path / "run.csv"], tmp_path / "other",
            ImportOptions(parse_map(["time=t", *maps]), samples_per_period=1000),
        )  # fmt: skip


def integrated(noise: np.ndarray, motion: np.ndarray | None = None) -> RecordSet:
    """Return the record of the integral of noisy speeds, (samples,)."""
    speeds = noise + (speed() if motion is None else motion)
    steps = 0.5 * (speeds[1:] + speeds[:-1]) / RATE
    position = np.concatenate([[0.0], np.cumsum(steps)])
    description = RecordDescription.of("test", sample_rate_hz=RATE, position_from="speed")
    return RecordSet(
        "test", RATE, (Record("r", description, None, 0.0 * position, position, None),)
    )


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_a_speed_walks_and_its_lines_have_the_power_that_is_said(seed):
    rng = np.random.default_rng(seed)
    noise = 0.2 * rng.standard_normal(TIME.size)
    found = record_noise(integrated(noise))
    assert found.walks and found.std_rad == pytest.approx(0.2 / RATE, rel=0.1)
    alone = integrated(noise, 0.0 * TIME).records[0].position
    hop = 400
    lines = lapped(alone - alone.mean(), hop)[:, 4:360]  # below, a window holds half a cycle
    power = found.power(0.5 * (np.arange(4, 360) + 0.5) / hop)
    bands = np.array_split(np.mean(lines**2, axis=0) / power, 8)
    # 23 windows of 44 lines: a mean of squares is 1 within 4.4 % (1 sigma); 10 % of the noise.
    assert all(0.7 < band.mean() < 1.35 for band in bands)


def test_a_speed_that_differs_encoder_counts_integrates_to_the_encoder(tmp_path):
    counts = 2.0 * np.pi / 4096.0
    encoder = np.round((angle() + 0.4 * TIME) / counts) * counts
    steps = np.diff(encoder, prepend=encoder[0])
    position = np.cumsum(0.5 * (steps + np.concatenate([[0.0], steps[:-1]])))
    description = RecordDescription.of("test", sample_rate_hz=RATE, position_from="speed")
    made = Record("r", description, None, 0.0 * position, position, None)
    found = record_noise(RecordSet("test", RATE, (made,)))
    assert not found.walks and found.known
    assert found.std_rad < counts
