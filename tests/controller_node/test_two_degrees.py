"""Laws of two degrees of freedom: scipy's filters, any start, the loop, the check."""

from __future__ import annotations

import warnings

import effect_rig
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.signal import BadCoefficients, lfilter, tf2ss

from controller_node import pd_filtered, transfer_function
from controller_node.controller_file import describe, read_controller
from controller_node.law import as_transfer_function, law_as_run, law_of
from controller_node.polynomials import together
from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop, rig
from fjr_sim_node.theory.delayed_loop import spectral_radius
from gap_diagnosis.model.controller_check import check_law

RATE = 1000.0
PLANT = plant.coefficients(plant.PLANT.defaults())
CASCADE = {
    "kind": "p_pi",
    "k_position": 12.0,
    "k_velocity": 40.0,
    "integral_time_s": 0.4,
    "velocity_filter_rad_s": 900.0,
    "feed_forward": {"velocity": 1.5, "acceleration": 0.4},
}
PID = {
    "kind": "pid", "p": 200.0, "i": 90.0, "d": 40.0, "n": 300.0, "derivative_on": "measurement",
    "setpoint_weight": 0.7,
}  # fmt: skip


def signals(samples: int = 400) -> tuple[np.ndarray, np.ndarray]:
    r, y = np.cumsum(np.random.default_rng(3).normal(size=(2, samples)), axis=1) / 50.0
    return r, y


def by_steps(law: TransferFunction, r, y, state=None) -> np.ndarray:
    x = np.zeros(law.states + 1)
    if state is not None:
        x[:-1] = state
    return np.array(
        [transfer_function.step(x, *each, *law.coefficients) for each in zip(r, y, strict=True)]
    )


poles = st.lists(
    st.floats(-0.95, 0.95) | st.just(1.0) | st.tuples(st.floats(0.1, 0.95), st.floats(0.1, 3.0)),
    max_size=3,
)  # fmt: skip
numerators = st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=4)


def polynomial(roots) -> np.ndarray:
    pairs = [r if isinstance(r, float) else r[0] * np.exp(1j * r[1]) for r in roots]
    both = pairs + [np.conj(r) for r in pairs if isinstance(r, complex)]
    return np.real(np.atleast_1d(np.poly(both)))


@given(numerators, poles, numerators, poles)
def test_any_two_transfer_functions_are_scipys_two_filters(b_r, p_r, b_y, p_y):
    assume(p_r.count(1.0) <= 1 and p_y.count(1.0) <= 1)
    a_r, a_y = polynomial(p_r), polynomial(p_y)
    r, y = signals(120)
    law = TransferFunction.of_two((np.array(b_r), a_r), (np.array(b_y), a_y))
    expected = lfilter(b_r, a_r, r) - lfilter(b_y, a_y, y)
    size = np.abs(lfilter(b_r, a_r, r)).max() + np.abs(lfilter(b_y, a_y, y)).max() + 1.0
    assert np.abs(by_steps(law, r, y) - expected).max() < 1e-7 * size
    assert np.abs(law.unlimited(r, y) - expected).max() < 1e-7 * size


@given(numerators, poles)
def test_the_step_is_the_state_space_of_its_transfer_function(b, roots):
    a = polynomial(roots)
    law = TransferFunction.of(b, a)
    r, y = signals(80)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BadCoefficients)  # a leading coefficient of zero
        matrices = tf2ss(law.position, law.denominator)
    state, expected = np.zeros(len(matrices[0])), []
    for error in r - y:
        expected.append((matrices[2] @ state).sum() + matrices[3][0, 0] * error)
        state = matrices[0] @ state + matrices[1][:, 0] * error
    assert np.allclose(by_steps(law, r, y), expected, atol=1e-7 * (1 + np.abs(expected).max()))


@given(numerators, poles)
def test_a_law_from_the_error_depends_on_nothing_but_the_error(b, roots):
    """To the last bit: a constant in both signals cancels wherever r - y is exact."""
    law = TransferFunction.of(b, polynomial(roots))
    r = np.round(signals(60)[0] * 1024.0) / 1024.0
    y = np.round(signals(60)[1] * 1024.0) / 1024.0
    assert np.array_equal(by_steps(law, r, y), by_steps(law, r + 8.0, y + 8.0))


def test_an_integrator_that_both_parts_have_is_one_integrator():
    reference = np.array([2.0]), np.array([1.0, -1.0])
    position = np.array([3.0, -1.0]), np.convolve([1.0, -1.0], [1.0, -0.5])
    b_r, b_y, a = together(reference, position)
    assert np.allclose(a, [1.0, -1.5, 0.5]) and np.allclose(b_r, [2.0, -1.0])
    assert np.allclose(b_y, [3.0, -1.0])
    other = np.array([1.0]), np.convolve([1.0, -1.0], [1.0, -0.2])
    *_, a = together(position, other)
    assert a.size == 4 and np.allclose(np.sort(np.roots(a)), [0.2, 0.5, 1.0])
    law = law_of(PID, RATE)
    assert np.sum(np.abs(np.roots(law.denominator) - 1.0) < 1e-6) == 1


@pytest.mark.parametrize("described", [CASCADE, PID], ids=lambda d: d["kind"])
def test_the_closed_loop_is_that_of_a_plain_loop(described):
    limited = {**described, "torque_limit_nm": 8.0}
    law = law_of(limited, RATE)
    reference = effect_rig.multisine_reference(0.01)[:4000]
    noise = 1e-6 * np.random.default_rng(1).standard_normal(reference.size)
    run = closed_loop.simulate(reference, RATE, PLANT, law, noise)
    assert np.mean(np.abs(run.torque) == 8.0) > 0.01  # the limit is reached
    given_ratios = {
        "reference": lambda r: lfilter(law.reference, law.denominator, r),
        "position": lambda y: lfilter(law.position, law.denominator, y),
    }
    torque = given_ratios["reference"](reference) - given_ratios["position"](run.position)
    assert np.allclose(run.torque, np.clip(torque, -8.0, 8.0), atol=1e-6)
    state = rig.at_rest()
    for k in range(1000):
        y = rig.measure(state, noise[k], None)
        assert y == run.position[k]
        rig.hold(state, run.torque[k], 1.0 / RATE, PLANT, None)


def test_the_cascade_is_what_its_words_say():
    r, y = signals()
    law = law_of(CASCADE, RATE)
    decay = np.exp(-900.0 / RATE)
    velocity = lfilter([1.0 - decay], [1.0, -decay], RATE * np.diff(y, prepend=0.0))
    wanted = 12.0 * (r - y) - velocity
    speed = RATE * np.diff(r, prepend=0.0)
    forward = 1.5 * speed + 0.4 * RATE * np.diff(speed, prepend=0.0)
    expected = 40.0 * (wanted + np.cumsum(wanted) / RATE / 0.4) + forward
    assert np.allclose(by_steps(law, r, y), expected, rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize("filtered", [1.0, 300.0, 900.0, 5000.0])
@pytest.mark.parametrize("described", [CASCADE, PID], ids=lambda d: d["kind"])
def test_a_steady_speed_is_damped_by_the_gain_however_slow_its_filter(described, filtered):
    own = {"n": filtered} if "n" in described else {"velocity_filter_rad_s": filtered}
    plain = {key: value for key, value in described.items() if key not in own}
    slow = np.array([1e-4])
    damps = [law_of({**plain, **o}, RATE).response(slow, RATE)[1].imag for o in ({}, own)]
    assert damps[0] == pytest.approx(damps[1], rel=1e-6)


@pytest.mark.parametrize("between", ["held", "joined"])
def test_a_law_that_runs_several_times_in_a_sample_is_the_loop_that_was_sampled(between):
    steps, samples, slow = 8, 900, RATE / 8
    coarse = 0.2 * np.sin(2 * np.pi * 3.0 * np.arange(samples) / slow) ** 3
    inside = np.arange(samples * steps) / steps
    if between == "held":
        fine = coarse[inside.astype(int)]
    else:
        fine = np.interp(inside, np.arange(samples), coarse)
    described = {**PID, "torque_limit_nm": 9.0}
    truth = closed_loop.simulate(fine, RATE, PLANT, law_of(described, RATE))
    law = law_as_run({**described, "rate_hz": RATE, "between_samples": between}, slow)
    assert law.steps == steps
    run = closed_loop.simulate(coarse, slow, PLANT, law)
    assert np.array_equal(run.position, truth.position[::steps])
    assert np.array_equal(run.reference, coarse)
    mean = truth.torque.reshape(-1, steps).mean(axis=1)
    assert np.allclose(run.torque, mean, rtol=0, atol=1e-12) and np.abs(truth.torque).max() == 9.0
    made = law.torque(coarse, run.position)[5:]
    assert np.std(made - mean[5:]) < 0.01 * np.std(mean)
    frequency = np.array([0.5, 20.0])
    expected = law_of(described, RATE).response(frequency, RATE)
    assert np.allclose(law.response(frequency, slow), expected)


def test_a_law_is_known_by_what_was_given_and_may_run_no_slower_than_its_record(tmp_path):
    file = tmp_path / "pd.yaml"
    file.write_text("{kind: pd, p: 40, d: 2, rate_hz: 1000}")
    structure = read_controller(file)
    entry = describe(structure, 100.0, "pd.yaml")
    assert as_transfer_function(law_of(entry, 100.0)).steps == 1  # what a node can run
    law = law_as_run(entry, 100.0)
    assert law.steps == 10 and law.position[0] == pytest.approx(40.0 + 2.0 * 1000.0)
    assert law_as_run(entry, 990.0).steps == 1
    with pytest.raises(InputError, match=r"rate_hz is 1000 Hz, but the samples come at 2000 Hz"):
        law_as_run(entry, 2000.0)
    with pytest.raises(InputError, match=r"more than 1000 times the 0\.5 Hz of the samples"):
        law_as_run(entry, 0.5)
    assert law_as_run({**entry, "given": "nothing"}, 100.0).steps == 1
    gains = {"kind": "pd", "p": None, "d": 2.0, "unknown": ["p"], "rate_hz": 1000.0}
    assert law_as_run(gains, 100.0, {"p": 40.0}).position == pytest.approx(law.position)


def test_a_record_cut_in_the_middle_is_simulated_on_from_its_states():
    law = law_of(CASCADE, RATE)
    reference = 0.2 * np.sin(np.arange(3000) / 200.0)
    frictionless = plant.coefficients(
        {**plant.PLANT.defaults(), "fs": 0.0, "fsm": 0.0, "k0": np.inf}
    )
    run = closed_loop.simulate(reference, RATE, frictionless, law)
    cut = slice(1200, None)
    r, y, u = reference[cut], run.position[cut], run.torque[cut]
    state = law.entering_state(r[:50], y[:50], u[:50])
    # The true velocity, of a parabola through held torque, from its positions.
    speed = float(np.gradient(run.motor[1195:1206], 1.0 / RATE, edge_order=2)[5])
    again = closed_loop.simulate_law(
        r, RATE, frictionless, law, start=(float(y[0]), speed), controller_state=state
    )
    assert effect_rig.relative_rms(again.position, y) < 1e-4
    cold = closed_loop.simulate_law(r, RATE, frictionless, law, start=(float(y[0]), speed))
    assert effect_rig.relative_rms(cold.position, y) > 1e-2


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"controller_state": np.zeros(7)}, "controller_state must have 4 states"),
        ({"command": np.zeros(5)}, "command must have 20 samples"),
        ({"noise": np.zeros(21)}, "noise must have 20 samples"),
    ],
)
def test_wrong_lengths_are_refused(arguments, says):
    with pytest.raises(InputError, match=says):
        closed_loop.simulate_law(np.zeros(20), RATE, PLANT, law_of(CASCADE, RATE), **arguments)


@pytest.mark.parametrize("described", [CASCADE, PID], ids=lambda d: d["kind"])
def test_a_record_is_checked_from_any_state(described):
    law = law_of({**described, "torque_limit_nm": 9.0}, RATE)
    reference = effect_rig.multisine_reference(0.01)[:6000]
    run = closed_loop.simulate(reference, RATE, PLANT, law)
    r, y, u = (s[1500:] for s in (run.reference, run.position, run.torque))
    assert check_law(law, r, y, u).passed
    unlimited = law_of(described, RATE)
    assert "clamped at 9 N m" in check_law(unlimited, r, y, u).cause
    free = closed_loop.simulate(reference, RATE, PLANT, unlimited)
    r, y, u = (s[1500:] for s in (free.reference, free.position, free.torque))
    assert "logged 1 sample(s) late" in check_law(unlimited, r[1:], y[1:], u[:-1]).cause
    another = law_of({**described, "feed_forward": {"velocity": 1.6}}, RATE)
    assert not check_law(another, r, y, u).passed
    with pytest.raises(InputError, match="records of one length"):
        check_law(law, r, y, u[1:])


def test_the_frequency_response_is_that_of_the_default_law_and_of_the_loop():
    frequency = np.array([[0.5, 3.0], [40.0, 200.0]])
    values = pd_filtered.CONTROLLER.defaults()
    law = as_transfer_function(pd_filtered.coefficients(values))
    c_r, c_y = law.response(frequency, RATE)
    z = np.exp(2j * np.pi * frequency / RATE)
    decay = np.exp(-values["n"] / RATE)
    expected = values["p"] + values["d"] * values["n"] * (z - 1.0) / (z - decay)
    assert np.allclose(c_y, expected) and np.array_equal(c_r, c_y)
    c_r, c_y = law_of({**CASCADE, "feed_forward": {}}, RATE).response(frequency, RATE)
    smooth = (1 - np.exp(-0.9)) / (1 - np.exp(-0.9) / z)
    velocity = smooth * RATE * (1 - 1 / z)
    inner = 40.0 * (1.0 + 1.0 / (RATE * 0.4) / (1 - 1 / z))
    assert np.allclose(c_r, 12.0 * inner) and np.allclose(c_y, inner * (12.0 + velocity))


def test_the_loops_poles_are_those_of_the_position_feedback():
    parameters = {**plant.PLANT.defaults(), "fs": 0.0, "fsm": 0.0, "k1": 0.0}
    law = law_of(PID, RATE)
    same_feedback = TransferFunction.of(law.position, law.denominator)
    radius = spectral_radius(parameters, law, RATE, 0.0)
    assert radius == pytest.approx(spectral_radius(parameters, same_feedback, RATE, 0.0))
    assert radius < 1.0


def test_given_gains_make_the_law_that_known_ones_make():
    free = {**CASCADE, "k_velocity": None, "feed_forward": {"velocity": None, "acceleration": 0.4}}
    free["unknown"] = ["k_velocity", "feed_forward.velocity"]
    made = law_of(free, RATE, {"k_velocity": 40.0, "feed_forward.velocity": 1.5})
    known = law_of(CASCADE, RATE)
    assert np.array_equal(made.reference, known.reference)
    assert np.array_equal(made.position, known.position)
    node = {"kind": "pd_filtered", "p": None, "d": 60.0, "n": 24.0, "unknown": ["p"]}
    assert np.array_equal(
        law_of(node, RATE, {"p": 200.0}),
        pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults()),
    )
