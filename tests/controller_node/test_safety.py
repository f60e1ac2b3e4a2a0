"""Safety functions of the controller: what never becomes a torque, and how a torque ends."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from controller_node.limits import SAFETY, check_hardware
from controller_node.real_time import RealTimeController
from controller_node.safety import Safety
from controller_node.supervised_law import SupervisedLaw
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import NEVER
from fjr_interface.ros.messages import to_descriptor
from fjr_kit.errors import InputError

MS = 1_000_000
TS = 1e-3
GAIN = 200.0 + 60.0 * 24.0
GROUP = ParameterGroup(*pd_filtered.CONTROLLER, *SAFETY)
RAMP, TIMEOUT = SAFETY["ramp_down_s"].default, SAFETY["position_timeout_s"].default


def checked(**given: Any) -> dict[str, Any]:
    return GROUP.check(given)


def law(*, real_time: bool = False, **given: Any) -> SupervisedLaw:
    return SupervisedLaw(checked(**given), real_time=real_time)


signals = st.lists(st.tuples(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)), max_size=60)


@given(signals, st.floats(0.1, 100.0))
def test_in_lockstep_the_default_torque_is_the_bare_laws_bit_by_bit(samples, limit):
    supervised = law(torque_limit_nm=limit)
    coefficients = pd_filtered.coefficients(checked(torque_limit_nm=limit))
    x, saturated = 0.0, 0
    for r, y in samples:
        x, torque = pd_filtered.step(x, r - y, coefficients)
        saturated += abs(torque) == limit
        assert supervised.torque(r, y) == torque
    assert supervised.saturated == saturated


values = st.floats(allow_nan=True, allow_infinity=True) | st.floats(-0.2, 0.2)


@given(st.lists(st.tuples(values, values, st.integers(0, 30)), min_size=1, max_size=80))
def test_whatever_comes_no_torque_breaks_a_limit(samples):
    limits = {"torque_limit_nm": 20.0, "torque_rate_limit_nm_s": 500.0}
    limits |= {"position_limit_rad": 0.1, "velocity_limit_rad_s": 50.0}
    supervised = law(real_time=True, **limits)
    before, tripped = 0.0, False
    for r, y, event in samples:
        if event == 0:
            supervised.trip("test")
        if event == 1:
            supervised.safety.release()
        torque = supervised.torque(r, y)
        assert math.isfinite(torque) and abs(torque) <= 20.0
        falling = supervised.safety.held and abs(torque) <= abs(before)
        assert falling or abs(torque - before) <= 500.0 * TS + 1e-9
        if not math.isfinite(y) or not math.isfinite(r) or abs(y) > 0.1:
            assert torque == 0.0 and supervised.safety.tripped
        tripped, before = tripped or supervised.safety.tripped is not None, torque
    assert tripped == (supervised.safety.trips > 0)


@pytest.mark.parametrize(
    ("given", "positions", "reason"),
    [
        ({}, [0.0, math.nan], "the position is nan"),
        ({}, [0.0, math.inf], "the position is inf"),
        ({}, [0.0, 0.2], "the position jumped by 0.2 rad, beyond position_jump_rad 0.1"),
        ({}, [0.05, -0.06], "the position jumped by -0.11 rad, beyond position_jump_rad 0.1"),
        ({"position_limit_rad": 0.02}, [0.01, -0.03], "position -0.03 rad beyond position_limit"),
        ({"velocity_limit_rad_s": 3.0}, [0.0, 0.02], "velocity 3.625 rad/s beyond velocity_limit"),
        ({"velocity_limit_rad_s": 3.0}, [0.0, *(0.004 * k for k in range(12))], "velocity 3.0"),
    ],
    ids=["nan", "inf", "jump", "jump back", "position", "jump by velocity", "velocity"],
)
def test_a_position_that_trips_gives_zero_torque_at_once_and_for_good(given, positions, reason):
    supervised = law(real_time=True, torque_soft_start_s=0.0, **given)
    torques = [supervised.torque(0.011, y) for y in positions]
    assert supervised.safety.tripped.startswith(reason), supervised.safety.tripped
    tripped = torques.index(0.0)
    assert tripped >= 1 and not any(torques[tripped:])
    assert [supervised.torque(0.01, 0.0) for _ in range(3000)] == [0.0] * 3000
    assert supervised.safety.trips == 1


def test_limits_that_are_given_guard_a_lockstep_too_but_a_jump_does_not():
    assert law(position_jump_rad=0.01).torque(0.01, 5.0) != 0.0
    supervised = law(position_limit_rad=0.5)
    assert supervised.torque(0.01, 0.0) == pytest.approx(GAIN * 0.01)
    assert supervised.torque(0.01, 0.6) == 0.0 and supervised.safety.tripped


def test_a_reference_that_is_no_number_trips_in_real_time():
    supervised = law(real_time=True)
    assert supervised.torque(math.nan, 0.0) == 0.0
    assert supervised.safety.tripped == "the reference is nan"


@pytest.mark.parametrize(("ramp_s", "samples"), [(0.05, 50), (0.0104, 11), (0.0, 1)])
def test_a_trip_takes_the_torque_down_by_a_line_in_the_stated_time(ramp_s, samples):
    supervised = law(ramp_down_s=ramp_s)
    full = supervised.torque(0.01, 0.0)
    supervised.trip("emergency stop")
    torques = [supervised.torque(0.01, 0.0) for _ in range(samples)]
    line = full * np.maximum(1.0 - np.arange(1, samples + 1) * TS / max(ramp_s, 1e-9), 0.0)
    np.testing.assert_allclose(torques, line, atol=1e-12)
    assert torques[-1] == 0.0 and supervised.safety.resting
    supervised.trip("another reason")
    assert supervised.safety.tripped == "emergency stop" and supervised.safety.trips == 1


def test_a_worse_trip_ends_a_ramp_at_once():
    supervised = law(position_limit_rad=0.5)
    supervised.torque(0.01, 0.0)
    supervised.trip("emergency stop")
    assert supervised.torque(0.01, 0.0) > 0.0
    assert supervised.torque(0.01, 0.6) == 0.0
    assert supervised.torque(0.01, 0.0) == 0.0


def test_after_a_release_the_torque_rises_softly_without_a_kick():
    supervised = law(torque_soft_start_s=0.2)
    supervised.torque(0.01, 0.0)
    supervised.trip("emergency stop")
    for _ in range(100):
        supervised.torque(0.01, 0.0)
    assert supervised.safety.release() and not supervised.safety.release()
    risen = [supervised.torque(0.01, 0.0) for _ in range(300)]
    # No kick of the derivative: only P acts on an error that has long been there.
    np.testing.assert_allclose(risen, 2.0 * np.minimum(np.arange(1, 301) / 200.0, 1.0), rtol=1e-9)


def test_a_trip_outlasts_runs():
    supervised = law()
    supervised.trip("emergency stop")
    supervised.begin_run(checked())
    assert supervised.torque(0.01, 0.0) == 0.0
    supervised.safety.release()
    supervised.begin_run(checked())
    assert supervised.torque(0.01, 0.0) == pytest.approx(GAIN * 0.01)


def test_in_real_time_a_run_begins_softly():
    supervised = law(real_time=True, torque_soft_start_s=0.1, d=0.0)
    torques = [supervised.torque(0.01, 0.0) for _ in range(200)]
    np.testing.assert_allclose(torques, 2.0 * np.minimum(np.arange(1, 201) / 100.0, 1.0))


def test_the_torque_rate_is_bounded_and_counted():
    supervised = law(torque_rate_limit_nm_s=1000.0, d=0.0)
    torques = [supervised.torque(0.02, 0.0) for _ in range(6)]
    np.testing.assert_allclose(torques, [1.0, 2.0, 3.0, 4.0, 4.0, 4.0])
    assert supervised.safety.saturated == 3


HARDWARE = {
    "torque_limit_nm": 20.0,
    "torque_rate_limit_nm_s": 1e4,
    "position_limit_rad": 0.3,
    "velocity_limit_rad_s": 5.0,
    "hardware": True,
    "confirm": "elbow",
}


def test_hardware_needs_all_limits_and_the_joints_name():
    check_hardware({**checked(**HARDWARE), "joint": "elbow"})
    check_hardware({**checked(), "joint": "elbow"})
    for missing in list(HARDWARE)[:4]:
        given = {name: value for name, value in HARDWARE.items() if name != missing}
        with pytest.raises(InputError, match=f"hardware needs finite limits; give {missing}."):
            check_hardware({**checked(**given), "joint": "elbow"})
    for wrong in ("", "knee"):
        with pytest.raises(InputError, match="hardware moves joint 'elbow'; confirm that"):
            check_hardware({**checked(**{**HARDWARE, "confirm": wrong}), "joint": "elbow"})


def test_every_safety_parameter_has_unit_and_range_where_it_is_a_number():
    for parameter in SAFETY:
        if isinstance(parameter.default, float):
            (span,) = to_descriptor(parameter).floating_point_range
            assert parameter.unit and span.from_value >= 0.0 < span.to_value


class Loop:
    """A controller in real time and its clock."""

    def __init__(self, **given: Any) -> None:
        values = checked(**{"torque_soft_start_s": 0.0, **given})
        self.values, self.law = values, law(real_time=True, **{**given, "torque_soft_start_s": 0.0})
        self.loop = RealTimeController(self.law, values)
        self.now = self.began = 0

    def play(self, *samples: int, r: float | None = 0.01, y: float = 0.0) -> list[float | None]:
        """Answer the positions of these samples, each at its time; 0 ms is where a run began."""
        torques = []
        for k in samples:
            self.now = max(self.now, self.began + k * MS)
            if r is not None:
                self.loop.reference(k * MS, r)
            answers = self.loop.position(self.now, k * MS, y)
            assert [stamp for stamp, _ in answers] in ([], [k * MS])
            torques.append(answers[0][1] if answers else None)
        return torques

    def begin(self) -> None:
        """Let the next run begin now."""
        self.began = self.now

    def wait(self, seconds: float) -> list[tuple[int, float]]:
        """Let time pass without a position; return what the controller says by itself."""
        self.now += round(seconds * 1e9)
        return self.loop.serve(self.now)


def test_a_missing_reference_is_the_one_before_and_counted():
    loop, same = Loop(), Loop()
    assert loop.play(1, r=None, y=0.2) == [0.0]  # without any reference: where it is
    missing = loop.play(2, y=0.2) + loop.play(3, r=None, y=0.2)
    same.play(1, r=0.2, y=0.2)
    assert missing == same.play(2, 3, y=0.2)
    assert (loop.loop.missing, loop.loop.answered, same.loop.missing) == (2, 3, 0)


def test_lost_repeated_and_reordered_positions_are_counted_and_answered_once():
    loop = Loop()
    answers = loop.play(1, 2, 2, 5, 4, 6)
    assert [a is None for a in answers] == [False, False, True, False, True, False]
    assert (loop.loop.answered, loop.loop.lost, loop.loop.stale) == (4, 2, 2)


def test_a_first_position_begins_a_run_also_if_it_is_not_the_very_first():
    loop = Loop()
    loop.play(*range(1, 40))
    for first in (1, 3):
        loop.begin()
        assert loop.play(first) == [pytest.approx(GAIN * 0.01)]
        assert (loop.loop.answered, loop.loop.lost) == (1, first - 1)
        loop.play(*range(first + 1, 41))


def test_a_run_that_is_joined_under_way_is_not_controlled():
    loop = Loop()
    assert loop.play(500, 501) == [None, None] and loop.loop.due_ns == NEVER
    assert loop.play(1) == [pytest.approx(GAIN * 0.01)]


def test_a_run_that_is_left_falls_and_the_next_one_begins_anew():
    loop = Loop()
    (full,) = loop.play(1)
    loop.play(*range(2, 13))
    loop.loop.leave_run(checked(p=100.0, torque_soft_start_s=0.0))
    falling = loop.play(*range(13, 80))
    assert falling[0] > falling[1] > 0.0 == falling[-1] and loop.law.safety.tripped is None
    assert loop.play(1) == [pytest.approx(full - 1.0)]


def test_without_positions_the_torque_falls_by_the_controllers_own_clock():
    loop = Loop()
    (*_, last) = loop.play(*range(1, 21))
    assert loop.wait(TIMEOUT - 1e-6) == [] and loop.law.safety.tripped is None
    said = [loop.wait(1e-6)]
    assert loop.law.safety.tripped == "no position for 0.1 s"
    for _ in range(100):
        said.append(loop.wait(TS))
    stamps, torques = zip(*(answer for answers in said for answer in answers), strict=True)
    assert stamps == tuple(range(21 * MS, 71 * MS, MS))
    np.testing.assert_allclose(torques, last * (1.0 - np.arange(1, 51) / 50.0), atol=1e-12)
    assert torques[-1] == 0.0 and loop.loop.due_ns == NEVER
    assert loop.play(70, 171, 172) == [None, 0.0, 0.0]  # what was said for is not answered again


def test_a_controller_that_slept_trips_when_it_wakes():
    loop = Loop()
    loop.play(*range(1, 21))
    loop.now += 500 * MS
    (torque,) = loop.play(21)
    assert loop.law.safety.tripped == "no position for 0.1 s"
    assert loop.play(*range(22, 90))[-1] == 0.0 < torque


def test_without_references_for_too_long_it_trips():
    loop = Loop(reference_timeout_s=0.02)
    loop.play(1)
    torques = loop.play(*range(2, 21), r=None)
    assert loop.law.safety.tripped is None and all(torques)
    assert loop.play(21, r=0.01) and loop.law.safety.tripped is None
    torques = loop.play(*range(22, 100), r=None)
    assert loop.law.safety.tripped == "no reference for 0.02 s" and torques[-1] == 0.0
    assert torques[20 + 49] == 0.0 < torques[20 + 48]


def test_stamps_that_jump_trip():
    loop = Loop()
    loop.play(*range(1, 21))
    loop.play(21, 80)  # lost samples are no jump
    assert loop.law.safety.tripped is None
    loop.loop.position(loop.now + MS, 1081 * MS, 0.0)
    assert loop.law.safety.tripped == "the stamps jumped by 0.999 s"


def test_an_emergency_stop_while_positions_stop_still_reaches_zero():
    loop = Loop()
    loop.play(*range(1, 21))
    loop.law.trip("emergency stop")
    loop.play(21, 22)
    loop.wait(TIMEOUT)
    torques = [torque for _ in range(60) for _, torque in loop.wait(TS)]
    assert torques[-1] == 0.0 and loop.law.safety.tripped == "emergency stop"


def test_a_release_arms_the_watchdog_again():
    loop = Loop()
    loop.play(1)
    loop.wait(1.0)
    for _ in range(99):
        loop.wait(TS)
    assert loop.loop.due_ns == NEVER and loop.loop.release(loop.now)
    assert loop.play(1190) and not loop.law.safety.held
    loop.wait(TIMEOUT)
    assert loop.law.safety.trips == 2
    assert not Loop().loop.release(0)


def test_an_unreadable_position_is_zero_torque_at_once():
    loop = Loop()
    loop.play(*range(1, 21))
    assert loop.loop.trip(loop.now, "a position is unreadable", at_once=True) == [(21 * MS, 0.0)]
    assert loop.loop.due_ns == NEVER


def test_after_the_last_sample_it_falls_without_a_trip():
    loop = Loop()
    loop.loop.end(20)
    loop.play(*range(1, 21))
    assert loop.wait(1.0) == [] and loop.law.safety.tripped is None
    assert loop.play(*range(21, 90), r=None)[-1] == 0.0
    assert loop.law.safety.tripped is None and loop.play(1) == [pytest.approx(GAIN * 0.01)]


def test_with_hardware_the_torque_falls_after_the_last_sample_even_without_positions():
    loop = Loop(hardware=True)
    loop.loop.end(20)
    loop.play(*range(1, 21))
    loop.wait(TIMEOUT)
    torques = [torque for _ in range(60) for _, torque in loop.wait(TS)]
    assert torques[-1] == 0.0 and loop.law.safety.tripped is None


def test_a_controller_that_ends_takes_the_torque_down_first():
    loop = Loop()
    loop.loop.fall(0)
    assert loop.loop.due_ns == NEVER  # nothing to take down
    loop = Loop()
    loop.play(*range(1, 21))
    loop.loop.fall(loop.now)
    torques = []
    while loop.loop.due_ns != NEVER:
        torques += [torque for _, torque in loop.wait(TS)]
    assert len(torques) == 50 and torques[-1] == 0.0 and loop.law.safety.tripped is None


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 300), values), max_size=60))
def test_whatever_comes_when_the_loop_ends_at_zero_and_says_each_stamp_once(events):
    loop = Loop(torque_limit_nm=30.0)
    said: list[tuple[int, float]] = []
    for k in range(1, 12):
        loop.loop.reference(k * MS, 0.01)
        said += loop.loop.position(k * MS, k * MS, 0.0)
    now = 11 * MS
    for passed_ms, sample, value in events:
        now += passed_ms * MS
        said += loop.loop.serve(now)
        said += loop.loop.position(now, (sample + 12) * MS, value)
    while loop.loop.due_ns != NEVER:
        now = loop.loop.due_ns
        said += loop.loop.serve(now)
    assert said[-1][1] == 0.0
    stamps = [stamp for stamp, _ in said]
    assert stamps == sorted(set(stamps))
    assert all(math.isfinite(torque) and abs(torque) <= 30.0 for _, torque in said)


def test_safety_by_itself_counts_a_trip_once():
    safety = Safety(checked(), real_time=False)
    assert not safety.needed and not safety.held
    safety.trip("a")
    safety.trip("b")
    assert safety.needed and (safety.tripped, safety.trips) == ("a", 1)
