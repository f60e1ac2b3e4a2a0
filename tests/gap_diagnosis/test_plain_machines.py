"""Machines whose datasheet is an inertia alone: let go, held at speeds, under the load of a fan.

Each is integrated here, by laws of its own, and comes in as CSV.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.outcome.verdict_words import SWINGS_FREE

BRISTLE_RAD = 2e-3


def moved(torque, rate_hz, substeps, inertia, lost, load=None, angle=0.0) -> np.ndarray:
    """Return angle and speed; `lost` is the level of friction at a speed, `load` against an angle.

    Args:
        torque: its value by sample number, angle and speed.
    """
    h, speed, bristle, rows = 1.0 / (rate_hz * substeps), 0.0, 0.0, []
    for number in range(torque.samples):
        rows.append((angle, speed))
        drives = torque(number, speed)
        for _ in range(substeps):
            end = math.copysign(BRISTLE_RAD, speed)
            bristle = end + (bristle - end) * math.exp(-abs(speed) * h / BRISTLE_RAD)
            dry, wet = lost(speed)
            against = dry * bristle / BRISTLE_RAD + wet + (load(angle) if load else 0.0)
            speed += h * (drives - against) / inertia
            angle += h * speed
    return np.array(rows).T


class Given:
    """A torque that was chosen beforehand."""

    def __init__(self, values: np.ndarray) -> None:
        self.values, self.samples = values, values.size

    def __call__(self, number: int, _: float) -> float:
        return float(self.values[number])


class Speeds:
    """A proportional and integral loop around wanted speeds; `values` are its torques."""

    def __init__(self, wanted: np.ndarray, gain: float, integral: float) -> None:
        self.wanted, self.gain, self.integral = wanted, gain, integral
        self.samples, self.values, self.sum = wanted.size, np.zeros(wanted.size), 0.0

    def __call__(self, number: int, speed: float) -> float:
        error = float(self.wanted[number]) - speed
        self.sum += self.integral * error
        self.values[number] = self.gain * error + self.sum
        return float(self.values[number])


def told(folder: Path, runs, rate_hz: float, jm: float, unit: str = "1", effects=None) -> Diagnosis:
    files = []
    for number, (torque, position) in enumerate(runs):
        files.append(folder / f"run_{number}.csv")
        table = np.column_stack([np.arange(torque.size) / rate_hz, position, torque])
        np.savetxt(files[-1], table, fmt="%.9g", delimiter=",", header="t,q,tau", comments="")
    free = not any(torque.any() for torque, _ in runs)
    maps = ["time=t", f"position=q:{unit}", *([] if free else ["torque=tau:1"])]
    options = ImportOptions(parse_map(maps, swings_free=free), swings_free=free)
    import_files(files, folder / "bags", options)
    return diagnose(folder / "bags", {"jm": jm, "k0": math.inf}, effects=effects)


def assert_sizes(found: Diagnosis, truth: dict[str, float], within: float) -> None:
    named = {effect for cause in found.causes for effect in (cause.effect, *cause.others)}
    assert {name.split(".")[0] for name in truth} <= named
    assert set(found.effects) <= {name.split(".")[0] for name in truth} | {"presliding_friction"}
    for name, size in truth.items():
        assert found.parameters[name].value == pytest.approx(size, rel=within), name


def test_a_pendulum_that_is_let_go_shows_all_sizes_over_its_inertia(tmp_path):
    rate, rng, runs = 200.0, np.random.default_rng(7), []
    for angle in (1.2, -0.8, 2.0):
        share = 1.0 + 0.02 * rng.standard_normal()
        nothing = np.zeros(int(6.0 * rate))
        angle_of, _ = moved(
            Given(nothing), rate, 40, 0.02, lambda v, s=share: (0.012 * s, 4e-3 * s * v),
            lambda q: 0.6 * math.sin(q), angle,
        )  # fmt: skip
        runs.append((nothing, np.round(angle_of * 2**14 / 6.2832) * 6.2832 / 2**14))
    found = told(tmp_path, runs, rate, 0.022)
    truth = {
        "gravity.torque_nm": 0.66,
        "coulomb_friction.motor_nm": 0.0132,
        "viscous_friction.motor_nm_s_rad": 4.4e-3,
    }
    assert_sizes(found, truth, 0.08)
    inertia = found.parameters["jm"]
    known = (inertia.value, inertia.low, inertia.high)
    assert known == pytest.approx((0.022, 0.02, 0.0242))
    assert SWINGS_FREE in found.notes


def test_under_the_load_of_a_fan_three_laws_of_friction_are_told_apart(tmp_path):
    rate, rng, runs = 50.0, np.random.default_rng(8), []
    for _ in range(2):
        asked = np.repeat(rng.uniform(0.1, 1.0, 10), int(3.0 * rate))
        share = 1.0 + 0.02 * rng.standard_normal()
        _, speed = moved(
            Given(asked), rate, 40, 5e-3,
            lambda v, s=share: (0.1 * s, 1e-3 * s * v + 3e-5 * abs(v) * v),
        )  # fmt: skip
        rpm = (speed + 0.2 * rng.standard_normal(speed.size)) * 30.0 / np.pi
        runs.append((asked + 0.01 * rng.standard_normal(asked.size), rpm))
    truth = {
        "coulomb_friction.motor_nm": 0.1,
        "viscous_friction.motor_nm_s_rad": 1e-3,
        "quadratic_friction.motor_nm_s2_rad2": 3e-5,
    }
    assert_sizes(told(tmp_path, runs, rate, 4.5e-3, "rpm"), truth, 0.15)


def test_friction_that_falls_from_breakaway_is_found_in_stairs_of_speed(tmp_path):
    rate, rng, runs = 100.0, np.random.default_rng(9), []
    speeds = 20.0 * np.geomspace(0.02, 1.0, 7)
    asked = np.repeat([s for one in speeds for s in (one, -one)], int(1.5 * rate))
    wanted = np.zeros(asked.size)
    for k in range(1, wanted.size):
        wanted[k] = wanted[k - 1] + np.clip(asked[k] - wanted[k - 1], -0.4, 0.4)
    for _ in range(2):
        share = 1.0 + 0.02 * rng.standard_normal()
        loop = Speeds(wanted, 0.2, 0.05)
        angle, _ = moved(
            loop, rate, 40, 0.01,
            lambda v, s=share: (s * (0.4 + 0.2 * math.exp(-((v / 1.0) ** 2))), 0.02 * s * v),
        )  # fmt: skip
        runs.append((loop.values + 0.01 * rng.standard_normal(wanted.size), angle))
    truth = {
        "coulomb_friction.motor_nm": 0.4,
        "viscous_friction.motor_nm_s_rad": 0.02,
        "stribeck_friction_motor.torque_nm": 0.2,
        "stribeck_friction_motor.velocity_rad_s": 1.0,
    }
    assert_sizes(told(tmp_path, runs, rate, 0.011), truth, 0.2)


def voltages(volts: np.ndarray, dead: float, seed: int, step: float, rate: float, sizes):
    """Return a command and the angle of a small motor whose driver ignores small ones."""
    inertia, dry, more, fallen, wet = sizes
    rng, acts = np.random.default_rng(seed), np.sign(volts) * np.maximum(np.abs(volts) - dead, 0.0)
    share = 1.0 + 0.02 * rng.standard_normal()
    lost = lambda v: (share * (dry + more * math.exp(-((v / fallen) ** 2))), share * wet * v)  # noqa: E731
    angle, _ = moved(Given(acts), rate, 40, inertia, lost)
    return volts, np.round(angle / step) * step


SMALL_MOTOR = ("viscous_friction", "coulomb_friction", "presliding_friction", "dead_band", "delay",
               "actuator_lag")  # fmt: skip


def test_a_dead_band_that_coulomb_friction_stands_for_is_found_beside_it(tmp_path):
    """The one alone does the part of both, and from there no small step gains anything."""
    rate, stamps = 200.0, np.arange(8000) / 200.0
    command = 31.2 / np.pi * np.arcsin(np.sin(2.0 * np.pi * stamps / 3.9))
    sizes = 0.0413, 0.58, 0.3, 4.0, 0.107
    runs = [voltages(command, 0.99, 5, 2.0 * np.pi / 2048, rate, sizes)]
    found = told(tmp_path, runs, rate, 0.0372, effects=SMALL_MOTOR)
    truth = {"dead_band.width_nm": 0.99, "viscous_friction.motor_nm_s_rad": 0.107}
    assert set(found.effects) == {*SMALL_MOTOR[:2], "dead_band"}
    for name, size in truth.items():
        assert found.parameters[name].value == pytest.approx(size, rel=0.05), name
    assert found.parameters["coulomb_friction.motor_nm"].value == pytest.approx(0.58, rel=0.2)


def test_a_voltage_that_is_held_is_no_signal_half_a_sample_late(tmp_path):
    rate, stamps, rng = 100.0, np.arange(4000) / 100.0, np.random.default_rng(1)
    steps = np.repeat(9.3 * rng.uniform(-1.0, 1.0, 48), 85)[: stamps.size]
    sweep = 5.0 * np.sin(2.0 * np.pi * (0.05 * stamps + 4.6 * stamps**2 / 80.0))
    sizes = 0.0612, 1.145, 0.545, 0.9, 0.297
    runs = [voltages(volts, 0.0, number, 2.0 * np.pi / 4096, rate, sizes)
            for number, volts in enumerate((steps, sweep), 1)]  # fmt: skip
    found = told(tmp_path, runs, rate, 0.0673, effects=SMALL_MOTOR)
    assert not {"delay", "actuator_lag", "dead_band"} & {*found.effects}
    assert set(SMALL_MOTOR[:2]) <= set(found.effects)
    assert found.parameters["jm"].value == pytest.approx(0.0612, rel=0.03)
