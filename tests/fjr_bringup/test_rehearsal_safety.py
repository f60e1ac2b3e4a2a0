"""The safe state after a fault, from torques drawn as timelines."""

from __future__ import annotations

import numpy as np
import pytest
from loop_messages import EPOCH_NS, grid, messages

from fjr_bringup.rehearsal.safety import onset_ns, safe_state
from fjr_sim_node.drive.faults import FaultPlan

SAMPLES = 1500
Y = messages(grid(SAMPLES))
END_NS = int(Y["sent"][-1]) + 1_000_000_000


def torques(until_s, zero_from_s=np.inf, value=3.0):
    """Return torques that answer every position until a time, zero from another one on."""
    stamps = grid(SAMPLES)
    u = messages(stamps[stamps <= until_s * 1e9], 500_000, value=value)
    u["value"][u["stamp"] > zero_from_s * 1e9] = 0.0
    return u


def check(text, u, killed_ns=None, limit_nm=np.inf, ahead_s=2.0):
    plan = FaultPlan.parse(text)
    began = onset_ns(plan, Y, killed_ns)
    return safe_state(plan, began, Y, u, END_NS, limit_nm, ahead_s)


def test_a_fault_begins_after_the_first_position():
    plan = FaultPlan.parse("nan:after_s=0.5")
    assert onset_ns(plan, Y, None) == Y["sent"][0] + 500_000_000
    assert onset_ns(FaultPlan.parse("nan:after_s=10"), Y, None) is None
    assert onset_ns(plan, Y[:0], None) is None


@pytest.mark.parametrize(("zero_from_s", "passed"), [(1.15, True), (1.25, False), (9.0, False)])
def test_no_torque_must_be_reached_in_time_and_kept(zero_from_s, passed):
    found = check("encoder_dropout", torques(3.0, zero_from_s))
    assert found.passed is passed
    again = torques(3.0, 1.15)
    again["value"][-1] = 0.1
    assert not check("encoder_dropout", again).passed


def test_no_torque_at_all_is_no_torque():
    killed = EPOCH_NS + 1_000_000_000
    assert check("node_killed", torques(1.0), killed).passed
    assert check("node_killed", torques(1.0), killed).value < 0.01
    assert not check("node_killed", torques(3.0), killed).passed


def test_a_dead_excitation_is_missed_when_its_references_end():
    killed = EPOCH_NS + 500_000_000
    text = "node_killed:node=excitation"
    assert check(text, torques(3.0, 2.6), killed).passed
    assert not check(text, torques(3.0, 2.6), killed, ahead_s=1.0).passed


def test_a_loop_whose_last_position_is_lost_goes_on_until_then():
    u = torques(3.0)[:-1]
    watchdog = u[-1:].copy()
    watchdog["value"] = 0.0
    watchdog["received"] += 103_000_000
    assert check("loss", np.concatenate([u, watchdog])).passed


def test_a_loop_that_goes_on_must_not_pause_nor_exceed_its_limits():
    assert check("loss", torques(3.0)).passed
    assert not check("loss", torques(2.5)).passed
    gap = torques(3.0)
    assert not check("loss", np.delete(gap, slice(600, 700))).passed
    assert check("loss", np.delete(gap, slice(600, 640))).passed
    assert not check("loss", torques(3.0), limit_nm=2.0).passed
    assert not check("loss", torques(3.0, value=np.nan)).passed


def test_a_run_that_ended_too_early_shows_nothing():
    found = check("nan:after_s=10", torques(3.0, 0.0))
    assert not found.passed and "ended before" in found.sentence
