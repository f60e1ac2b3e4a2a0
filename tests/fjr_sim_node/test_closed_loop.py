"""The batch closed loop: accuracy in every case of the paper, one physics with the nodes."""

from __future__ import annotations

import numpy as np
import pytest
from event_driven import closed_loop as reference_loop
from hypothesis import given, settings
from hypothesis import strategies as st

from controller_node import pd_filtered
from controller_node.transfer_function import TransferFunction
from excitation_node import multisine
from fjr_kit.errors import InputError
from fjr_sim_node import effects as fx
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

RATE = 1000.0
PD = {"p": 200.0, "d": 60.0, "n": 24.0}
CASES = {
    "friction_only": {"k1": 0.0},
    "transmission_only": {"fs": 0.0, "fsm": 0.0},
    "both": {},
}


def reference(amplitude, rate=RATE, periods=1, seed=1):
    values = multisine.EXCITATION.check(
        {
            "amplitudes_rad": (amplitude,),
            "sample_rate_hz": rate,
            "periods": periods,
            "transient_periods": 0,
            "seed": seed,
        }
    )
    return multisine.reference(multisine.describe(values, 0, 0))


def simulate(r, rate=RATE, noise=None, controller=None, **plant_values):
    return closed_loop.simulate(
        r,
        rate,
        plant.coefficients(plant.PLANT.check(plant_values)),
        pd_filtered.coefficients(
            pd_filtered.CONTROLLER.check({"sample_rate_hz": rate, **(controller or {})})
        ),
        noise,
    )


def relative_rms(signal, exact):
    return np.sqrt(np.mean((signal - exact) ** 2) / np.mean(exact**2))


@pytest.mark.parametrize("amplitude", [1e-3, 7e-3, 3e-2])
@pytest.mark.parametrize("case", CASES)
def test_whole_period_within_a_thousandth_of_the_reference_solution(case, amplitude):
    r = reference(amplitude)
    assert r.size == 10_000
    position, torque, events = reference_loop(r, RATE, plant.PLANT.check(CASES[case]), PD)
    assert events > 500
    result = simulate(r, **CASES[case])
    assert relative_rms(result.position, position) < 1e-3
    assert relative_rms(result.torque, torque) < 1e-3


def test_the_reference_solution_is_converged():
    r, values = reference(7e-3)[:1000], plant.PLANT.defaults()
    fine = reference_loop(r, RATE, values, PD)
    coarse = reference_loop(r, RATE, values, PD, rtol=1e-8)
    assert relative_rms(coarse[0], fine[0]) < 1e-7


@pytest.mark.parametrize("rate", [500.0, 4000.0, 20_000.0])
def test_other_rates_meet_the_reference_solution(rate):
    r = reference(7e-3, rate)[: round(rate / 2)]
    position, torque, _ = reference_loop(r, rate, plant.PLANT.defaults(), PD)
    result = simulate(r, rate)
    assert relative_rms(result.position, position) < 1e-3
    assert relative_rms(result.torque, torque) < 1e-3


@settings(max_examples=20)
@given(seed=st.integers(0, 2**31 - 1), amplitude=st.floats(1e-4, 3e-2))
def test_batch_is_the_node_steps_bit_for_bit(seed, amplitude):
    r = reference(amplitude, seed=seed)[:300]
    noise = np.random.default_rng(seed).normal(0.0, 1e-5, r.size)
    p = plant.coefficients(plant.PLANT.defaults())
    c = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    result = simulate(r, noise=noise)
    state, x = (0.0,) * 4, 0.0
    for k in range(r.size):
        y = state[2] + noise[k]
        x, u = pd_filtered.step(x, r[k] - y, c)
        assert (result.position[k], result.torque[k]) == (y, u)
        assert (result.link[k], result.motor[k]) == (state[0], state[2])
        state = plant.advance(*state, u, 1.0 / RATE, p)


def test_two_runs_are_identical_and_noise_free_position_is_the_motor():
    r = reference(7e-3)
    first, second = simulate(r), simulate(r)
    for name in ("position", "torque", "link", "motor"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
    assert np.array_equal(first.position, first.motor)


def test_odd_symmetry_of_the_loop_is_bit_for_bit():
    r = reference(7e-3)
    result, mirror = simulate(r), simulate(-r)
    assert np.array_equal(result.position, -mirror.position)
    assert np.array_equal(result.torque, -mirror.torque)


@pytest.mark.parametrize("amplitude", [1e-3, 7e-3, 3e-2])
@pytest.mark.parametrize("case", CASES)
def test_the_response_becomes_periodic(case, amplitude):
    position = simulate(reference(amplitude, periods=4), **CASES[case]).position.reshape(4, -1)
    assert relative_rms(position[2], position[3]) < 1e-6


def test_the_strong_amplitude_at_1_khz_never_becomes_periodic():
    """A fact of the sampled loop (its chaos), so no solver can be compared there."""
    position = simulate(reference(9e-2, periods=6)).position.reshape(6, -1)
    assert relative_rms(position[4], position[5]) > 0.1


def test_even_lines_stay_at_round_off_in_an_odd_plant():
    position = simulate(reference(7e-3, periods=4)).position[-10_000:]
    spectrum = np.abs(np.fft.rfft(position))
    assert spectrum[2:1000:2].max() < 1e-9 * spectrum.max()


def test_the_torque_limit_holds_and_still_tracks():
    result = simulate(reference(7e-3), controller={"torque_limit_nm": 50.0})
    assert np.abs(result.torque).max() == 50.0
    assert np.isfinite(result.position).all()


@pytest.mark.parametrize(
    ("controller", "plant_values"),
    [
        ({"p": 1e6, "d": 1e5, "n": 1e5}, {}),
        ({}, {"j": 1e-6, "jm": 1e-6}),
        ({}, {"jm": 1e-6}),
        ({"d": 1e5}, {"k1": 1e10}),
    ],
    ids=["gains", "inertias", "motor_inertia", "stiffness"],
)
def test_divergence_is_one_sentence(controller, plant_values):
    with pytest.raises(InputError) as raised:
        simulate(reference(7e-3)[:2000], controller=controller, **plant_values)
    message = str(raised.value)
    assert "diverges at" in message
    assert message.endswith(".")
    assert message.count(". ") == 0


def test_a_motion_that_is_lost_ends_as_one_that_diverges():
    """Held by a torque that slews too slowly it swings further and further."""
    rate, samples = 500.0, 2000
    recorded = np.sin(np.arange(samples) / 50.0)
    observer = TransferFunction.of([200.0, -190.0], [1.0, -0.5])
    e = fx.coefficients({"torque_slew_limit.limit_nm_s": 5.0})
    rotor = {
        "jm": 0.01,
        "j": 1e-9,
        "k0": np.inf,
        "k1": 0.0,
        "fs": 0.0,
        "fsm": 0.0,
        "fv": 0.0,
        "fvm": 0.0,
    }

    def held(farthest):
        return closed_loop.simulate_law(
            recorded, rate, plant.coefficients(plant.PLANT.check(rotor)), observer,
            effects=e, command=np.zeros(samples), farthest=farthest,
        )  # fmt: skip

    free = held(np.inf)
    most = np.abs(free.position - recorded).max()
    assert most > 100.0
    assert (held(1.01 * most).position == free.position).all()
    with pytest.raises(InputError, match="diverges at"):
        held(0.5 * most)


@settings(max_examples=30)
@given(
    st.fixed_dictionaries(
        {p.name: st.sampled_from([p.low, max(p.low, 1e-3), p.default, p.high]) for p in plant.PLANT}
    )
)
def test_any_corner_of_the_allowed_range_ends_in_motion_or_a_sentence(plant_values):
    try:
        result = simulate(reference(7e-3)[:20], **plant_values)
    except InputError as error:
        assert "diverges" in str(error)
    else:
        assert np.isfinite(result.torque).all()


def test_a_description_without_controller_is_refused():
    experiment = multisine.describe(multisine.EXCITATION.defaults(), 0, 0)
    with pytest.raises(InputError, match="controller is missing"):
        run_realization(SIMULATOR.defaults(), experiment)


def test_a_motion_below_the_least_double_is_simulated():
    axis = {"jm": 0.12347, "fsm": 0.16, "fvm": 0.389}
    nothing = {"j": 0.0, "k0": np.inf, "k1": 0.0, "fs": 0.0, "fv": 0.0}
    effects = {
        "presliding_friction.motor_rad": 5.6e-4,
        "actuator_lag.time_constant_s": 1.4e-3,
    }
    torque = np.zeros(36)
    torque[31:] = 9.881e-324, -2.470e-323, 9.387e-323, -3.409e-322, 1.265e-321
    out = closed_loop.simulate_law(
        np.zeros(36),
        800.0,
        plant.coefficients({**nothing, **axis, **effects}),
        TransferFunction.of([16651.48779578, -15063.04760205], [1.0, -0.33257325]),
        effects=fx.coefficients(effects),
        command=torque,
    )
    assert np.isfinite(out.position).all()


@pytest.mark.parametrize("general", [False, True])
def test_a_simulation_goes_on_from_the_state_in_which_another_ended(general):
    pd = pd_filtered.coefficients(pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE}))
    law = TransferFunction.of_pd(pd) if general else pd
    on = {"delay.time_s": 2.4e-3, "hysteresis.torque_nm": 1.0, "hysteresis.displacement_rad": 1e-4}
    rig = plant.coefficients(plant.PLANT.defaults()), law, None, fx.coefficients(on)
    r = reference(7e-3)[:4000]
    whole = closed_loop.simulate(r, RATE, *rig)
    half = closed_loop.simulate(r[:1700], RATE, *rig)
    for _ in range(2):  # the state is left as it was
        rest = closed_loop.simulate(r[1700:], RATE, *rig, begin=half.end)
        for name in ("position", "torque", "link", "motor"):
            parts = getattr(half, name), getattr(rest, name)
            assert np.array_equal(np.concatenate(parts), getattr(whole, name))
