"""Properties of the controller in real time that hold for any sequence of messages and times.

A machine drives it with hostile positions, references, stamps, gaps, releases, run changes and
trips, and checks after each step what it may have said.
"""

from __future__ import annotations

import math
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from controller_node import pd_filtered
from controller_node.limits import SAFETY
from controller_node.real_time import RealTimeController
from controller_node.supervised_law import SupervisedLaw
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import NEVER

GROUP = ParameterGroup(*pd_filtered.CONTROLLER, *SAFETY)
MS = 1_000_000
TS = 1e-3
TORQUE, RATE, POSITION, VELOCITY = 20.0, 400.0, 0.3, 4.0
JUMP, REFERENCE, STEP = 0.05, 2.0, 0.1
WINDOW, TIMEOUT, RAMP, SOFT = 0.005, 0.1, 0.05, 0.2
VALUES = GROUP.check(
    {
        "hardware": True,
        "torque_limit_nm": TORQUE,
        "torque_rate_limit_nm_s": RATE,
        "position_limit_rad": POSITION,
        "velocity_limit_rad_s": VELOCITY,
        "velocity_window_s": WINDOW,
        "position_jump_rad": JUMP,
        "reference_limit_rad": REFERENCE,
        "reference_step_rad": STEP,
        "position_timeout_s": TIMEOUT,
        "reference_timeout_s": TIMEOUT,
        "ramp_down_s": RAMP,
        "torque_soft_start_s": SOFT,
    }
)
ROUNDING = 1e-9
FIRST = 10  # a run may begin with any of its first samples
DRIFT = 1.01  # of two clocks that count as one

numbers = st.one_of(
    st.floats(-0.05, 0.05),
    st.floats(-0.5, 0.5),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([1e300, -1e300, 1.7e308, -1.7e308, math.nan, math.inf, 0.0, POSITION, 3.0]),
)
strides = st.one_of(
    st.just(1), st.integers(1, 12), st.integers(-20, 200), st.sampled_from([90, 95, 10**6, 10**13])
)
passed = st.one_of(st.just(MS), st.integers(0, 2 * MS), st.integers(0, 150 * MS), st.just(0))


class Hostile(RuleBasedStateMachine):
    """The controller, its clock, and what is known of it without looking into it."""

    @initialize(soft=st.sampled_from([0.0, SOFT]), endless=st.booleans())
    def start(self, soft: float, endless: bool) -> None:
        self.values = {**VALUES, "torque_soft_start_s": soft}
        if endless:  # the rate alone keeps the torque from stepping
            self.values["velocity_limit_rad_s"] = math.inf
        self.velocity = self.values["velocity_limit_rad_s"]
        self.law = SupervisedLaw(self.values, real_time=True)
        self.loop = RealTimeController(self.law, self.values)
        self.now = 10**9
        self.stamp = 0  # of the newest position that was sent
        self.torque, self.said_ns, self.said_stamp = 0.0, self.now - MS, -MS
        self.untripped: list[tuple[int, int, float, int]] = []  # instant, stamp, position, run
        self.run, self.left = 0, True
        self.reason: str | None = None
        self.zero_by = NEVER
        self.soft_ns: int | None = None  # since when the torque rises softly from zero
        self.position, self.joint = 0.0, 0.0
        self.references: dict[int, float] = {}

    # What is checked of every torque.

    def hear(self, answers: list[tuple[int, float]], new_run: bool = False) -> None:
        for stamp, torque in answers:
            assert math.isfinite(torque) and abs(torque) <= TORQUE + ROUNDING
            least_s = (self.now - self.said_ns) * 1e-9
            if not new_run:
                least_s = min(least_s, (stamp - self.said_stamp) * 1e-9)
            falls = abs(torque) <= abs(self.torque) + ROUNDING and torque * self.torque >= 0.0
            changes = abs(torque - self.torque) <= RATE * least_s + ROUNDING
            assert (falls and self.law.safety.held) or (changes and self.reason is None)
            if self.now >= self.zero_by:
                assert torque == 0.0
            if self.soft_ns is not None:
                rise = (self.now - self.soft_ns) * 1e-9 / SOFT
                assert abs(torque) <= TORQUE * rise + ROUNDING
            self.torque, self.said_ns, self.said_stamp = torque, self.now, stamp
        self.look()

    def look(self) -> None:
        """A trip has a reason, which stays until somebody releases it."""
        tripped = self.law.safety.tripped
        if self.reason is not None:
            assert tripped == self.reason
        elif tripped is not None:
            self.zero_by = self.now + round((TIMEOUT + RAMP + 2 * TS) * 1e9)
            self.untripped.clear()
        self.reason = tripped

    # What the world does.

    def let_pass(self, duration_ns: int) -> None:
        """Let the controller's clock serve what is due meanwhile."""
        until = self.now + duration_ns
        while self.loop.due_ns <= until:
            self.now = max(self.now, self.loop.due_ns)
            self.hear(self.loop.serve(self.now))
        self.now = until

    def send(self, stamp: int, value: float) -> None:
        before, held = self.stamp, self.law.safety.held
        reference = self.references.pop(stamp, None)
        answers = self.loop.position(self.now, stamp, value)
        begins = stamp <= self.said_stamp or (self.left and stamp <= FIRST * MS)
        new_run = bool(answers) and begins
        self.run += new_run
        self.left = self.left and not new_run
        assert len(answers) <= 1 and all(said == stamp for said, _ in answers)
        self.hear(answers, new_run)
        if not answers:
            return
        self.stamp = stamp if new_run else max(stamp, before)
        if not (math.isfinite(value) and abs(value) <= POSITION):
            assert self.reason is not None and answers[0][1] == 0.0
        if reference is not None and not abs(reference) <= REFERENCE:
            assert self.reason is not None
        if self.reason is None and not held:
            self.check_motion(stamp, value)

    def check_motion(self, stamp: int, value: float) -> None:
        last = len(self.untripped) - 1
        for k in {*range(0, last, 7), last} - {-1}:
            then, stamp_then, y, run = self.untripped[k]
            moved = abs(value - y)
            clock_s = (self.now - then) * 1e-9
            stamps_s = (stamp - stamp_then) * 1e-9 if run == self.run else math.inf
            by_clock_s = DRIFT * clock_s + 2.0 * TIMEOUT
            if run == self.run:  # stamps keep pace with the clock
                assert stamps_s <= by_clock_s + ROUNDING
            assert moved <= self.velocity * (by_clock_s + 2.0 * WINDOW) + ROUNDING
            assert moved <= self.velocity * (stamps_s + 2.0 * WINDOW) + ROUNDING
            if k == last:
                samples = max(min(clock_s, stamps_s) / TS, 1.0)
                assert moved <= JUMP * samples + ROUNDING
        self.untripped.append((self.now, stamp, value, self.run))
        del self.untripped[:-150]

    @rule(duration=passed)
    def wait(self, duration: int) -> None:
        self.let_pass(duration)

    @rule(duration=st.integers(0, 2_000 * MS))
    def sleep(self, duration: int) -> None:
        """The controller's process has no core."""
        self.now += duration
        self.zero_by = (
            NEVER
            if self.zero_by == NEVER
            else max(self.zero_by, self.now + round((TIMEOUT + RAMP + 2 * TS) * 1e9))
        )

    @rule(
        samples=st.integers(1, 150),
        reference=st.floats(-0.05, 0.05) | st.none(),
        speed=st.sampled_from([0.0, 0.0, 0.0, 0.0, 1.0, -3.0, 5.0]),
        stride=st.sampled_from([1, 1, 1, 1, 5, 5, 90]),
        passed_ns=st.sampled_from([MS, MS, MS, MS, MS // 10, 0, 10 * MS]),
    )
    def positions(
        self, samples: int, reference: float | None, speed: float, stride: int, passed_ns: int
    ) -> None:
        """A joint at some speed, with stamps that run as fast as the clock, faster or slower."""
        for _ in range(samples):
            self.let_pass(passed_ns)
            stamp = self.stamp + stride * MS
            self.joint += speed * passed_ns * 1e-9
            if abs(self.joint) > 0.25:
                self.joint = 0.0
            if reference is not None:
                self.refer(stamp, reference)
            self.send(stamp, self.joint)
            self.stamp = max(self.stamp, stamp) if stride == 1 else self.stamp

    @rule(stride=strides, value=numbers, passed_ns=passed, reference=numbers | st.none())
    def position_anyhow(
        self, stride: int, value: float, passed_ns: int, reference: float | None
    ) -> None:
        self.let_pass(passed_ns)
        stamp = self.stamp + stride * MS
        if reference is not None:
            self.refer(stamp, reference)
        self.send(stamp, value)

    @rule(sample=st.integers(-5, 30), value=st.floats(-0.3, 0.3))
    def position_of_the_beginning(self, sample: int, value: float) -> None:
        """A stray old stamp, or a new run."""
        self.send(sample * MS, value)

    def refer(self, stamp: int, value: float) -> None:
        self.references[stamp] = value
        self.loop.reference(stamp, value)

    @rule(ahead=st.integers(-5, 300), value=numbers)
    def reference(self, ahead: int, value: float) -> None:
        self.refer(self.stamp + ahead * MS, value)

    @rule()
    def leave_run(self) -> None:
        self.references.clear()
        self.left = True
        self.loop.leave_run(self.values)

    @rule(samples=st.integers(0, 500))
    def experiment(self, samples: int) -> None:
        self.loop.end(samples)

    @rule(at_once=st.booleans())
    def trip(self, at_once: bool) -> None:
        """The emergency stop, or a message that cannot be read."""
        self.hear(self.loop.trip(self.now, "stop", at_once=at_once))
        assert self.reason is not None

    @rule(samples=st.integers(20, 60), sign=st.sampled_from([1, -1]))
    def run_well(self, samples: int, sign: int) -> None:
        """What comes next finds a torque and nothing tripped."""
        self.joint = 0.0
        self.release()
        self.positions(samples, sign * 0.05, 0.0, 1, MS)

    # One limit is passed, nothing else: no other guard may stand in for the one that is asked.

    @rule(ahead=st.integers(14, 99) | st.integers(14, 10**6))
    def well_then_one_position_ahead(self, ahead: int) -> None:
        self.leave_run()  # in a new run no earlier lateness excuses the stamps
        self.stamp = 0
        self.run_well(30, 1)
        going = self.reason is None and not self.law.safety.held
        self.let_pass(MS)
        self.send(self.stamp + ahead * MS, 0.0)
        assert not going or self.reason is not None

    @rule(stride=st.integers(4, 8))
    def well_then_stamps_run_fast(self, stride: int) -> None:
        self.run_well(30, -1)
        for _ in range(150):
            self.let_pass(MS)
            stamp = self.stamp + stride * MS
            self.refer(stamp, 0.0)
            self.send(stamp, 0.0)

    @rule(
        beyond=st.sampled_from([1e300, -1e308, 1.1 * REFERENCE, -1.1 * REFERENCE, math.nan]),
    )
    def well_then_an_absurd_reference(self, beyond: float) -> None:
        self.run_well(30, 1)
        self.let_pass(MS)
        self.refer(self.stamp + MS, beyond)
        self.send(self.stamp + MS, 0.0)

    @rule(sign=st.sampled_from([1, -1]))
    def well_then_slowly_out_of_range(self, sign: int) -> None:
        self.run_well(30, sign)
        for k in range(1, 130):
            self.let_pass(MS)
            self.refer(self.stamp + MS, 0.05 * sign)
            self.send(self.stamp + MS, sign * 3e-3 * k)

    @rule()
    def release(self) -> None:
        was, self.reason = self.reason, None
        assert self.loop.release(self.now) == (was is not None)
        assert self.law.safety.tripped is None
        self.zero_by = NEVER
        if was is not None:
            self.untripped.clear()
            soft = self.values["torque_soft_start_s"] > 0.0 and self.torque == 0.0
            self.soft_ns = self.said_ns if soft else None

    @invariant()
    def what_trips_is_counted(self) -> None:
        if hasattr(self, "law"):
            assert self.law.safety.trips >= (self.reason is not None)

    def teardown(self) -> None:
        """Whatever was: without messages the torque ends at zero, and stays there."""
        if not hasattr(self, "law"):
            return
        self.loop.fall(self.now)
        self.let_pass(10**9)
        assert self.torque == 0.0 and self.loop.due_ns == NEVER


Hostile.TestCase.settings = settings(
    max_examples=100, stateful_step_count=30, deadline=None, report_multiple_bugs=False
)
TestHostile = Hostile.TestCase


class Stream:
    """Positions and references of a joint at rest, played to a controller."""

    def __init__(self, **given: Any) -> None:
        values = GROUP.check({**VALUES, **given})
        self.law = SupervisedLaw(values, real_time=True)
        self.loop = RealTimeController(self.law, values)
        self.now = 0

    def play(self, stamp_ms: int, at_ms: float | None = None, y: float = 0.0, r: float = 0.01):
        """Return the torque that answers a position, None if none does."""
        self.now = max(self.now, round((stamp_ms if at_ms is None else at_ms) * MS))
        answers = self.loop.serve(self.now)
        self.loop.reference(stamp_ms * MS, r)
        answers += self.loop.position(self.now, stamp_ms * MS, y)
        return answers[-1][1] if answers else None


@given(
    st.lists(st.tuples(st.floats(0.0, 0.09), st.integers(1, 9)), min_size=1, max_size=200),
    st.floats(0.999, 1.001),
)
def test_positions_that_only_come_late_or_get_lost_trip_nothing(samples, drift):
    stream, k, lost = Stream(), 0, 0
    for lateness, stride in samples:
        k += stride
        lost += stride - 1
        assert stream.play(k, (k * TS * drift + lateness) * 1e3) is not None
    assert stream.law.safety.trips == 0
    assert stream.loop.lost == lost


def test_after_an_absurd_position_and_a_release_the_velocity_limit_is_alive():
    stream = Stream(position_limit_rad=math.inf, position_jump_rad=math.inf)
    for k in range(1, 20):
        stream.play(k)
    for k, absurd in enumerate([1e308, -1e308, 1e308], 20):
        assert stream.play(k, y=absurd) == 0.0
    stream.loop.release(stream.now)
    for k in range(23, 60):
        stream.play(k)
    assert stream.law.safety.tripped is None
    for k in range(60, 100):
        stream.play(k, y=2.0 * VELOCITY * TS * (k - 60))
    assert stream.law.safety.tripped.startswith("velocity ")


def test_stamps_that_run_fast_trip():
    for stride in (2, 5, 90):
        stream = Stream()
        stream.play(1)
        for k in range(2, 200):
            stream.play(k * stride, k)
        assert "the stamps " in stream.law.safety.tripped
        assert not stream.law.safety.trips > 1


def test_one_position_ahead_of_the_clock_trips_and_the_torque_goes_to_zero():
    stream = Stream(torque_soft_start_s=0.0, torque_rate_limit_nm_s=1e6)
    torques = [stream.play(k) for k in range(1, 50)]
    before = torques[-1]
    assert before > 0.0
    assert stream.play(50 + 95, 50) is None
    assert stream.law.safety.tripped == "the stamps jumped by 0.094 s"
    after = [stream.play(k, r=0.01) for k in range(51, 160)]
    said = [torque for torque in after if torque is not None]
    assert len(said) > 60 and 0.0 < said[0] <= before and said[-1] == 0.0


def test_stamps_that_have_moved_are_followed_after_a_release():
    stream = Stream()
    for k in range(1, 50):
        stream.play(k)
    torques = [stream.play(1000 + k, k) for k in range(50, 200)]
    assert stream.law.safety.tripped == "the stamps jumped by 0.999 s" and torques[-1] == 0.0
    stream.loop.release(stream.now)
    assert stream.play(1200, 200) > 0.0 and stream.play(1201, 201) > 0.0
    assert stream.law.safety.tripped is None


def test_after_a_release_on_the_way_to_zero_missing_positions_trip_again():
    stream = Stream(torque_soft_start_s=0.0)
    for k in range(1, 50):
        stream.play(k)
    assert stream.play(50 + 50, 50) is None  # ahead of the clock: the own clock says the torques
    stream.loop.serve(stream.now + 2 * MS)
    stream.loop.release(stream.now + 2 * MS)
    assert stream.law.safety.tripped is None
    stream.loop.serve(stream.now + 3 * MS + round(TIMEOUT * 1e9))
    assert stream.law.safety.tripped == f"no position for {TIMEOUT:g} s"


def test_an_absurd_reference_trips_and_winds_nothing_up():
    stream, same = Stream(), Stream()
    for k in range(1, 50):
        assert stream.play(k) == same.play(k)
    for absurd in (1e300, 2.5, 0.15):
        stream.play(50, r=absurd)
        assert "reference" in stream.law.safety.tripped, absurd
        stream = Stream()
        for k in range(1, 50):
            stream.play(k)
    same.play(50, r=1e300)
    for k in range(51, 200):
        same.play(k)
    same.loop.release(same.now)
    torques = [same.play(k) for k in range(200, 600)]
    assert same.law.safety.trips == 1
    assert max(torques) <= VALUES["p"] * 0.01 + ROUNDING


def test_after_a_torque_that_was_said_late_the_rate_counts_from_then():
    stream = Stream(torque_soft_start_s=0.0)
    stream.play(1, r=0.0)
    stream.loop.leave_run(VALUES)
    late = stream.now + round((TIMEOUT + 0.9 * TS) * 1e9)  # the process had no core
    assert [torque for _, torque in stream.loop.serve(late)] == [0.0]
    stream.loop.reference(MS, 0.05)
    ((_, torque),) = stream.loop.position(late + MS // 10, MS, 0.0)
    assert 0.0 < torque <= RATE * 0.1 * TS + ROUNDING


def test_a_stray_old_stamp_or_a_new_run_does_not_step_the_torque():
    for leaves in (False, True):
        stream = Stream(torque_soft_start_s=0.0)
        torque = 0.0
        for k in range(1, 50):
            torque = stream.play(k)
        assert torque > 5.0 * RATE * TS
        if leaves:
            stream.loop.leave_run(VALUES)
        after = stream.loop.position(stream.now + MS, 2 * MS, 0.0)[0][1]
        assert abs(after - torque) <= RATE * TS + ROUNDING
