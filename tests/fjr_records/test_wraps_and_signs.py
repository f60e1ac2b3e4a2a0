"""Angles that start anew after each turn, and torques that go the wrong way."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_records.driven import BRAKES, accelerates, drives, opposes, wrong_sign
from fjr_records.importers.wraps import without_wraps

TIME = np.arange(4000) / 500.0
TURNING = 9.0 * np.sin(0.8 * TIME) + 2.5 * TIME


@pytest.mark.parametrize("low", [0.0, -np.pi])
def test_turns_are_added_to_an_angle_that_starts_anew(low):
    wrapped = np.mod(TURNING - low, 2.0 * np.pi) + low
    found, notes = without_wraps({"position": wrapped, "torque": TURNING})
    offset = found["position"] - TURNING
    assert np.ptp(offset) < 1e-9 and found["torque"] is TURNING
    assert len(notes) == 1 and notes[0].startswith("position starts anew after each turn (")


def test_a_reference_is_turned_on_only_beside_a_position_that_wraps():
    steps = np.where(TIME % 2.0 < 1.0, 0.0, 2.0 * np.pi)
    found, notes = without_wraps({"position": 0.1 * TURNING, "reference": steps})
    assert found["reference"] is steps and not notes
    wrapped = np.mod(TURNING, 2.0 * np.pi)
    found, notes = without_wraps({"position": wrapped, "reference": wrapped + 0.0})
    assert np.abs(np.diff(found["reference"])).max() < 0.1 and len(notes) == 2


def test_a_position_that_jumps_otherwise_is_left_as_it_is():
    jumped = 0.01 * TURNING + np.where(TIME > 4.0, 5.0, 0.0)
    found, notes = without_wraps({"position": jumped})
    assert found["position"] is jumped and not notes


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
