"""A limited rate is seen where it holds the torque back for several samples in a row."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.which.slewing import doubt_of_rate, samples_behind

RATE_HZ = 1000.0
TIME_S = np.arange(4000) / RATE_HZ
STEPS = np.where(np.sin(2.0 * np.pi * 7.0 * TIME_S) >= 0.0, 1.0, -1.0)
WAVE = np.sin(2.0 * np.pi * 7.0 * TIME_S)


def behind(torque: np.ndarray, limit_nm_s: float, effect: str = "torque_slew_limit") -> float:
    described = RecordDescription.of("test", sample_rate_hz=RATE_HZ)
    record = Record("one", described, None, torque, np.zeros(torque.size), None)
    model = Model({"jm": 1.0}, {"torque_slew_limit.limit_nm_s": limit_nm_s})
    return samples_behind(model, effect, RecordSet("here", RATE_HZ, (record,)))


@pytest.mark.parametrize(("samples", "times"), [(0.4, 0), (1.5, 1), (4.5, 4)])
def test_a_step_is_behind_for_as_long_as_it_slews(samples, times):
    assert behind(STEPS, 2.0 * RATE_HZ / samples) == times


def test_a_wave_that_is_faster_than_the_limit_is_behind_for_many_samples():
    fastest = 2.0 * np.pi * 7.0
    assert behind(WAVE, 0.9 * fastest) > 30 and behind(WAVE, 1.1 * fastest) <= 2


def test_what_acts_between_samples_only_is_doubted():
    assert doubt_of_rate(behind(STEPS, 2.0 * RATE_HZ / 1.5)) == 0.5
    assert doubt_of_rate(behind(WAVE, 30.0)) == 1.0
    assert doubt_of_rate(behind(STEPS, 1.0, "delay")) == 1.0
