"""Logs of robot joints: smooth motion and the torque that it takes, by inverse dynamics.

The torque holds noise and ripple that move nothing, nobody knows the controller, and friction is
greater than all that inertia takes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

COBOT = {"jm": 3.4, "coulomb_friction.motor_nm": 9.0, "viscous_friction.motor_nm_s_rad": 12.0}
HEAVY = {
    "jm": 900.0,
    "gravity.torque_nm": 3000.0,
    "coulomb_friction.motor_nm": 320.0,
    "viscous_friction.motor_nm_s_rad": 520.0,
}


def motion(
    rate: float, seconds: float, amplitude: float, base_hz: float, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angle, speed and acceleration of a Fourier series of seven lines."""
    rng, time = np.random.default_rng(seed), np.arange(int(rate * seconds)) / rate
    found = np.zeros((3, time.size))
    for k in range(1, 8):
        w, line = 2.0 * np.pi * base_hz * k, complex(*rng.standard_normal(2)) / k
        turn = line * np.exp(1j * w * time)
        found += np.array([turn.real, (1j * w * turn).real, (-w * w * turn).real])
    q, v, a = found * amplitude / np.abs(found[0]).max()
    return q, v, a


def diagnosed(
    folder: Path, rate: float, runs: list[tuple[np.ndarray, np.ndarray]], jm: float, *others: str
) -> Diagnosis:
    files = []
    for number, (angle, torque) in enumerate(runs):
        files.append(folder / f"run{number}.csv")
        table = np.column_stack([np.arange(angle.size) / rate, angle, torque])
        np.savetxt(files[-1], table, fmt="%.9g", delimiter=",", header="t,q,tau", comments="")
    columns = parse_map(["time=t", "position=q", "torque=tau"])
    import_files(files, folder / "bags", ImportOptions(columns))
    effects = ["coulomb_friction", "viscous_friction", "gravity", "cable", *others]
    return diagnose(folder / "bags", {"jm": jm}, effects=effects)


def check(found: Diagnosis, truth: dict[str, float], within: float) -> None:
    for name, value in truth.items():
        assert found.parameters[name].value == pytest.approx(value, rel=within), name
    assert all(cause.present > 0.8 for cause in found.causes)


def test_an_inertia_that_went_astray_without_friction_comes_back_with_it(tmp_path):
    """It doubles in the fit without friction, follows the noise of the torque less, and stays."""
    rng, runs = np.random.default_rng(33), []
    for seed in range(20, 24):
        q, v, a = motion(125.0, 40.0, 1.5, 0.05, seed)
        level = 9.0 + 4.0 * np.exp(-((v / 0.08) ** 2))
        torque = 3.4 * a + np.tanh(v / 0.002) * level + 12.0 * v
        torque += 0.8 * np.sin(100.0 * q + 0.3) + 0.5 * rng.standard_normal(q.size)
        runs.append((q + 5e-5 * rng.standard_normal(q.size), torque))
    found = diagnosed(tmp_path, 125.0, runs, 3.6, "stribeck_friction_motor")
    assert sorted(found.effects) == [
        "coulomb_friction", "stribeck_friction_motor", "viscous_friction",
    ]  # fmt: skip
    check(found, COBOT, 0.08)


def test_a_torque_that_is_no_command_is_seen_once_gravity_and_friction_are_there(tmp_path):
    """At 10 Hz half a sample of delay takes a fifth of the viscous friction away."""
    rng, runs = np.random.default_rng(31), []
    for seed in range(4):
        q, v, a = motion(10.0, 120.0, 0.9, 1.0 / 40.0, seed)
        torque = 900.0 * a + 3000.0 * np.sin(q + 0.2) + 320.0 * np.tanh(v / 0.003) + 520.0 * v
        q += 2e-5 * rng.standard_normal(q.size)
        runs.append((q, torque + 25.0 * rng.standard_normal(q.size)))
    found = diagnosed(tmp_path, 10.0, runs, 950.0)
    assert sorted(found.effects) == ["coulomb_friction", "gravity", "viscous_friction"]
    check(found, HEAVY, 0.05)
