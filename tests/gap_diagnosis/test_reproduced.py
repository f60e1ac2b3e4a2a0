"""What a model does not reproduce may hide anything, so that none of its causes is surer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controller_node.law import as_transfer_function, law_of
from excitation_node.records import chirp
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.verdict_words import BACKWARDS, LOST
from gap_diagnosis.verdict.judgement import reproduced

RATE = 200.0
LAW = {"kind": "pd", "p": 4.0, "d": 0.3, "n": 200.0}
BARE = datasheet({"jm": 0.01, "k0": math.inf}, "test")
HEAVY = datasheet({"jm": 0.2, "k0": math.inf}, "test")


def pushed(number: int, push_nm: float, bare: dict = BARE, viscous: float = 0.4) -> Record:
    """Return moves of an axis with viscous friction that somebody pushes unseen."""
    rng = np.random.default_rng(number)
    r = chirp(4000, RATE, amplitude_rad=0.5, f_min_hz=0.1, f_max_hz=3.0)
    unseen = push_nm * np.repeat(rng.uniform(-1.0, 1.0, 20), 200)
    rig = Model.nominal({**bare, "fvm": viscous}).plant_coefficients
    law = as_transfer_function(law_of(LAW, RATE))
    run = closed_loop.simulate_law(r, RATE, rig, law, added=unseen)
    described = RecordDescription.of(
        "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=2,
        controller=LAW,
    )  # fmt: skip
    return Record(f"run_{number}", described, r, run.torque - unseen, run.position, None)


@pytest.mark.parametrize(("push_nm", "lost"), [(0.3, False), (3.0, True)])
def test_a_model_that_misses_half_of_the_squared_motion_has_no_named_causes(push_nm, lost):
    records = RecordSet("test", RATE, tuple(pushed(n, push_nm) for n in range(2)))
    looked_for = ("viscous_friction", "coulomb_friction")
    found = investigate(records, BARE, effects=looked_for)
    fitted, diagnosis = found.fitted, found.diagnosis
    share = reproduced(fitted.fitter, fitted.found.best)
    assert share == pytest.approx(max(1.0 - diagnosis.remainder.nrmse_position**2, 0.0))
    assert lost == (share < 0.5) == (LOST in diagnosis.notes)
    assert all(cause.present <= share for cause in diagnosis.causes)
    assert diagnosis.effects == ([] if lost else ["viscous_friction"])


def test_of_a_torque_of_the_wrong_sign_no_cause_is_named():
    """The law is not described, and the friction is small beside the mass that it brakes."""
    effects, records = ("delay", "viscous_friction", "quadratic_friction"), []
    for n in range(3):
        run = pushed(n, 0.0, HEAVY, 0.4)
        bare = run.description.model_copy(update={"controller": None})
        records.append(replace(run, description=bare, torque=-run.torque))
    turned = investigate(RecordSet("test", RATE, tuple(records)), HEAVY, effects=effects).diagnosis
    assert turned.verdict == "unexplained" and turned.effects == []
    assert BACKWARDS in turned.notes
    assert any("as if it moved a negative mass" in note for note in turned.notes)
    right = RecordSet("test", RATE, tuple(replace(r, torque=-r.torque) for r in records))
    found = investigate(right, HEAVY, effects=effects).diagnosis
    assert BACKWARDS not in found.notes and "viscous_friction" in found.effects
