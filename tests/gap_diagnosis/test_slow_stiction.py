"""Slow valves that stick, at random: their friction is named with its size, by torque alone.

The axis is one of an integrator of its own, not that of the simulator: bristles of LuGre (Canudas
de Wit 1995) with a breakaway above Coulomb friction, a ripple over the angle, and a loop that holds
each place by its integral. So the axis goes back a little at each rest, and its friction is then at
no level.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_kit.compiled import jit
from fjr_records.records import Record, RecordSet
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.sliding import sliding, yields_over
from gap_diagnosis.outcome.diagnosis import Diagnosis

CONTROL_HZ, EVERY, INNER = 1000.0, 20, 50
SECONDS, RUNS = 60.0, 3
INERTIA = 0.08
LOOKED_FOR = ("coulomb_friction", "viscous_friction", "stribeck_friction_motor", "load_friction",
              "cogging", "gravity", "torque_bias")  # fmt: skip
BARE = datasheet({"jm": 1.1 * INERTIA}, "valve")


@dataclass(frozen=True)
class Valve:
    """A valve, its sizes in SI units.

    Attributes:
        coulomb, breakaway: levels of friction while it slides and where it breaks away, N m.
        stribeck_rad_s: speed at which the second goes over into the first.
        yields_rad: way over which the bristles bend before they slip.
        viscous: N m s/rad.
        ripple: over the angle, twice a turn, N m.
    """

    coulomb: float
    breakaway: float
    stribeck_rad_s: float
    yields_rad: float
    viscous: float
    ripple: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> Valve:
        coulomb = rng.uniform(3.0, 9.0)
        return Valve(
            coulomb, coulomb * rng.uniform(1.4, 2.0), rng.uniform(0.02, 0.04),
            10.0 ** rng.uniform(-3.0, -2.5), coulomb * rng.uniform(0.3, 0.6),
            coulomb * rng.uniform(0.0, 0.25),
        )  # fmt: skip


@jit
def moved(reference, valve, step, inner, torque, position):
    """Set the torque (N m) and the position (rad) of a valve behind P-PI, at each sample."""
    coulomb, breakaway, stribeck, stiffness, viscous, ripple = valve
    q, v, z, pushed, summed, before, slow = reference[0], 0.0, 0.0, 0.0, 0.0, reference[0], 0.0
    fine = step / inner
    for k in range(reference.size):
        seen = np.round(q / 3e-4) * 3e-4
        slow += 0.18 * ((seen - before) / step - slow)
        before = seen
        error = 4.0 * (reference[k] - seen) - slow
        summed += error * step
        asked = min(max(12.0 * (error + 3.0 * summed), -40.0), 40.0)
        position[k], torque[k] = seen, pushed
        for _ in range(inner):
            pushed += fine / 3e-3 * (asked - pushed)
            level = coulomb + (breakaway - coulomb) * np.exp(-((v / stribeck) ** 2))
            bent = v - stiffness * abs(v) / level * z
            z += fine * bent
            friction = stiffness * z + 20.0 * bent + viscous * v
            v += fine / 0.08 * (pushed + ripple * np.sin(2.0 * q + 0.3) - friction)
            q += fine * v


def places(rng: np.random.Generator) -> np.ndarray:
    """Return a reference that goes from place to place at half a radian per second and rests."""
    kept, samples = [np.full(2000, 0.2)], int(SECONDS * CONTROL_HZ)
    while sum(map(len, kept)) < samples:
        kept.append(np.full(int(rng.uniform(2.0, 5.0) * CONTROL_HZ), rng.uniform(0.1, 1.4)))
    asked = np.concatenate(kept)[:samples]
    most = 0.5 / CONTROL_HZ
    for k in range(1, samples):
        asked[k] = asked[k - 1] + np.clip(asked[k] - asked[k - 1], -most, most)
    return asked


def recorded(valve: Valve, rng: np.random.Generator) -> RecordSet:
    """Return runs of a valve whose friction differs by a few percent from run to run."""
    runs = []
    for number in range(RUNS):
        times = 1.0 + 0.03 * rng.standard_normal()
        sizes = (
            times * valve.coulomb, times * valve.breakaway, valve.stribeck_rad_s,
            valve.coulomb / valve.yields_rad, times * valve.viscous, valve.ripple,
        )  # fmt: skip
        reference = places(rng)
        torque, position = np.zeros(reference.size), np.zeros(reference.size)
        moved(reference, sizes, 1.0 / CONTROL_HZ, INNER, torque, position)
        described = RecordDescription.of(
            "valve", sample_rate_hz=CONTROL_HZ / EVERY, level=0, levels=1, realization=number,
            realizations=RUNS,
        )  # fmt: skip
        kept = slice(0, None, EVERY)
        seen = np.round(torque[kept], 1)
        runs.append(Record(f"run_{number}", described, None, seen, position[kept], None))
    return RecordSet("valve", CONTROL_HZ / EVERY, tuple(runs))


def named(valve: Valve, rng: np.random.Generator) -> Diagnosis:
    return investigate(recorded(valve, rng), BARE, effects=LOOKED_FOR).diagnosis


@pytest.mark.parametrize("seed", range(6))
def test_friction_of_a_valve_that_sticks_is_named_with_its_size(seed):
    rng = np.random.default_rng(seed)
    valve = Valve.drawn(rng)
    found = named(valve, rng)
    assert found.compared == "torque" and found.gap_closed > 0.98
    level = found.parameters["coulomb_friction.motor_nm"]
    assert level.low < valve.coulomb < level.high
    assert level.value == pytest.approx(valve.coulomb, rel=0.07)
    slope = found.parameters["viscous_friction.motor_nm_s_rad"]
    assert slope.low < valve.viscous < slope.high


@pytest.mark.parametrize("seed", range(3))
def test_so_is_that_of_one_whose_packing_yields_over_some_stations(seed):
    rng = np.random.default_rng(seed)
    drawn = Valve.drawn(rng)
    valve = replace(drawn, yields_rad=8.0 * drawn.yields_rad)
    level = named(valve, rng).parameters["coulomb_friction.motor_nm"]
    assert level.low < valve.coulomb < level.high


def test_what_goes_back_a_little_has_no_direction_and_what_stops_keeps_its_own():
    ways = np.array([0.0, 5.0, 0.0, -0.4, 0.0, 0.3, 0.0, 4.0, 0.0, -0.5, -0.6, -3.0])
    assert np.array_equal(sliding(ways, 1.0), [0, 1, 1, 0, 0, 0, 0, 1, 1, 0, -1, -1])


def turning(z: float, viscous: float, rng: np.random.Generator) -> list[tuple[np.ndarray, ...]]:
    """Return runs of stations that turn round, over a gravity much greater than the friction.

    Args:
        z: the way over which friction of 1 yields, in stations; 0 for none.
        viscous: friction at the speed of 1 that is reached after some twenty stations.
        rng: of the ways, the speeds and the noise.
    """
    runs = []
    for _ in range(2):
        place, parts = 0.0, []
        for turn in range(12):
            way, gone = (-1.0) ** turn, np.arange(1, rng.integers(15, 60)) + 0.5
            speed = rng.uniform(0.5, 1.5) * np.minimum(np.sqrt(gone / 20.0), 1.0)
            level = 1.0 - 2.0 * np.exp(-gone / z) * (turn > 0) if z else 1.0
            torque = way * (level + viscous * speed) + 10.0 * np.sin(0.05 * (place + way * gone))
            torque += 0.03 * rng.standard_normal(gone.size)
            parts.append((torque, way * speed, np.full(gone.size, way)))
            place += way * (gone[-1] + 0.5)
        runs.append(tuple(np.concatenate(each) for each in zip(*parts, strict=True)))
    return runs


@pytest.mark.parametrize("viscous", [0.0, 0.3, 3.0])
def test_the_way_over_which_friction_yields_is_seen_past_gravity(viscous):
    rng = np.random.default_rng(5)
    assert yields_over(turning(0.0, viscous, rng)) == 0.0
    for z in rng.uniform(1.5, 8.0, 5):
        assert yields_over(turning(z, viscous, rng)) == pytest.approx(4.0 * z, rel=0.25)
