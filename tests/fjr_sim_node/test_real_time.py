"""The simulated drive in real time, without a clock: its motion and its counts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from controller_node.limits import SAFETY
from controller_node.real_time import RealTimeController
from controller_node.supervised_law import SupervisedLaw
from excitation_node import multisine
from fjr_interface.experiment import Experiment
from fjr_interface.parameters import ParameterGroup
from fjr_interface.real_time import NEVER, Histogram
from fjr_kit.errors import InputError
from fjr_sim_node import plant
from fjr_sim_node.drive.real_time import TORQUE_TIMEOUT, PlainWire, RealTimeDrive
from fjr_sim_node.simulation import rig
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

MS = 1_000_000
EXPERIMENT = {"base_frequency_hz": 5.0, "f_min_hz": 5.0, "f_max_hz": 40.0, "transient_periods": 0}


def described(rate: float = 1000.0) -> Experiment:
    values = multisine.EXCITATION.check({**EXPERIMENT, "sample_rate_hz": rate})
    controller = pd_filtered.CONTROLLER.check({"sample_rate_hz": rate})
    return multisine.describe(values, 0, 0, pd_filtered.describe(controller))


def values(**given: Any) -> dict[str, Any]:
    timeout = given.pop("timeout", TORQUE_TIMEOUT.default)
    return {**SIMULATOR.check(given), TORQUE_TIMEOUT.name: timeout}


def drive(start_ns: int = 0, **given: Any) -> RealTimeDrive:
    made = RealTimeDrive(values(**given), described())
    made.start(start_ns)
    return made


def played(given: dict[str, Any], late_ns: int) -> np.ndarray:
    """Return the positions of a closed loop whose torque comes late_ns after each position."""
    experiment = described(given.get("sample_rate_hz", 1000.0))
    rate = experiment.sample_rate_hz
    group = ParameterGroup(*pd_filtered.CONTROLLER, *SAFETY)
    law = group.check({"sample_rate_hz": rate, "torque_soft_start_s": 0.0})
    loop = RealTimeController(SupervisedLaw(law, real_time=True), law)
    reference = multisine.reference(experiment)
    for stamp, r in zip(experiment.stamps_ns.tolist(), reference, strict=True):
        loop.reference(stamp, r)
    made = RealTimeDrive(values(**given), experiment)
    made.start(17)
    positions = []
    while not made.over:
        now = made.due_ns
        for stamp, position, _ in made.measure(now):
            positions.append(position)
            ((_, torque),) = loop.position(now, stamp, position)
            made.command(now + late_ns, stamp, torque)
    assert loop.answered == made.samples == made.torques == len(positions)
    assert (loop.missing, loop.lost, loop.stale, made.overruns) == (0, 0, 0, 0)
    return np.array(positions)


@pytest.mark.parametrize(
    "given",
    [
        {"noise_std_rad": 1e-4},
        {"sample_rate_hz": 700.0, "k1": 0.0},
        {"actuator_lag.time_constant_s": 1e-3, "torque_saturation.limit_nm": 5.0},
    ],
    ids=["1 kHz, noise", "700 Hz: Ts is no whole number of ns", "lag and saturation"],
)
def test_without_delay_the_motion_is_that_of_the_lockstep(given):
    experiment = described(given.get("sample_rate_hz", 1000.0))
    batch = run_realization(SIMULATOR.check(given), experiment)
    np.testing.assert_allclose(played(given, 0), batch.position, atol=1e-9)


@pytest.mark.parametrize(
    ("effect_s", "late_ns"), [(0.0, 400_000), (0.0004, 0), (0.002, 300_000)], ids=str
)
def test_a_late_torque_acts_as_the_same_delay_in_the_drive(effect_s, late_ns):
    delay = {"delay.time_s": effect_s + late_ns * 1e-9}
    batch = run_realization(SIMULATOR.check(delay), described())
    np.testing.assert_allclose(
        played({"delay.time_s": effect_s}, late_ns), batch.position, atol=1e-9
    )


@given(st.integers(1, 999_999), st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_a_torque_that_comes_within_a_sample_splits_the_hold(at_ns, first, second):
    made = drive()
    list(made.measure(MS))
    made.command(MS, MS, first)
    made.command(MS + at_ns, MS, second)
    ((_, position, _),) = made.measure(2 * MS)
    state, p = rig.at_rest(), plant.coefficients(values())
    rig.hold(state, 0.0, 1e-3, p, None)
    rig.hold(state, first, at_ns * 1e-9, p, None)
    rig.hold(state, second, (MS - at_ns) * 1e-9, p, None)
    assert position == pytest.approx(state[rig.MOTOR], abs=1e-15)


def test_samples_that_are_due_together_are_those_of_their_instants():
    one_by_one, at_once = drive(), drive()
    for made in (one_by_one, at_once):
        list(made.measure(MS))
        made.command(MS, MS, 10.0)
    single = [next(iter(one_by_one.measure(k * MS))) for k in range(2, 30)]
    assert list(at_once.measure(29 * MS)) == single
    assert (one_by_one.overruns, at_once.overruns) == (0, 26)  # the first of 28 are late


def test_the_drive_lets_go_when_no_torque_comes_and_takes_the_next_one():
    made, holding = drive(timeout=0.005), drive(timeout=math.inf)
    for each in (made, holding):
        list(each.measure(MS))
        each.command(MS, MS, 10.0)
    before, after = ([y for _, y, _ in each.measure(12 * MS)] for each in (made, holding))
    assert before[:5] == after[:5] and before[5] < after[5]
    assert (made.let_go, holding.let_go) == (1, 0)
    made.command(12 * MS, 12 * MS, 10.0)
    list(made.measure(15 * MS))
    assert made.let_go == 1
    list(made.measure(30 * MS))
    assert made.let_go == 2


@pytest.mark.parametrize("torque", [math.nan, math.inf])
def test_a_torque_that_is_no_number_makes_the_drive_let_go(torque):
    made, idle = drive(), drive()
    for each in (made, idle):
        list(each.measure(MS))
    made.command(MS, MS, torque)
    assert list(made.measure(5 * MS)) == list(idle.measure(5 * MS))
    assert made.let_go == 1


def test_a_torque_before_the_first_sample_or_after_the_last_is_of_another_run():
    made = drive()
    made.command(1000, 5 * MS, 1e6)
    last = [y for _, y, _ in made.measure(NEVER - 1)][-1]
    assert made.over and made.torques == 0 and last == 0.0
    made.command(NEVER, MS, 1.0)
    assert made.torques == 0


def test_latency_is_that_between_position_and_torque():
    made = drive()
    list(made.measure(MS + 50_000))
    made.command(MS + 350_000, MS, 0.0)
    list(made.measure(2 * MS))
    made.command(5 * MS, 2 * MS, 0.0)
    assert made.latency.worst_ns == 3 * MS and made.late_torques == 1
    assert made.latency.quantile_s(0.5) == pytest.approx(3e-4, abs=1.01e-5)
    assert made.lateness.worst_ns == 50_000


def test_a_motion_that_diverges_is_an_input_error():
    made = drive()
    list(made.measure(MS))
    made.command(MS, MS, 1e300)
    with pytest.raises(InputError, match="The simulated motion diverges at 0"):
        list(made.measure(10 * MS))


@given(st.lists(st.integers(0, 300_000_000), min_size=1), st.floats(0.0, 1.0))
def test_quantiles_of_a_histogram_are_those_of_the_durations_to_a_bin(durations, share):
    histogram = Histogram()
    for duration in durations:
        histogram.add(duration)
    assert histogram.counts.sum() == len(durations) and histogram.worst_ns == max(durations)
    exact = np.quantile(durations, share, method="inverted_cdf") * 1e-9
    bin_s = 1.01e-5 if exact < 0.2 else math.inf
    assert exact - 1e-12 <= histogram.quantile_s(share) <= exact + bin_s


def test_a_plain_wire_passes_everything_at_once_in_order():
    wire = PlainWire()
    assert wire.next_ns == NEVER and not wire.take(5)
    wire.put(7, 1, 0.5)
    wire.put(8, 2, 0.6)
    assert wire.next_ns <= 8
    assert wire.take(8) == [(1, 0.5), (2, 0.6)] and wire.next_ns == NEVER
