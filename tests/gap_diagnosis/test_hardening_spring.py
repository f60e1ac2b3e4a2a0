"""A joint that flexures hold, from its log to the cubic spring, by an integrator of its own."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis.any_record import diagnose

RATE, SECONDS, SUBSTEPS = 200, 8, 10
INERTIA, COULOMB, VISCOUS = 0.06, 0.15, 0.4
STIFFNESS, CUBIC, REST = 4.0, 60.0, -0.08
GAIN, DAMPING = 15.0, 1.2


def run(seed: int, widest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angle (rad) and torque (N m) under a loop that follows a sum of sines."""
    rng, stamps = np.random.default_rng(seed), np.arange(RATE * SECONDS) / RATE
    hertz, phases = rng.uniform(0.1, 2.5, 8)[:, None], rng.uniform(0.0, 2.0 * np.pi, 8)[:, None]
    wanted = np.sin(2.0 * np.pi * hertz * stamps + phases).sum(axis=0)
    wanted *= widest / np.abs(wanted).max()
    h, q, v = 1.0 / (RATE * SUBSTEPS), 0.0, 0.0
    angles, torques = np.empty(stamps.size), np.empty(stamps.size)
    for k, target in enumerate(wanted.tolist()):
        torque = GAIN * (target - q) - DAMPING * v
        angles[k], torques[k] = q, torque
        for _ in range(SUBSTEPS):
            bent = q - REST
            drive = torque - (STIFFNESS + CUBIC * bent * bent) * bent - VISCOUS * v
            if v == 0.0 and abs(drive) <= COULOMB:
                continue
            side = math.copysign(1.0, v if v != 0.0 else drive)
            after = v + h * (drive - COULOMB * side) / INERTIA
            v = 0.0 if v * after < 0.0 else after
            q += h * v
    return angles + 1e-5 * rng.standard_normal(angles.size), torques


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("flexures")
    files = []
    for seed, widest in enumerate([0.5, 0.5, 0.3]):
        angle, torque = run(seed, widest)
        table = np.column_stack([np.arange(angle.size) / RATE, torque, angle])
        files.append(folder / f"run{seed}.csv")
        np.savetxt(files[-1], table, fmt="%.9g", delimiter=",", header="t,u,q", comments="")
    columns = parse_map(["torque=u", "position=q", "time=t"])
    import_files(files, folder / "bags", ImportOptions(columns))
    return diagnose(folder / "bags", {"jm": 1.1 * INERTIA})


def test_the_spring_is_named_and_no_weight_in_its_place(found):
    assert sorted(found.effects) == ["coulomb_friction", "hardening_spring", "viscous_friction"]
    assert [c.others for c in found.causes if c.effect == "hardening_spring"] == [[]]


def test_its_stiffness_and_where_it_rests_are_found(found):
    truth = {
        "jm": INERTIA,
        "coulomb_friction.motor_nm": COULOMB,
        "viscous_friction.motor_nm_s_rad": VISCOUS,
        "hardening_spring.cubic_nm_rad3": CUBIC,
        "hardening_spring.stiffness_nm_rad": STIFFNESS,
        "hardening_spring.rest_rad": REST,
    }
    for name, value in truth.items():
        assert found.parameters[name].value == pytest.approx(value, rel=0.05), name
