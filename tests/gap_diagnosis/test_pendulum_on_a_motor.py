"""A pendulum on a voltage-driven motor, made by an integrator of its own, from CSV to its causes.

It turns round, its encoder is coarse, its datasheet holds an inertia alone, and the torque is the
voltage over the resistance: what the motor induces is then viscous friction.
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

RATE, SECONDS, SUBSTEPS = 500, 20, 10
KT, OHM, INERTIA = 0.042, 8.4, 3.0e-4
GRAVITY, COULOMB, VISCOUS = 0.0188, 1.2e-3, 1.5e-5
COUNTS = 2048
INDUCED = KT**2 / OHM


def voltage(seed: int, volts: float) -> np.ndarray:
    """Return steps of random height and length after a second of rest."""
    rng = np.random.default_rng(seed)
    out, k = np.zeros(RATE * SECONDS), RATE
    while k < out.size:
        length = int(RATE * rng.uniform(0.25, 1.2))
        out[k : k + length] = volts * rng.uniform(-1.0, 1.0)
        k += length
    return out


def angle(volts: np.ndarray) -> np.ndarray:
    """Return the encoder's angle (rad), by the semi-implicit Euler method."""
    h, th, w = 1.0 / (RATE * SUBSTEPS), 0.0, 0.0
    out = np.empty(volts.size)
    for k, v in enumerate(volts.tolist()):
        out[k] = th
        for _ in range(SUBSTEPS):
            drive = KT * (v - KT * w) / OHM - GRAVITY * math.sin(th) - VISCOUS * w
            if w == 0.0 and abs(drive) <= COULOMB:
                continue
            side = math.copysign(1.0, w if w != 0.0 else drive)
            after = w + h * (drive - COULOMB * side) / INERTIA
            w = 0.0 if w * after < 0.0 else after
            th += h * w
    step = 2.0 * np.pi / COUNTS
    return np.round(out / step) * step


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("pendulum")
    files = []
    for run, (seed, volts) in enumerate([(1, 2.0), (2, 2.0), (3, 3.5), (4, 3.5)]):
        v = voltage(seed, volts)
        table = np.column_stack([np.arange(v.size) / RATE, v, angle(v)])
        files.append(folder / f"run{run}.csv")
        np.savetxt(files[-1], table, fmt="%.7g", delimiter=",", header="t,v,th", comments="")
    columns = parse_map([f"torque=v:{KT / OHM}", "position=th", "time=t"])
    import_files(files, folder / "bags", ImportOptions(columns, levels=2))
    return diagnose(folder / "bags", {"jm": 1.07 * INERTIA})


def test_gravity_and_both_frictions_are_named_with_their_sizes(found):
    assert found.effects[0] == "gravity"
    assert sorted(found.effects) == ["coulomb_friction", "gravity", "viscous_friction"]
    truth = {
        "jm": INERTIA,
        "gravity.torque_nm": GRAVITY,
        "coulomb_friction.motor_nm": COULOMB,
        "viscous_friction.motor_nm_s_rad": VISCOUS + INDUCED,
    }
    for name, value in truth.items():
        estimate = found.parameters[name]
        assert estimate.value == pytest.approx(value, rel=0.03), name
        assert estimate.low < value < estimate.high, name


def test_the_gap_closes_to_the_rounding_of_the_encoder(found):
    assert found.gap.nominal.nrmse_position > 0.03
    assert found.gap.explained.nrmse_position < 0.002
    assert all(cause.present > 0.9 for cause in found.causes)
