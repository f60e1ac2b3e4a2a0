"""Faults on a wire: what each does to a timeline of messages, by its seed and stamps alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fjr_interface.real_time import NEVER
from fjr_kit.errors import InputError
from fjr_sim_node.drive import faults
from fjr_sim_node.drive.faults import CATALOGUE, NODE, FaultPlan, as_text
from fjr_sim_node.drive.faulty_wire import FaultyWire, wires

PERIOD_NS = 2_000_000
SAMPLES = 2000


def through(text, seed=1, samples=SAMPLES, lateness_ns=0):
    """Send samples 1, 2, ... of values 1, 2, ... through a fault; return (out at, stamp, value)."""
    wire = FaultyWire(FaultPlan.parse(text), seed)
    out = []

    def take_until(end):
        while (now := wire.next_ns) <= end:
            out.extend((now, *message) for message in wire.take(now))

    for k in range(1, samples + 1):
        now = k * PERIOD_NS + lateness_ns
        take_until(now)
        wire.put(now, k * PERIOD_NS, float(k))
    take_until(NEVER - 1)
    assert wire.next_ns == NEVER
    return np.array(out)


def split(out, after_s=1.0):
    """Return what was sent before and from the onset on."""
    onset = PERIOD_NS + after_s * 1e9
    return out[out[:, 1] < onset], out[out[:, 1] >= onset]


ON_WIRES = [fault.identifier for fault in CATALOGUE if fault.acts_on != NODE]


@pytest.mark.parametrize("kind", ON_WIRES)
def test_nothing_happens_before_the_onset(kind):
    before, _ = split(through(kind))
    k = np.arange(1, 501)
    np.testing.assert_array_equal(before[:500],
                                  np.stack([k * PERIOD_NS, k * PERIOD_NS, k], axis=1))  # fmt: skip


@given(st.sampled_from(ON_WIRES), st.integers(0, 2**31 - 1), st.integers(0, 10_000_000))
def test_the_same_seed_hits_the_same_messages_however_late_they_are(kind, seed, lateness_ns):
    text = f"{kind}:after_s=0.1"
    punctual, late = (through(text, seed, 200, ns) for ns in (0, lateness_ns))
    np.testing.assert_array_equal(punctual[:, 1:], late[:, 1:])


@pytest.mark.parametrize("kind", ["loss", "reordering", "duplicated_stamps"])
def test_the_seed_decides_which_messages_are_hit(kind):
    assert not np.array_equal(through(kind, 1), through(kind, 2))


def test_delay():
    _, after = split(through("delay:time_s=3e-3"))
    np.testing.assert_array_equal(after[:, 0] - after[:, 1], 3e6)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_keeps_the_order_and_the_spread(seed):
    _, after = split(through("jitter:spread_s=5e-3", seed))
    late = after[:, 0] - after[:, 1]
    assert (np.diff(after[:, 1]) > 0).all() and (np.diff(after[:, 0]) >= 0).all()
    assert late.min() >= 0 and 4.5e6 < late.max() <= 5e6


@pytest.mark.parametrize("seed", range(5))
def test_loss_is_binomial(seed):
    _, after = split(through("loss:share=0.1", seed))
    lost = 1500 - len(after)
    assert abs(lost - 150) < 5 * math.sqrt(1500 * 0.1 * 0.9)


def test_reordering_loses_nothing_and_swaps_neighbours():
    _, after = split(through("reordering:share=0.05"))
    assert sorted(after[:, 1]) == list(np.arange(501, 2001) * PERIOD_NS)
    back = np.diff(after[:, 1])
    assert (back < 0).sum() > 30
    assert set(back[back < 0]) == {-PERIOD_NS}


def test_duplicated_stamps():
    _, after = split(through("duplicated_stamps:share=0.05"))
    stamps, counts = np.unique(after[:, 1], return_counts=True)
    assert len(stamps) == 1500
    assert set(counts) == {1, 2} and (counts == 2).sum() > 30


def test_encoder_dropout_has_an_end():
    _, after = split(through("encoder_dropout:for_s=0.5"))
    np.testing.assert_array_equal(after[:, 1], np.arange(751, 2001) * PERIOD_NS)


def test_encoder_jump_nan_and_clock_jump():
    k = np.arange(501, 2001)
    assert (split(through("encoder_jump:step_rad=0.5"))[1][:, 2] == k + 0.5).all()
    values = split(through("nan:samples=3"))[1][:, 2]
    assert np.isnan(values[:3]).all() and (values[3:] == k[3:]).all()
    ahead = through("clock_jump:step_s=0.5")[500:, 1]
    np.testing.assert_array_equal(ahead, k * PERIOD_NS + 5e8)
    assert through("clock_jump:step_s=-100.0")[500:, 1].min() == 1  # zero means: no time yet


def test_drive_faults_act_on_torques_only():
    _, after = split(through("drive_saturation:limit_nm=700.0"))
    assert after[:, 2].max() == 700.0 and (after[:199, 2] == np.arange(501, 700)).all()
    assert (split(through("drive_trip"))[1][:, 2] == 0.0).all()
    torques, positions = wires(FaultPlan.parse("drive_trip"), 1)
    assert isinstance(torques, FaultyWire) and not isinstance(positions, FaultyWire)
    torques, positions = wires(FaultPlan.parse("nan"), 1)
    assert isinstance(positions, FaultyWire) and not isinstance(torques, FaultyWire)
    assert not any(isinstance(wire, FaultyWire) for wire in wires(None, 1))


@pytest.mark.parametrize("fault", CATALOGUE, ids=lambda fault: fault.identifier)
def test_every_fault_is_described_and_its_text_reads_back(fault):
    plan = FaultPlan.parse(fault.identifier)
    assert FaultPlan.parse(as_text(plan)) == plan
    assert fault.safe_state in faults.SAFE_STATES
    assert 0.0 < fault.within_s < 10.0
    assert fault.finding
    for parameter in fault.parameters:
        assert parameter.description
        parameter.check(parameter.default)


def test_infinity_reads_back():
    plan = FaultPlan.parse("node_killed:restart_after_s=.inf")
    assert math.isinf(plan.number("restart_after_s"))
    assert FaultPlan.parse(as_text(plan)) == plan


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("earthquake", "There is no fault 'earthquake'; known are delay, jitter"),
        ("loss:chance=0.1", r"fault loss: There is no parameter 'chance'; .* share"),
        ("loss:share=2", r"fault loss: share must lie in \[0, 1\]"),
        ("loss:share", "write loss:NAME=VALUE, not 'share'"),
        ("loss:share=many", "share must be a number"),
        ("node_killed:node=drive", "node must be one of controller, excitation, simulator"),
    ],
)
def test_a_bad_fault_is_refused_in_one_sentence(text, words):
    with pytest.raises(InputError, match=words):
        FaultPlan.parse(text)
