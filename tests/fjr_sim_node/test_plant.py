"""The plant: order of the method, physics that must hold for any parameters, exact sticking."""

from __future__ import annotations

import math

import numpy as np
import pytest
from event_driven import EventDrivenPlant
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fjr_kit.errors import InputError
from fjr_sim_node import plant
from fjr_sim_node.theory import linear

PAPER = plant.PLANT.defaults()
FRICTIONLESS = {"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}


def values(**overrides):
    return plant.PLANT.check(overrides)


def held_run(torque, duration, parameters, parts=1):
    """States after each held torque, shape (torques, 4), in steps of duration/parts."""
    p, state, states = plant.coefficients(parameters), (0.0,) * 4, []
    for u in torque:
        for _ in range(parts):
            state = plant.advance(*state, u, duration / parts, p)
        states.append(state)
    return np.array(states)


def reference_run(torque, duration, parameters):
    solution, states = EventDrivenPlant(dict(parameters)), []
    for u in torque:
        solution.hold(u, duration)
        states.append(list(solution.state))
    return np.array(states), solution.events


def broadband(samples, duration, rms=130.0):
    """A torque with lines from 1 to 25 Hz, as smooth as a held signal can be."""
    rng = np.random.default_rng(1)
    lines = np.array([1.3, 2.9, 4.7, 7.1, 11.0, 16.0, 19.0, 24.5])
    phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    t = np.arange(samples)[:, None] * duration
    return rms * np.sqrt(2.0 / lines.size) * np.cos(2 * np.pi * lines * t + phases).sum(axis=1)


def relative_error(states, exact):
    return np.sqrt(((states - exact) ** 2).mean(axis=0) / (exact**2).mean(axis=0))


@pytest.mark.parametrize(
    ("overrides", "rms"),
    [({}, 130.0), ({}, 16.0), ({"k1": 0.0}, 130.0), ({"fs": 0.0, "fsm": 0.0}, 130.0)],
    ids=["both", "both_mostly_stuck", "friction_only", "transmission_only"],
)
def test_order_is_four_in_smooth_motion_and_across_events(overrides, rms):
    parameters, step = values(**overrides), 1e-3
    torque = broadband(1000, step, rms)
    exact, events = reference_run(torque, step, parameters)
    assert events > 40
    errors = np.array(
        [relative_error(held_run(torque, step, parameters, m), exact) for m in (1, 2, 4)]
    )
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders.min() > 3.7
    assert orders.max() < 4.6
    assert errors[0].max() < 5e-5


@pytest.mark.parametrize("rate", [100.0, 200.0, 1000.0, 4000.0, 20_000.0])
def test_every_rate_gives_the_motion_of_the_reference(rate):
    torque = broadband(50, 0.01)
    exact, _ = reference_run(torque, 0.01, PAPER)
    states = held_run(torque, 0.01, PAPER, round(rate / 100.0))
    assert relative_error(states, exact).max() < 5e-5


@pytest.mark.parametrize("rate", [5.0, 20.0, 100.0, 1000.0, 20_000.0])
def test_linear_motion_is_the_matrix_exponential(rate):
    from scipy.linalg import expm

    parameters = values(fs=0.0, fsm=0.0, k1=0.0)
    a, b = linear.state_space(parameters)
    exact = expm(np.block([[a, b[:, None]], [np.zeros((1, 5))]]) / rate)
    torque = np.random.default_rng(2).normal(0.0, 10.0, 200)
    state, states = np.zeros(4), []
    for u in torque:
        state = exact[:4, :4] @ state + exact[:4, 4] * u
        states.append(state)
    error = relative_error(held_run(torque, 1.0 / rate, parameters), np.array(states)).max()
    assert error < 1e-4 * min(1.0, 1000.0 / rate) ** 4


@given(
    speed=st.floats(0.01, 10.0),
    sign=st.sampled_from([-1.0, 1.0]),
    level=st.floats(1.0, 50.0),
    inertia=st.floats(0.01, 1.0),
)
def test_a_coasting_motor_stops_where_mechanics_says(speed, sign, level, inertia):
    parameters = values(k0=0.0, k1=0.0, fvm=0.0, fsm=level, jm=inertia)
    stop = inertia * speed / level
    distance = sign * speed * stop / 2.0
    p = plant.coefficients(parameters)
    _, _, th, vth = plant.advance(0.0, 0.0, 0.0, sign * speed, 0.0, 1.5 * stop, p)
    assert vth == 0.0
    assert th == pytest.approx(distance, rel=1e-9)
    reference = EventDrivenPlant(dict(parameters), state=[0.0, 0.0, 0.0, sign * speed])
    reference.hold(0.0, 1.5 * stop)
    assert reference.state[2] == pytest.approx(distance, rel=1e-9)
    assert reference.state[3] == 0.0


friction_levels = st.one_of(st.just(0.0), st.floats(1e-3, 100.0))
plants = st.builds(
    values,
    jm=st.floats(0.01, 5.0),
    j=st.floats(0.01, 5.0),
    fs=friction_levels,
    fsm=friction_levels,
    fv=st.floats(0.0, 20.0),
    fvm=st.floats(0.0, 20.0),
    k0=st.floats(0.0, 1e5),
    k1=st.floats(0.0, 1e5),
)
angles = st.floats(-0.5, 0.5)
speeds = st.one_of(st.just(0.0), st.floats(-5.0, 5.0))
motions = st.tuples(angles, speeds, angles, speeds)
torques = st.one_of(st.just(0.0), st.floats(-500.0, 500.0))
durations = st.floats(1.0 / 20_000.0, 1.0 / 100.0)


def energy(state, v):
    """Return kinetic and elastic energy in J."""
    q, vq, th, vth = state
    twist2 = (q - th) ** 2
    kinetic = v["j"] * vq**2 + v["jm"] * vth**2
    return 0.5 * (kinetic + v["k0"] * twist2 + 0.5 * v["k1"] * twist2**2)


@settings(max_examples=500)
@given(plants, motions, torques, durations)
def test_energy_comes_only_from_the_torque(parameters, state, torque, duration):
    p = plant.coefficients(parameters)
    for _ in range(10):
        after = plant.advance(*state, torque, duration, p)
        gained = energy(after, parameters) - energy(state, parameters)
        work = torque * (after[2] - state[2])
        scale = energy(after, parameters) + energy(state, parameters) + abs(work)
        assert gained <= work + 1e-5 * scale + 1e-20  # J: the last bits of an angle
        state = after


@settings(max_examples=500)
@given(plants, motions, torques, durations)
def test_odd_symmetry_is_bit_for_bit(parameters, state, torque, duration):
    p = plant.coefficients(parameters)
    mirror = tuple(-x for x in state)
    for _ in range(5):
        state = plant.advance(*state, torque, duration, p)
        mirror = plant.advance(*mirror, -torque, duration, p)
        assert state == tuple(-x for x in mirror)


@given(plants, angles, durations)
def test_rest_without_twist_or_torque_stays_rest(parameters, angle, duration):
    rest = (angle, 0.0, angle, 0.0)
    assert plant.advance(*rest, 0.0, duration, plant.coefficients(parameters)) == rest


@given(st.floats(1e-3, 1e4), st.sampled_from([-1.0, 1.0]), durations)
def test_the_motor_breaks_away_exactly_above_its_level(level, sign, duration):
    p = plant.coefficients(values(fsm=level))
    rest = (0.0, 0.0, 0.0, 0.0)
    assert plant.advance(*rest, sign * level, duration, p) == rest
    assert sign * plant.advance(*rest, sign * math.nextafter(level, math.inf), duration, p)[3] > 0.0


@given(plants, st.floats(1e-3, 100.0), st.floats(1e-3, 100.0), *[st.floats(-1.0, 1.0)] * 2)
def test_both_sides_below_their_levels_stay_bit_for_bit(parameters, fs, fsm, link, motor):
    parameters = {**parameters, "fs": fs, "fsm": fsm}
    p = plant.coefficients(parameters)
    twist = link * min(1.0, fs / (parameters["k0"] + parameters["k1"] + 1.0))
    spring = twist * (parameters["k0"] + parameters["k1"] * twist * twist)
    torque = motor * fsm - spring
    assume(abs(spring + torque) <= fsm)
    state = (twist, 0.0, 0.0, 0.0)
    assert plant.advance(*state, torque, 0.01, p) == state


@given(plants, motions, torques, durations)
def test_a_stuck_side_keeps_its_place_while_the_other_moves(parameters, state, torque, duration):
    q, vq, th, vth = state
    stuck_motor = plant.coefficients({**parameters, "fsm": 1e9})
    stuck_link = plant.coefficients({**parameters, "fs": 1e9})
    for _ in range(20):
        q, vq, th_after, motor_speed = plant.advance(q, vq, th, 0.0, torque, duration, stuck_motor)
        assert (th_after, motor_speed) == (th, 0.0)
    q = state[0]
    for _ in range(20):
        q_after, link_speed, th, vth = plant.advance(q, 0.0, th, vth, torque, duration, stuck_link)
        assert (q_after, link_speed) == (q, 0.0)


@given(plants, motions, torques, durations)
def test_momentum_changes_by_the_torque_alone_without_friction(parameters, state, torque, duration):
    parameters = {**parameters, **FRICTIONLESS}
    after = plant.advance(*state, torque, duration, plant.coefficients(parameters))

    def momentum(s):
        return parameters["j"] * s[1] + parameters["jm"] * s[3]

    scale = abs(parameters["j"] * after[1]) + abs(parameters["jm"] * after[3]) + 1.0
    change = momentum(after) - momentum(state)
    assert change == pytest.approx(torque * duration, abs=1e-11 * scale)


@pytest.mark.parametrize(
    ("overrides", "bound"),
    [
        ({"fs": 1e5}, 1e-4),
        ({"fsm": 1e5}, 1e-4),
        ({"fs": 1e5, "fsm": 1e5}, 1e-4),
        # 900 rad of hardly damped ringing decides each stop: a phase error of 1e-5 per rad shows.
        ({"k0": 1e7}, 1e-2),
        ({"k0": 1e7, "fs": 0.0, "fsm": 0.0}, 1e-4),
        ({"k0": 0.0, "k1": 0.0}, 1e-4),
        ({"k0": 0.0, "k1": 1e5}, 1e-4),
        ({"j": 1e-4, "jm": 1e-4}, 1e-4),
        ({"j": 1e4, "jm": 1e-3}, 1e-4),
    ],
    ids=str,
)
def test_extreme_plants_move_as_the_reference_says(overrides, bound):
    parameters, step = values(**overrides), 0.01
    torque = broadband(10, step, 30.0)
    exact, _ = reference_run(torque, step, parameters)
    states = held_run(torque, step, parameters)
    scale = np.abs(exact).max(axis=0)
    assert (np.abs(states - exact).max(axis=0) <= bound * scale).all()


def test_a_twist_that_grows_within_one_hold_is_followed():
    """From zero deflection the stiffness of the first instant says nothing of the rest."""
    parameters = values(k0=0.0, k1=1e5, jm=0.01, fs=0.0, fsm=0.0, fv=0.0, fvm=0.0)
    reference = EventDrivenPlant(dict(parameters), state=[0.0, 0.0, 0.0, 20.0])
    reference.hold(100.0, 0.01)
    state = plant.advance(0.0, 0.0, 0.0, 20.0, 100.0, 0.01, plant.coefficients(parameters))
    assert state == pytest.approx(reference.state, rel=1e-4)


@pytest.mark.parametrize(
    ("overrides", "torque"),
    [
        ({"j": 1e-6, "jm": 1e-6}, 1.0),
        ({"k0": 1e8, "j": 1e-6}, 1.0),
        ({"fv": 1e5, "j": 1e-6}, 1.0),
        ({}, math.nan),
        ({}, math.inf),
        ({"fsm": 1e5}, -math.inf),
    ],
    ids=str,
)
def test_what_cannot_be_followed_is_nan_at_once(overrides, torque):
    state = plant.advance(0.0, 0.0, 0.0, 0.0, torque, 0.01, plant.coefficients(values(**overrides)))
    assert np.isnan(state).all()


def test_friction_of_a_link_that_is_held_does_nothing():
    def end(fs):
        p, x = plant.coefficients(values(j=math.inf, fs=fs)), (0.0, 0.0, 0.0, 0.0)
        for torque in np.repeat([60.0, -60.0, 10.0], 100).tolist():
            x = plant.advance(*x, torque, 1e-3, p)
        return x

    assert end(5.0) == end(0.0) and end(0.0)[0] == 0.0 and end(0.0)[2] != 0.0


def test_nan_never_leaves_the_state_again():
    p = plant.coefficients(PAPER)
    assert np.isnan(plant.advance(math.nan, 0.0, 0.0, 0.0, 1.0, 1e-3, p)).all()


def test_parameters_keep_the_order_that_the_kernel_reads():
    names = ("jm", "j", "fs", "fsm", "fv", "fvm", "k0", "k1")
    order = (plant.JM, plant.J, plant.FS, plant.FSM, plant.FV, plant.FVM, plant.K0, plant.K1)
    assert plant.PLANT.names == names
    p = plant.coefficients({name: float(i) for i, name in enumerate(names)})
    assert [p[index] for index in order] == list(range(8))


@pytest.mark.parametrize("name", plant.PLANT.names)
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, "heavy", True, None])
def test_a_bad_parameter_is_refused_by_name(name, value):
    if name in ("j", "k0") and value == math.inf:
        pytest.skip("an infinite stiffness is a rigid axis, an infinite link inertia a held link")
    with pytest.raises(InputError, match=f"^{name} must "):
        plant.PLANT.check({name: value})
