"""Motions or torques compared: between the two sizes lies the truth, and intervals reach so far."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from driven_runs import RATE, driven_runs

from fjr_sim_node.theory.linear import g0
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.torque_errors import TorqueErrors
from gap_diagnosis.outcome.gap_size import Estimate
from gap_diagnosis.verdict.between_regressions import _reaching

RIGID = {
    "jm": 0.5, "fsm": 5.0, "fvm": 3.0, "j": 0.0, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0,
}  # fmt: skip
STATED = {**RIGID, "jm": 0.47}
COGGING = {"cogging.amplitude_nm": 8.0, "cogging.cycles_per_turn": 40.0}


def noisy(share: float):
    """Return a log that adds noise of a share of the torque's rms."""
    return lambda torque, rng: torque + share * np.std(torque) * rng.standard_normal(torque.size)


def both(share: float, causes=None) -> tuple[float, float]:
    """Return the inertias by motion and by torque, of logs with noise of the torque."""
    records = driven_runs(causes, rig=RIGID, logged=noisy(share))
    fitter = CellFitter(Evidence(records, STATED), Model.nominal(STATED).plant, 0.1)
    refit = fitter.refit()
    by_torque = copy.copy(fitter)
    by_torque.evidence = TorqueErrors(fitter.evidence, STATED)
    return refit.model.plant["jm"], by_torque.taken_over(refit).model.plant["jm"]


def test_errors_are_those_of_the_motion_in_the_compliance_of_the_datasheet():
    evidence = Evidence(driven_runs(COGGING, rig=RIGID), STATED)
    torques, parts = TorqueErrors(evidence, STATED), evidence.parts_for("fit")
    stated, heavy = Model.nominal(STATED), Model.nominal({**STATED, "jm": 0.7})
    assert torques.errors([stated], parts) == pytest.approx(evidence.errors([stated], parts))
    ratio = torques.errors([heavy], parts)[0] / evidence.errors([heavy], parts)[0]
    hz = (np.arange(evidence.lines) + 0.5) * evidence.line_hz
    holds = evidence.simulator.response(hz, 0)
    moved = [abs(g / (1.0 + g * holds)) for plant in (STATED, {**STATED, "jm": 0.7})
             for g in [g0(plant, hz, RATE)]]  # fmt: skip
    assert ratio[: hz.size] == pytest.approx(moved[0] / moved[1])
    assert ratio[0] < 1.05 < 1.4 < ratio[hz.size - 1]


@pytest.mark.parametrize("share", [0.1, 0.2])
def test_the_truth_lies_between_motions_and_torques_beside_noise_of_the_torque(share):
    by_motion, by_torque = both(share)
    assert by_torque < RIGID["jm"] < by_motion
    assert by_motion - by_torque > 0.1 * share**2


def test_without_noise_or_a_remainder_both_are_the_same():
    by_motion, by_torque = both(0.0)
    assert by_torque == pytest.approx(by_motion, rel=1e-4)
    assert by_torque == pytest.approx(RIGID["jm"], rel=1e-3)


def test_intervals_reach_to_where_torques_lead_beside_noise_and_what_is_not_named():
    strong = {**COGGING, "cogging.amplitude_nm": 20.0}
    records = driven_runs(strong, rig=RIGID, logged=noisy(0.1))
    found = investigate(records, STATED, effects=["gravity"]).diagnosis
    _, by_torque = both(0.1, strong)
    inertia = found.parameters["jm"]
    assert inertia.low < 1.002 * by_torque and inertia.low < RIGID["jm"] < inertia.high
    (said,) = (note for note in found.notes if note.startswith("Compared by torque"))
    assert " would be " in said


def test_an_interval_reaches_no_further_than_to_zero():
    found = Estimate(value=2.0, low=1.5, high=2.5)
    assert _reaching(found, 3.0) == Estimate(value=2.0, low=1.5, high=3.0)
    assert _reaching(found, -1.0) == Estimate(value=2.0, low=0.0, high=2.5)
    assert _reaching(found, 2.1) == found == _reaching(found, None)
