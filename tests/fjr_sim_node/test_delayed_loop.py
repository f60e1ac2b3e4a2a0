"""Delay margin and bias of the BLA by a late torque, against simulation and the paper's figures."""

from __future__ import annotations

import numpy as np
import pytest

from controller_node import pd_filtered
from controller_node.transfer_function import TransferFunction
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation import closed_loop
from fjr_sim_node.theory import linear
from fjr_sim_node.theory.delayed_loop import delay_margin, delayed_g0, spectral_radius

VISCOUS = {**plant.PLANT.defaults(), "fs": 0.0, "fsm": 0.0, "k1": 0.0}
FRICTIONLESS = {**VISCOUS, "fv": 0.0, "fvm": 0.0}
FREQUENCY = np.linspace(1.0, 50.0, 50)


def law(rate):
    values = {**pd_filtered.CONTROLLER.defaults(), "sample_rate_hz": rate}
    return TransferFunction.of_pd(pd_filtered.coefficients(values))


def simulated(rate, delay_s, samples, values=VISCOUS):
    """Return one second or more of the loop's response to an odd multisine."""
    time = np.arange(samples) / rate
    harmonics = np.arange(1, 50, 2)
    phases = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, harmonics.size)
    reference = 1e-3 * np.cos(2.0 * np.pi * harmonics[:, None] * time + phases[:, None]).sum(axis=0)
    late = effects.coefficients({"delay.time_s": delay_s})
    return closed_loop.simulate(
        reference, rate, plant.coefficients(values), law(rate), effects=late
    )


@pytest.mark.parametrize(("values", "margin_s"), [(VISCOUS, 2.75e-3), (FRICTIONLESS, 1.1e-3)])
def test_delay_margin_of_a_fast_loop_is_the_papers(values, margin_s):
    assert delay_margin(values, law(20_000.0), 20_000.0) == pytest.approx(margin_s, abs=6e-5)


@pytest.mark.parametrize("rate", [500.0, 1000.0])
def test_the_hold_of_a_sampled_loop_costs_half_a_sample(rate):
    margin = delay_margin(VISCOUS, law(rate), rate)
    fast = delay_margin(VISCOUS, law(20_000.0), 20_000.0)
    assert margin == pytest.approx(fast - 0.5 / rate + 0.5 / 20_000.0, abs=1e-4)


@pytest.mark.parametrize("rate", [500.0, 1000.0, 2000.0])
def test_the_simulated_loop_is_stable_just_below_the_margin_only(rate):
    margin = delay_margin(VISCOUS, law(rate), rate)
    periods = int(rate)
    calm, wild = (simulated(rate, share * margin, 20 * periods) for share in (0.97, 1.03))
    growth = [np.std(run.position[-periods:]) / np.std(run.position[9 * periods : 10 * periods])
              for run in (calm, wild)]  # fmt: skip
    assert growth[0] < 1.2
    assert growth[1] > 2.0


@pytest.mark.parametrize(
    ("named", "near"),
    [({"k0": np.inf}, {"k0": 1e8, "j": VISCOUS["j"]}), ({"j": np.inf}, {"j": 1e7})],
    ids=["rigid", "held link"],
)
def test_a_rigid_axis_and_a_held_link_have_the_margin_of_what_comes_near(named, near):
    rigid, stiff = ({**VISCOUS, **values} for values in (named, near))
    assert delay_margin(rigid, law(1000.0), 1000.0) > 2e-3
    assert delay_margin(rigid, law(1000.0), 1000.0) == pytest.approx(
        delay_margin(stiff, law(1000.0), 1000.0), rel=1e-4
    )
    assert spectral_radius(rigid, law(1000.0), 1000.0, 0.0) < 1.0


def test_a_loop_that_is_unstable_or_never_will_be():
    assert delay_margin(VISCOUS, TransferFunction.of([1e6], [1.0]), 1000.0) == 0.0
    gentle = TransferFunction.of([1e-3], [1.0])
    assert delay_margin(VISCOUS, gentle, 1000.0) == np.inf
    assert spectral_radius(VISCOUS, gentle, 1000.0, 0.0) < 1.0


@pytest.mark.parametrize("delay_s", [0.0, 0.3e-3, 1.0e-3, 1.7e-3])
def test_the_predicted_response_is_that_of_the_simulation(delay_s):
    rate = 1000.0
    run = simulated(rate, delay_s, 60_000)
    y, u = (np.fft.rfft(signal[-1000:])[1:50:2] for signal in (run.position, run.torque))
    predicted = delayed_g0(VISCOUS, np.arange(1, 50, 2), rate, np.array([delay_s]))
    np.testing.assert_allclose(y / u, predicted, rtol=2e-5)


def test_no_delay_is_g0():
    np.testing.assert_allclose(
        delayed_g0(VISCOUS, FREQUENCY, 500.0, np.zeros(3)), linear.g0(VISCOUS, FREQUENCY, 500.0)
    )


def test_a_jittering_delay_measures_the_mean_response():
    """Torques that act after 0.2 or 0.8 ms at random, stepped by hand at a tenth of a sample."""
    rate, parts, samples, runs = 1000.0, 10, 1000, 300
    step, held = linear.held_torque(*linear.state_space(VISCOUS), 1.0 / (rate * parts))
    random = np.random.default_rng(5)
    torque = np.tile(random.standard_normal(samples), 3)
    torque -= torque.mean()
    parts_late = random.choice([2, 8], (torque.size, runs))
    state, position, before = np.zeros((4, runs)), np.empty((torque.size, runs)), 0.0
    for k, now in enumerate(torque):
        position[k] = state[2]
        for part in range(parts):
            acting = np.where(part < parts_late[k], before, now)
            state = step @ state + held[:, None] * acting
        before = now
    lines = np.arange(5, 51)
    steps = np.fft.rfft(np.diff(position, axis=0)[-samples:], axis=0)[lines]  # y itself wanders
    inverse = 1.0 / (np.exp(2j * np.pi * lines / samples) - 1.0)
    torques = np.fft.rfft(torque[-samples - 1 : -1])[lines]
    measured = steps * (inverse / torques)[:, None]
    predicted = delayed_g0(VISCOUS, lines.astype(float), rate, np.array([0.2e-3, 0.8e-3]))
    deviation = measured.std(axis=1) / np.sqrt(runs)

    def misfit(frf):
        return np.mean((np.abs(measured.mean(axis=1) - frf) / deviation) ** 2)

    assert misfit(predicted) < 2.0
    assert misfit(linear.g0(VISCOUS, lines.astype(float), rate)) > 4.0
