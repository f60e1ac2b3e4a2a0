"""Angles that start anew after each turn, and torques that go the wrong way."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fjr_kit.errors import InputError
from fjr_records.driven import BRAKES, accelerates, drives, opposes, wrong_sign
from fjr_records.importers.import_map import Column, parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.importers.wraps import without_wraps

TIME = np.arange(4000) / 500.0
TURNING = 9.0 * np.sin(0.8 * TIME) + 2.5 * TIME
TURN = 2.0 * np.pi


def turned(
    values: dict[str, np.ndarray], unit: str = "rad"
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return signals in SI with turns, and the notes; the columns have a unit, or are counts."""
    columns = {q: Column.parse(q, f"c:{unit}") for q in values if q != "torque"}
    return without_wraps(Path("log.csv"), values, columns)


def wrapped(angle: np.ndarray, low: float = -np.pi) -> np.ndarray:
    return np.mod(angle - low, TURN) + low


def smooth(rng: np.random.Generator, largest: float) -> np.ndarray:
    """Return a random smooth motion, float64 (samples,) in rad, with steps up to the largest."""
    time = np.arange(rng.integers(500, 3000)) * rng.choice([0.001, 0.01, 0.025])
    tones = rng.uniform(0.1, 1.0, (8, 1))
    y = (rng.standard_normal((8, 1)) / tones * np.sin(TURN * tones * time)).sum(0) + time
    return y * largest / np.abs(np.diff(y)).max() + rng.uniform(-np.pi, np.pi)


@pytest.mark.parametrize("low", [0.0, -np.pi])
def test_turns_are_added_to_an_angle_that_starts_anew(low):
    found, notes = turned({"position": wrapped(TURNING, low), "torque": TURNING})
    offset = found["position"] - TURNING
    assert np.ptp(offset) < 1e-9 and found["torque"] is TURNING
    assert len(notes) == 1 and notes[0].startswith("position starts anew after each turn (")


@pytest.mark.parametrize("unit", ["rad", "deg", "rev", f"{TURN / 4096}"])
@pytest.mark.parametrize("largest", [0.1, 1.0, 2.0, 2.8])
def test_turns_are_added_however_large_the_steps_are(largest, unit):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        y, low = smooth(rng, largest), rng.choice([0.0, -np.pi])
        counts = np.rint(wrapped(y, low) * 4096 / TURN) * TURN / 4096
        noisy = wrapped(y + 1e-3 * rng.standard_normal(y.size), low)
        for angle in (wrapped(y, low), counts, noisy):
            found, notes = turned({"position": angle}, unit)
            assert np.ptp(found["position"] - y) < 0.02
            assert bool(notes) == bool(np.abs(np.diff(angle)).max() > np.pi)


def test_a_turn_is_added_where_samples_were_lost_at_a_jump():
    y = np.delete(TURNING, np.flatnonzero(np.diff(np.floor(TURNING / TURN)))[:1] + 1)
    found, notes = turned({"position": wrapped(y, 0.0)})
    assert notes and np.ptp(found["position"] - y) < 1e-9


@pytest.mark.parametrize("seed", range(40))
def test_turns_are_not_added_to_what_does_not_wrap(seed):
    rng = np.random.default_rng(seed)
    y = smooth(rng, rng.choice([0.02, 0.1, 0.3]))
    stops = np.repeat(rng.integers(0, 2, 100), rng.integers(3, 40, 100)) * rng.uniform(3.2, 20.0)
    runs = [each - each[0] for each in (smooth(rng, 0.1), smooth(rng, 0.05), smooth(rng, 0.2))]
    reset = y - y[0]
    at = rng.integers(50, reset.size - 50)
    reset[at:] -= reset[at]
    for angle in (y, stops, np.concatenate(runs), reset):
        try:
            found, notes = turned({"position": angle})
        except InputError:
            assert 0.9 * TURN <= np.ptp(angle) <= 1.1 * TURN  # it may wrap, but not surely
            continue
        assert found["position"] is angle and not notes


def test_a_linear_axis_and_a_speed_do_not_wrap():
    angle = wrapped(TURNING)
    for unit in ("mm", "rpm"):
        found, notes = turned({"position": angle}, unit)
        assert found["position"] is angle and not notes


@pytest.mark.parametrize(
    ("unit", "low", "edges"),
    [("deg", -np.pi, "±180 deg"), ("rad", 0.0, "0 and 6.283 rad"), ("0.001", -np.pi, "±3142")],
)
def test_an_angle_that_seems_to_wrap_is_refused(unit, low, edges):
    too_fast = wrapped(40.0 * TURNING[::10], low)
    between = np.interp(np.arange(0.0, 3999.0, 0.7), np.arange(4000), wrapped(TURNING, low))
    smoothed = np.convolve(
        wrapped(TURNING, low), np.ones(3) / 3.0, "valid"
    )  # no jump of half a turn
    for angle in (too_fast, between, smoothed):
        with pytest.raises(InputError, match=re.escape(f"position seems to wrap at {edges}, but")):
            turned({"position": angle}, unit)


def test_a_reference_is_turned_on_only_beside_a_position_that_wraps():
    steps = np.where(TIME % 2.0 < 1.0, 0.0, 2.0 * np.pi)
    found, notes = turned({"position": 0.1 * TURNING, "reference": steps})
    assert found["reference"] is steps and not notes
    angle = wrapped(TURNING, 0.0)
    found, notes = turned({"position": angle, "reference": angle + 0.0})
    assert np.abs(np.diff(found["reference"])).max() < 0.1 and len(notes) == 2


def test_a_reference_of_steps_takes_the_turn_next_to_the_position():
    reference = TURNING + 0.5 * np.sign(np.sin(9.0 * TIME))
    found, notes = turned({"position": wrapped(TURNING), "reference": wrapped(reference)})
    assert len(notes) == 2
    assert np.abs(found["reference"] - found["position"]).max() == pytest.approx(0.5)


def test_a_position_that_jumps_otherwise_is_left_as_it_is():
    jumped = 0.01 * TURNING + np.where(TIME > 4.0, 5.0, 0.0)
    found, notes = turned({"position": jumped})
    assert found["position"] is jumped and not notes


def test_a_fast_disc_with_jittered_stamps_is_imported(tmp_path):
    rng = np.random.default_rng(0)
    stamps = np.arange(1200) / 40.0
    y = 20.0 * np.sin(1.5 * stamps) + 5.0 * np.sin(4.0 * stamps)
    jittered = stamps + 2e-4 * rng.standard_normal(stamps.size)
    np.savez(tmp_path / "a.npz", t=jittered, y=wrapped(y), u=np.gradient(np.gradient(y)))
    asked = ImportOptions(parse_map(["position=y", "torque=u", "time=t"]))
    (record,) = read_files([tmp_path / "a.npz"], asked).records
    assert np.ptp(record.signals["y"]) == pytest.approx(np.ptp(y), rel=0.01)
    assert any("turns were added" in note for note in record.notes) and not record.doubts


@pytest.mark.parametrize("seed", range(5))
def test_a_motor_that_moves_a_mass_with_friction_does_positive_work(seed):
    rng = np.random.default_rng(seed)
    coulomb, viscous, mass = rng.uniform(0.01, 1.0, 3)
    velocity = np.cumsum(rng.standard_normal(4000)) * 1e-2
    velocity -= np.linspace(velocity[0], velocity[-1], velocity.size)
    torque = mass * np.gradient(velocity, TIME) + coulomb * np.sign(velocity) + viscous * velocity
    position = np.cumsum(velocity) / 500.0
    assert drives(torque, position) > 0.0 and wrong_sign(torque, position) is None
    said = wrong_sign(-torque, position)
    if drives(torque, position) > -BRAKES:
        assert said is not None and "wrong sign" in said
    assert drives(1e300 * torque, 1e-300 * position) == pytest.approx(drives(torque, position))


def test_what_does_not_move_says_nothing():
    assert drives(np.zeros(50), np.ones(50)) == 0.0
    assert wrong_sign(np.ones(50), np.zeros(50)) is None


def moved(seed: int, mass: float, stiffness: float, coulomb: float) -> tuple[np.ndarray, ...]:
    """Return torque and position of a random motion of a mass on a spring, with friction."""
    rng = np.random.default_rng(seed)
    tones = rng.uniform(0.2, 4.0, 12)
    phases = 2.0 * np.pi * np.outer(tones, TIME) + rng.uniform(0.0, 6.0, (12, 1))
    y, v, a = np.sin(phases), np.cos(phases), -np.sin(phases)
    y, v, a = (
        (x * (2.0 * np.pi * tones[:, None]) ** n / tones[:, None] ** 2).sum(0)
        for n, x in enumerate((y, v, a))
    )
    torque = mass * a + stiffness * y + coulomb * np.sign(v)
    return torque / np.std(torque), y


@pytest.mark.parametrize("seed", range(5))
def test_a_torque_of_the_wrong_sign_is_seen_where_a_mass_hides_what_it_brakes(seed):
    torque, position = moved(seed, mass=1.0, stiffness=0.0, coulomb=0.5)
    assert abs(drives(torque, position)) < -BRAKES < accelerates(torque, position)
    assert wrong_sign(torque, position) is None
    for u, y in ((-torque, position), (torque, -position)):
        assert "as if it moved a negative mass" in (wrong_sign(u, y) or "")


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("mass", "stiffness", "coulomb"), [(0.0, 90.0, 1.0), (1.0, 90.0, 2.0)])
def test_a_spring_is_no_negative_mass(seed, mass, stiffness, coulomb):
    assert wrong_sign(*moved(seed, mass, stiffness, coulomb)) is None


def test_a_reference_that_the_position_mirrors_is_told():
    _, r = moved(0, 1.0, 0.0, 0.0)
    late = np.roll(r, 5)
    assert opposes(r, late) is None and opposes(r, 0.1 * r) is None
    assert "the wrong sign" in (opposes(r, -late) or "")
    assert opposes(r, -0.01 * late) is None  # a reference that is none of an angle
    assert opposes(r, np.zeros(r.size)) is None
