"""A drive that logs torque and a noisy speed, no angle: from CSV to its frictions.

The noise of the speed lets the integrated angle walk further than what the missing friction does.
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

RATE, SECONDS, SUBSTEPS = 400, 15, 8
INERTIA, COULOMB, VISCOUS = 2.0e-3, 0.05, 5.0e-4
NOISE, OFFSET = 0.2, 0.1  # rad/s


def commanded(rng: np.random.Generator) -> np.ndarray:
    """Return smooth steps of speed (rad/s) after half a second of rest."""
    out, k = np.zeros(RATE * SECONDS), RATE // 2
    while k < out.size:
        length = int(RATE * rng.uniform(0.3, 1.5))
        out[k : k + length] = rng.uniform(-60.0, 60.0)
        k += length
    share, now = 1.0 - math.exp(-2.0 * np.pi * 3.0 / RATE), 0.0
    for k, wanted in enumerate(out.tolist()):
        now += share * (wanted - now)
        out[k] = now
    return out


def run(rng: np.random.Generator) -> np.ndarray:
    """Return time, torque (N m) and measured speed (rpm) of a run under a PI speed loop."""
    wanted = commanded(rng).tolist()
    h, w, integral = 1.0 / (RATE * SUBSTEPS), 0.0, 0.0
    rows = []
    for k, target in enumerate(wanted):
        integral += 0.5 * (target - w) / RATE
        torque = min(max(0.05 * (target - w) + integral, -1.0), 1.0)
        rows.append((k / RATE, torque, (w + OFFSET + NOISE * rng.standard_normal()) * 30 / np.pi))
        for _ in range(SUBSTEPS):
            if w == 0.0 and abs(torque) <= COULOMB:
                continue
            side = math.copysign(1.0, w if w != 0.0 else torque)
            after = w + h * (torque - COULOMB * side - VISCOUS * w) / INERTIA
            w = 0.0 if w * after < 0.0 else after
    return np.array(rows)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("drive")
    rng = np.random.default_rng(5)
    files = [folder / f"run{k}.csv" for k in range(3)]
    for file in files:
        np.savetxt(file, run(rng), fmt="%.7g", delimiter=",", header="t,torque,rpm", comments="")
    columns = parse_map(["time=t", "torque=torque", "position=rpm:rpm"])
    import_files(files, folder / "bags", ImportOptions(columns))
    effects = ["coulomb_friction", "viscous_friction", "gravity", "cogging", "torque_bias"]
    return diagnose(folder / "bags", {"jm": 1.05 * INERTIA}, effects=effects)


def test_both_frictions_are_named_with_their_sizes(found):
    assert sorted(found.effects) == ["coulomb_friction", "viscous_friction"]
    truth = {
        "jm": INERTIA,
        "coulomb_friction.motor_nm": COULOMB,
        "viscous_friction.motor_nm_s_rad": VISCOUS,
    }
    for name, value in truth.items():
        estimate = found.parameters[name]
        assert estimate.value == pytest.approx(value, rel=0.03), name
        assert estimate.low < value < estimate.high, name


def test_what_is_left_is_the_noise_of_the_speed(found):
    assert found.gap.nominal.chi2_per_dof > 100.0
    assert 0.5 < found.gap.explained.chi2_per_dof < 2.0
    assert any("the integral of a recorded speed" in note for note in found.notes)
