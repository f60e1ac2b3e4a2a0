"""Timing of a loop from timelines that are drawn by hand, and the verdict on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_messages import PERIOD_NS, RATE, grid, loop, messages

from fjr_bringup.rehearsal.limits import LIMITS, LimitsFile, judge
from fjr_bringup.rehearsal.timing import EDGES_S, RECORD, Distribution, loop_timing, topic_timing
from fjr_kit.errors import InputError


def verdict(*signals, **limits):
    return {c.name: c for c in judge(loop_timing(*signals, RATE), None, LIMITS.check(limits))}


def failed(*signals, **limits):
    return {name for name, check in verdict(*signals, **limits).items() if not check.passed}


def test_a_loop_that_runs_well_is_go():
    timing = loop_timing(*loop(), RATE)
    assert timing.position.rate_hz == pytest.approx(RATE)
    assert timing.position.jitter.worst == 0.0
    assert timing.latency.p50 == pytest.approx(0.6e-3)
    assert timing.delay.worst == pytest.approx(0.6e-3)
    assert (timing.late, timing.unanswered, timing.late_references) == (0, 0, 0)
    assert timing.torque.greatest == 3.0
    assert all(check.passed for check in judge(timing, None, LIMITS.defaults()))


@given(
    st.lists(st.integers(0, 99), unique=True, max_size=20),
    st.lists(st.integers(0, 99), unique=True, max_size=20),
)
def test_every_lost_and_every_repeated_sample_is_counted(lost, twice):
    kept = [k for k in range(100) if k not in lost]
    sent = [k for k in kept for _ in range(2 if k in twice else 1)]
    timing = topic_timing(messages(grid(100)[sent]), RATE)
    inner = [k for k in lost if kept and kept[0] < k < kept[-1]]
    assert timing.lost == len(inner)
    assert timing.repeated == len(set(twice) & set(kept))
    assert timing.unordered == timing.clock_jumps == 0
    if inner:
        assert timing.lost_at_s == pytest.approx((min(inner) + 1) / RATE)


def test_swapped_messages_are_out_of_order_and_not_lost():
    y = messages(grid(100))
    y["stamp"][[40, 41]] = y["stamp"][[41, 40]]
    timing = topic_timing(y, RATE)
    assert (timing.unordered, timing.lost, timing.repeated) == (1, 0, 0)


@pytest.mark.parametrize("jump_s", [-0.1, 0.1, 3600.0])
def test_a_jump_of_the_stamps_is_not_taken_for_lost_samples(jump_s):
    y = messages(grid(300))
    y["stamp"][150:] += round(jump_s * 1e9)
    timing = topic_timing(y, RATE)
    assert (timing.clock_jumps, timing.lost, timing.repeated) == (1, 0, 0)
    assert timing.jitter.worst == 0.0


def test_a_stall_that_is_caught_up_is_late_and_no_jump():
    lateness = np.zeros(300, np.int64)
    lateness[100:200] = 200_000_000 - PERIOD_NS * np.arange(100)
    r, _, u = loop(300)
    y = messages(grid(300), lateness)
    assert topic_timing(y, RATE).clock_jumps == 0
    timing = loop_timing(r, y, u, RATE)
    assert timing.lateness.worst == pytest.approx(0.2)


@given(st.integers(0, 50_000_000), st.lists(st.integers(0, 900_000), min_size=10, max_size=200))
def test_delay_is_lateness_plus_latency(offset_ns, lateness):
    """Whatever the unknown origin of the stamps, and exact once one message was punctual."""
    lateness = np.array([0, *lateness])
    stamps = grid(lateness.size)
    y, u = messages(stamps, offset_ns + lateness), messages(stamps, offset_ns + 1_000_000)
    timing = loop_timing(messages(stamps), y, u, RATE)
    np.testing.assert_allclose(timing.delay_s, 1.1e-3, atol=1e-12)


def test_quantiles_and_histogram_of_a_distribution():
    found = Distribution.of(np.arange(1, 1001) * 1e-5)
    assert found.p50 == pytest.approx(5.01e-3, rel=3e-3)
    assert found.p99 == pytest.approx(9.91e-3, rel=2e-3)
    assert found.worst == pytest.approx(1e-2)
    assert found.histogram.sum() == found.count == 1000
    first = np.flatnonzero(found.histogram)[0]
    assert EDGES_S[first] <= 1e-5 <= EDGES_S[first + 1]


def test_nothing_heard_is_no_go():
    empty = np.zeros(0, RECORD)
    assert {"answered", "rate_error", "latency"} <= failed(empty, empty, empty)
    r, y, _ = loop()
    assert "answered" in failed(r, y, empty)


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda r, y, u: (r, np.delete(y, 70), u), {"lost"}),
        (lambda r, y, u: (r, y, np.delete(u, 70)), {"lost", "unanswered"}),
        (lambda r, y, u: (r, np.insert(y, 70, y[70]), u), {"repeated"}),
        (lambda r, y, u: (r, y, messages(grid(1000), 2_500_000)), {"latency", "late"}),
        (lambda r, y, u: (messages(grid(1000), 100_000), y, u), {"late_references"}),
        (lambda r, y, u: (r, messages(grid(1000), 0, value=np.nan), u), {"not_finite"}),
        (lambda r, y, u: (r, messages(grid(1000), 0, -5_000), u), {"clocks"}),
    ],
)
def test_each_kind_of_damage_has_its_reason(damage, reason):
    assert failed(*damage(*loop())) == reason


def test_limits_of_motion_and_of_time_can_be_set():
    assert failed(*loop(), torque_nm=2.9) == {"torque"}
    assert failed(*loop(), position_rad=0.05) == {"position"}
    assert failed(*loop(), latency_p99_s=5e-4) == {"latency"}
    lost = verdict(loop()[0], np.delete(loop()[1], 70), loop()[2], lost=1)["lost"]
    assert lost.passed and "1 of position" in lost.sentence


def test_limits_file(tmp_path: Path):
    file = tmp_path / "limits.yaml"
    file.write_text(
        "/rig/rehearsal:\n  ros__parameters: {latency_p99_s: 1.0e-3, lost: 2}\n"
        "/rig/controller:\n  ros__parameters: {torque_limit_nm: 20.0}\n"
    )
    loaded = LimitsFile.load(file)
    assert loaded.limits == {**LIMITS.defaults(), "latency_p99_s": 1e-3, "lost": 2}
    assert loaded.controller == {"torque_limit_nm": 20.0}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("/rig/rehearsal: {ros__parameters: {lotency_p99_s: 1.0}}", "did you mean latency_p99_s"),
        ("/rig/rehearsal: {ros__parameters: {lost: -1}}", "lost must lie in"),
        ("/rig/simulator: {ros__parameters: {k1: 1.0}}", "nodes are /rig/rehearsal, /rig/contr"),
    ],
)
def test_a_bad_limits_file_is_refused_in_one_sentence(tmp_path, text, words):
    file = tmp_path / "limits.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=words):
        LimitsFile.load(file)
