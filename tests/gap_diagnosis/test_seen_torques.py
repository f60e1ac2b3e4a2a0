"""Ripples and loads along the recorded motion: the torque that the model lacks shows them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_evidence import NOMINAL, records

from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_rig import RecordSimulator
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.seen_torques import SeenTorques, _best

CASES = {
    "cogging": {"amplitude_nm": 6.0, "cycles_per_turn": 45.0, "phase_rad": 0.7},
    "position_friction": {"amplitude_nm": 4.0, "cycles_per_turn": 45.0, "phase_rad": -1.2},
    "torque_constant_ripple": {"amplitude": 0.2, "cycles_per_turn": 45.0, "phase_rad": 2.0},
}


def named(effect: str) -> dict[str, float]:
    return {f"{effect}.{name}": value for name, value in CASES[effect].items()}


@pytest.mark.parametrize(("known", "step"), [(True, 1.0), (False, 1.0), (False, 0.01)])
@pytest.mark.parametrize("effect", CASES)
def test_number_size_and_phase_are_seen(effect, known, step):
    truth = named(effect)
    fitter = CellFitter(Evidence(records(truth, known=known), NOMINAL), NOMINAL, 0.1)
    seen = SeenTorques(fitter.evidence, fitter.fit_parts, fitter.refit().model)
    seeds = seen.seeds(effect, np.arange(20.0, 70.0, step))
    cycles, phase = f"{effect}.cycles_per_turn", f"{effect}.phase_rad"
    (size,) = set(truth) - {cycles, phase}
    nearest = min(seeds, key=lambda seed: abs(seed[cycles] - truth[cycles]))
    assert abs(nearest[cycles] - truth[cycles]) <= 2.0
    assert nearest[size] == pytest.approx(truth[size], rel=0.4)
    assert np.cos(nearest[phase] - truth[phase]) > 0.7


def test_a_ripple_that_decides_where_the_motor_rests_is_found():
    """Along the motion of the model without it nothing of it can be predicted."""
    truth = {
        "cogging.amplitude_nm": 60.0,
        "cogging.cycles_per_turn": 60.0,
        "cogging.phase_rad": 1.0,
    }
    fitter = CellFitter(Evidence(records(truth, runs=2), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    assert max(abs(refit.solution.x)) > 0.5  # the refit bends the datasheet to do what it does
    fit = fitter.add(refit, "cogging", fitter.screening(refit, "cogging").proposals())
    found = fitter.further(fit).model.effects
    assert found["cogging.cycles_per_turn"] == pytest.approx(60.0, rel=0.01)
    assert found["cogging.amplitude_nm"] == pytest.approx(60.0, rel=0.03)


def test_nothing_is_seen_of_a_transmission_or_beyond_what_the_observer_follows():
    evidence = Evidence(records(seconds=5.0), NOMINAL)
    fitter = CellFitter(evidence, NOMINAL, 0.1)
    seen = SeenTorques(evidence, fitter.fit_parts, fitter.refit().model)
    assert seen.seeds("kinematic_error", np.arange(20.0, 70.0)) == []
    assert seen.seeds("cogging", np.arange(1e6, 1e6 + 50.0)) == []


def test_the_highest_peaks_are_taken_and_what_does_as_well():
    explained = np.array([0.0, 5.0, 1.0, 10.0, 9.8, 9.7, 2.0, 3.0])
    assert _best(explained) == [1, 3, 4, 5]


LOAD = {
    "torque_bias": {"torque_nm": -4.0},
    "gravity": {"torque_nm": 8.0, "angle_rad": 0.6},
    "external_spring": {"stiffness_nm_rad": 90.0, "rest_rad": 0.05},
}


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("effect", LOAD)
def test_a_load_is_seen_as_it_is(effect, known):
    truth = {f"{effect}.{name}": value for name, value in LOAD[effect].items()}
    fitter = CellFitter(Evidence(records(truth, known=known), NOMINAL), NOMINAL, 0.1)
    (seed,) = SeenTorques(fitter.evidence, fitter.fit_parts, Model(NOMINAL, {})).load(effect)
    assert seed.keys() == truth.keys()
    if effect == "gravity":  # of small angles: a constant torque and a stiffness
        angle, size = seed["gravity.angle_rad"], seed["gravity.torque_nm"]
        assert size * np.sin(angle) == pytest.approx(8.0 * np.sin(0.6), rel=0.1)
    else:
        assert list(seed.values()) == pytest.approx(list(truth.values()), rel=0.1)


def test_a_spring_that_pushes_is_no_spring():
    truth = {"gravity.torque_nm": 60.0, "gravity.angle_rad": np.pi}
    fitter = CellFitter(Evidence(records(truth), NOMINAL), NOMINAL, 0.1)
    seen = SeenTorques(fitter.evidence, fitter.fit_parts, Model(NOMINAL, {}))
    assert seen.load("external_spring") == []


@pytest.mark.parametrize("lasts_s", [4.0, 0.05])
def test_what_an_observer_adds_for_a_torque_is_known(lasts_s):
    """A steady torque is seen whole, a quick one late and smaller: both as the simulation says."""
    evidence = Evidence(records(known=False), NOMINAL)
    simulator = evidence.simulator
    model = Model({**NOMINAL, "fs": 0.0, "fsm": 0.0, "k1": 0.0}, {})
    record = evidence.records.records[0]
    stamps = np.arange(record.samples) / evidence.records.sample_rate_hz
    torque = 3.0 * np.sign(np.sin(np.pi * stamps / lasts_s))
    pushed = replace(record, torque=record.torque + torque)
    other = RecordSimulator(
        replace(evidence.records, records=(pushed,)), evidence.noise,
        evidence.lines * evidence.line_hz, NOMINAL,
    )  # fmt: skip
    added = simulator.missing_torque(model, [0])[0] - other.missing_torque(model, [0])[0]
    expected = simulator.added(model)(torque)
    late = slice(int(0.5 * evidence.records.sample_rate_hz), None)
    assert np.std(added[late] - expected[late]) < 0.02 * np.std(expected[late])
    assert (np.std(expected[late]) > 0.9 * 3.0) == (lasts_s > 1.0)
