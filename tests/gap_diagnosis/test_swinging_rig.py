"""A rig that swings by itself, by the delay of its drive: the recorded torque drives the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_evidence import NOMINAL, RATE, records

from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_loop import SWINGS, accounted_for
from gap_diagnosis.model.rig_model import Model

DELAY_S = 6e-3


@pytest.fixture(scope="module")
def swinging():
    return records({"delay.time_s": DELAY_S}, runs=2, seconds=6.0)


def test_a_rig_that_its_delay_makes_swing_is_given_that_delay(swinging):
    """Ten times the reference, and where in its cycle it is no simulated loop repeats."""
    assert max(accounted_for(record, RATE) for record in swinging.records) < SWINGS
    found = investigate(swinging, NOMINAL, effects=("delay", "actuator_lag", "extra_mode"))
    (cause,) = found.diagnosis.causes
    assert cause.effect == "delay" and cause.present > 0.9
    assert cause.parameters["delay.time_s"].value == pytest.approx(DELAY_S, rel=0.01)
    assert found.diagnosis.gap.explained.nrmse_position < 0.02
    assert any("the rig swings by itself" in note for note in found.diagnosis.notes)
    assert not any("wrong sign" in note for note in found.diagnosis.notes)


def test_the_loop_of_a_rig_that_follows_is_simulated():
    still = records({"delay.time_s": 1e-3})
    assert min(accounted_for(record, RATE) for record in still.records) > 0.9
    assert Evidence(still, NOMINAL).simulator.loop.kind == "known"
    at_rest = replace(still.records[0], position=1e-6 * np.sin(np.arange(4000.0) ** 2))
    assert accounted_for(at_rest, RATE) == 1.0


def test_an_observer_holds_a_model_whatever_delay_its_drive_is_given(swinging):
    """A delay that is a little longer is a little wrong, in proportion, and makes nothing swing."""
    evidence = Evidence(swinging, NOMINAL)
    errors = {}
    for delay in (1.0, 1.01, 1.1, 0.0):
        effects = {"delay.time_s": delay * DELAY_S} if delay else {}
        runs = evidence.simulator.run([Model(NOMINAL, effects)], [0, 1])[0]
        errors[delay] = max(
            np.std(run[0] - r.position) / np.std(r.position)
            for run, r in zip(runs, swinging.records, strict=False)
        )
    assert errors[1.0] < 1e-3
    assert 0.01 < errors[1.1] < 0.1
    assert errors[1.01] == pytest.approx(0.1 * errors[1.1], rel=0.3)
    assert errors[0.0] < 2.0
