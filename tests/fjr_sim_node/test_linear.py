"""G0: the paper's formula, the zero-order-hold equivalent, and a loop that measures it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, freqz

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop
from fjr_sim_node.theory import linear

PAPER = plant.PLANT.defaults()
FREQUENCY = np.linspace(0.1, 50.0, 500)


def paper_formula(v, frequency, damping):
    """G0 as paper.md states it."""
    extra = (v["fs"], v["fsm"]) if damping == "paper" else (0.0, 0.0)
    a, b = v["fv"] + extra[0], v["fvm"] + extra[1]
    s = 2j * np.pi * frequency
    link = v["j"] * s**2 + a * s + v["k0"]
    return link / (link * (v["jm"] * s**2 + b * s + v["k0"]) - v["k0"] ** 2)


def continuous_g0(values, frequency, damping="viscous"):
    """G0 of the state space, whose third state is the motor's angle."""
    a, b = linear.state_space(values, damping)
    return np.array([np.linalg.solve(2j * np.pi * f * np.eye(4) - a, b)[2] for f in frequency])


def decibels(ratio):
    return 20.0 * np.log10(np.abs(ratio))


@pytest.mark.parametrize("damping", ["viscous", "paper"])
def test_continuous_g0_is_the_formula_of_the_paper(damping):
    g = continuous_g0(PAPER, FREQUENCY, damping)
    np.testing.assert_allclose(g, paper_formula(PAPER, FREQUENCY, damping), rtol=1e-9)


@given(
    st.fixed_dictionaries(
        {
            "j": st.floats(0.05, 2.0),
            "jm": st.floats(0.05, 2.0),
            "fv": st.floats(0.1, 10.0),
            "fvm": st.floats(0.1, 10.0),
            "fs": st.floats(0.0, 10.0),
            "fsm": st.floats(0.0, 10.0),
            "k0": st.floats(100.0, 5000.0),
        }
    ),
    st.sampled_from(["viscous", "paper"]),
)
def test_continuous_g0_is_the_formula_for_any_plant(values, damping):
    g = continuous_g0(values, FREQUENCY, damping)
    np.testing.assert_allclose(g, paper_formula(values, FREQUENCY, damping), rtol=1e-7)


@pytest.mark.parametrize("damping", ["viscous", "paper"])
@pytest.mark.parametrize("rate", [200.0, 1000.0, 5000.0])
def test_sampled_g0_is_scipys_zero_order_hold(rate, damping):
    a, b = linear.state_space(PAPER, damping)
    c = np.array([[0.0, 0.0, 1.0, 0.0]])
    ad, bd, cd, dd, _ = cont2discrete((a, b[:, None], c, np.zeros((1, 1))), 1.0 / rate, "zoh")
    z = np.exp(2j * np.pi * FREQUENCY / rate)
    expected = [(cd @ np.linalg.solve(zi * np.eye(4) - ad, bd) + dd)[0, 0] for zi in z]
    np.testing.assert_allclose(linear.g0(PAPER, FREQUENCY, rate, damping), expected, rtol=1e-8)


def test_hold_at_1_khz_costs_what_the_paper_notes_say():
    at_50 = np.array([50.0])
    ratio = linear.g0(PAPER, at_50, 1000.0) / continuous_g0(PAPER, at_50)
    assert decibels(ratio)[0] == pytest.approx(-0.04, abs=0.005)
    assert np.degrees(np.angle(ratio))[0] == pytest.approx(-9.0, abs=0.05)


def test_the_hold_vanishes_with_the_rate():
    fast, exact = linear.g0(PAPER, FREQUENCY, 1e6), continuous_g0(PAPER, FREQUENCY)
    np.testing.assert_allclose(fast, exact, rtol=2e-4)


def test_resonance_and_antiresonance_of_the_paper():
    undamped = {**PAPER, "fv": 0.0, "fvm": 0.0}
    a, _ = linear.state_space(undamped)
    assert np.abs(np.linalg.eigvals(a)).max() / (2 * np.pi) == pytest.approx(17.79, abs=0.005)
    frequency = np.linspace(5.0, 16.0, 110_001)
    dip = frequency[np.abs(continuous_g0(undamped, frequency)).argmin()]
    assert dip == pytest.approx(11.25, abs=0.01)
    assert dip == pytest.approx(np.sqrt(1500.0 / 0.3) / (2 * np.pi), abs=1e-3)


def test_shape_of_the_frequencies_is_kept():
    assert linear.g0(PAPER, np.ones((2, 3)), 1000.0).shape == (2, 3)


@pytest.mark.parametrize(("rate", "bound"), [(1000.0, 1e-4), (10_000.0, 1e-8)])
def test_a_linear_closed_loop_measures_the_sampled_g0(rate, bound):
    """The bound is the plant's integration error, which falls with the fourth power of the step."""
    excitation = multisine.EXCITATION.check(
        {
            "sample_rate_hz": rate,
            "base_frequency_hz": 0.5,
            "f_min_hz": 0.5,
            "grid": "full",
            "transient_periods": 9,
            "periods": 1,
        }
    )
    experiment = multisine.describe(excitation, 0, 0)
    values = plant.PLANT.check({"fs": 0.0, "fsm": 0.0, "k1": 0.0})
    controller = pd_filtered.CONTROLLER.check({"sample_rate_hz": rate})
    result = closed_loop.simulate(
        multisine.reference(experiment),
        rate,
        plant.coefficients(values),
        pd_filtered.coefficients(controller),
    )
    lines = np.array(experiment.excited_harmonics)
    assert lines.size == 100
    period = slice(-experiment.samples_per_period, None)
    y, u = np.fft.rfft(result.position[period])[lines], np.fft.rfft(result.torque[period])[lines]
    g0 = linear.g0(values, lines * 0.5, rate)
    assert (np.abs(y / u - g0) / np.abs(g0)).max() < bound
    np.testing.assert_allclose(controller_frf(controller, lines * 0.5), loop_gain(result, lines))


def controller_frf(controller, frequency):
    """C at the samples, from its difference equation (interface.md)."""
    decay = np.exp(-controller["n"] / controller["sample_rate_hz"])
    gain = controller["d"] * controller["n"]
    numerator = [controller["p"] + gain, -controller["p"] * decay - gain]
    w = 2 * np.pi * frequency / controller["sample_rate_hz"]
    return freqz(numerator, [1.0, -decay], w)[1]


def loop_gain(result, lines):
    """U / E of the last period."""
    samples = result.torque.size // 10
    error = (result.reference - result.position)[-samples:]
    return np.fft.rfft(result.torque[-samples:])[lines] / np.fft.rfft(error)[lines]
