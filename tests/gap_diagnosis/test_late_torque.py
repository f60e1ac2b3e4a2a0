"""A log that holds the torque later than it acted is told from a delay, and mended."""

from __future__ import annotations

import numpy as np
import pytest
from driven_runs import NOMINAL, driven_runs
from hypothesis import given
from hypothesis import strategies as st

from gap_diagnosis.any_record import investigate
from gap_diagnosis.which.late_torque import brought_forward, brought_to_its_time
from gap_diagnosis.which.torque_timing import timed

COGGING = {"cogging.amplitude_nm": 3.0, "cogging.cycles_per_turn": 40.0}


@given(st.floats(0.0, 0.1), st.floats(0.0, 6.28), st.floats(0.0, 8.0))
def test_a_signal_is_as_much_earlier_as_is_asked(cycles, phase, samples):
    k = np.arange(300)
    omega = 2.0 * np.pi * cycles
    early = brought_forward(np.cos(omega * k + phase), samples)
    assert early.shape == k.shape
    assert np.abs(early - np.cos(omega * (k + samples) + phase))[5:-15].max() < 0.02


@given(st.integers(1, 20), st.floats(0.0, 6.28), st.floats(0.0, 8.0))
def test_the_end_of_a_steady_period_goes_on_with_its_begin(cycles, phase, samples):
    k, omega = np.arange(600), 2.0 * np.pi * cycles / 200.0
    early = brought_forward(np.cos(omega * k + phase), samples, 200)
    assert np.abs(early - np.cos(omega * (k + samples) + phase))[5:].max() < 0.02


def read_late(torque, _):
    """Return a torque that is logged 9 ms, of ten fine samples to one of the log, too late."""
    return np.concatenate([np.zeros(18), torque[:-18]])


def test_a_torque_that_is_read_late_is_brought_to_its_time():
    records = driven_runs(COGGING, logged=read_late, finer=10)
    found = investigate(records, NOMINAL, effects=["cogging", "delay"]).diagnosis
    (said,) = (note for note in found.notes if "after it acted" in note)
    assert float(said.split()[4]) == pytest.approx(9.0, abs=1.0)
    assert found.effects == ["cogging"]
    assert found.parameters["jm"].value == pytest.approx(NOMINAL["jm"], rel=0.05)


@pytest.mark.parametrize("causes", [None, {"delay.time_s": 0.008}])
def test_a_torque_that_acts_at_once_or_late_is_left_where_it_is(causes):
    timing = timed(driven_runs(causes), NOMINAL, 0.1, lambda _: None)
    assert brought_to_its_time(timing, timing.refit, lambda _: None) is None
