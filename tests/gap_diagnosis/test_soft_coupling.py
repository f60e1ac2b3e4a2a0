"""A motor that turns a disc through a soft coupling, of which the datasheet knows the inertia.

The motor is driven by voltage, with an integrator of its own. Sweep and steps shake it below the
disc's resonance for most of the time, where compliance and share of the disc show as one product.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from gap_diagnosis.any_record import investigate
from gap_diagnosis.investigation import Investigation
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.starts.other_splits import other_splits
from gap_diagnosis.verdict.notes import yielding

RATE, SECONDS, SUBSTEPS = 500, 20, 20
MOTOR, DISC, STIFFNESS = 2.3e-3, 1.0e-3, 18.0
COULOMB, VISCOUS = 0.02, 0.071  # the back-EMF acts as viscous friction
COUNT = 2.0 * np.pi / 4096.0
EFFECTS = ["coulomb_friction", "viscous_friction", "transmission_stiffness"]
NOMINAL = datasheet({"jm": 1.03 * (MOTOR + DISC)}, "test")


def run(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return torque (N m) and counted angle (rad) of a run under a sweep and slow steps."""
    rng, t = np.random.default_rng(seed), np.arange(RATE * SECONDS) / RATE
    sweep = 2.0 * np.pi * np.cumsum(np.interp(t, [0.0, SECONDS], [0.3, 15.0])) / RATE
    wanted = 0.45 * np.sin(sweep + rng.uniform(0.0, 6.0))
    wanted += 0.2 * np.sign(np.sin(2.0 * np.pi * 0.7 * t + rng.uniform(0.0, 6.0)))
    h, a, va, b, vb = 1.0 / (RATE * SUBSTEPS), 0.0, 0.0, 0.0, 0.0
    torque, angle = np.empty(t.size), np.empty(t.size)
    for k, asked in enumerate(wanted.tolist()):
        u = asked - 0.08 * a  # keeps it near its place
        torque[k], angle[k] = u, a
        for _ in range(SUBSTEPS):
            carried = STIFFNESS * (a - b)
            va += h * (u - carried - VISCOUS * va - COULOMB * math.tanh(va / 3e-3)) / MOTOR
            a += h * va
            vb += h * carried / DISC - h * 3.0 * vb  # its coupling and its air damp it a little
            b += h * vb
    return torque, np.round(angle / COUNT) * COUNT


@pytest.fixture(scope="module")
def found() -> Investigation:
    records = []
    for number in range(3):
        torque, angle = run(number)
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=3
        )
        records.append(Record(f"run_{number}", described, None, torque, angle, None))
    return investigate(RecordSet("test", RATE, tuple(records)), NOMINAL, effects=EFFECTS)


def test_stiffness_and_inertia_of_the_disc_are_found_however_the_fit_begins(found):
    diagnosis = found.diagnosis
    assert sorted(diagnosis.effects) == sorted(EFFECTS)
    sizes = diagnosis.parameters
    of = "transmission_stiffness"
    assert sizes[f"{of}.compliance_rad_nm"].value == pytest.approx(1.0 / STIFFNESS, rel=0.05)
    share = DISC / (MOTOR + DISC)
    assert sizes[f"{of}.link_inertia_share"].value == pytest.approx(share, rel=0.05)
    assert sizes["viscous_friction.motor_nm_s_rad"].value == pytest.approx(VISCOUS, rel=0.05)


def test_what_a_yielding_transmission_may_have_besides_is_a_question_of_its_own():
    named = ["coulomb_friction", "transmission_stiffness"]
    (note,) = yielding(named, 20.0)
    assert "--nominal updated.yaml" in note
    assert yielding(named, math.nan) == [note]
    assert yielding(named, 1.1) == yielding(named[:1], 20.0) == []


def test_other_splits_are_alike_at_low_frequencies():
    of = "transmission_stiffness"
    found = {
        f"{of}.compliance_rad_nm": 0.01,
        f"{of}.link_inertia_share": 0.8,
        "coulomb_friction.motor_nm": 1.0,
    }
    splits = other_splits(found)
    assert [each[f"{of}.link_inertia_share"] for each in splits] == [0.1, 0.3]
    for each in splits:
        product = each[f"{of}.compliance_rad_nm"] * each[f"{of}.link_inertia_share"] ** 2
        assert product == pytest.approx(0.01 * 0.8**2)
        assert each["coulomb_friction.motor_nm"] == 1.0
    assert other_splits({"coulomb_friction.motor_nm": 1.0}) == []
