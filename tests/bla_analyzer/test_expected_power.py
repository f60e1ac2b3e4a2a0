"""The parts of the fast method's expected power, each against what it claims."""

from __future__ import annotations

import numpy as np
import simulated_loop as loop

from bla_analyzer.distortion.local_power import local_power
from bla_analyzer.distortion.resonant_poles import resonant_poles, resonant_power
from bla_analyzer.distortion.third_order import third_order_power

GRID = loop.lines()
FREQUENCY = 0.1 * GRID.excited


def two_inertias(frequency_hz, link=4.0, motor=2.0):
    s = 2j * np.pi * frequency_hz
    zero = 0.3 * s**2 + link * s + 1500.0
    return zero / (zero * (0.2 * s**2 + motor * s + 1500.0) - 1500.0**2)


def test_local_power_is_unbiased_and_as_certain_as_it_says():
    """4000 draws: the mean is good to 0.6 %, its variance to about 3 %."""
    rng = np.random.default_rng(3)
    law = GRID.odd.astype(float) ** -4
    inner = GRID.excited[(GRID.excited > GRID.odd[8]) & (GRID.excited < GRID.odd[-8])][::6]
    draws = [local_power(law * rng.exponential(size=law.size), GRID.odd, inner, 8)
             for _ in range(4000)]  # fmt: skip
    relative = np.array([found for found, _ in draws]) * inner.astype(float) ** 4
    np.testing.assert_allclose(relative.mean(axis=0), 1.0, atol=0.025)
    degrees = relative.mean(axis=0) ** 2 / relative.var(axis=0)
    np.testing.assert_allclose(degrees / draws[0][1], 1.0, atol=0.15)


def test_resonant_poles_of_a_scattered_frf_are_those_of_the_plant():
    """The integrator and the free body's real pole are not resonances."""
    poles = np.roots([0.06, 1.4, 758.0, 9000.0, 0.0])
    true = poles[poles.imag > 0][0] / (2 * np.pi)
    rng = np.random.default_rng(0)
    for _ in range(20):
        scatter = rng.standard_normal((2, FREQUENCY.size)) * 0.05
        g = two_inertias(FREQUENCY) * (1.0 + scatter[0] + 1j * scatter[1])
        found = resonant_poles(FREQUENCY, g)
        nearest = found[np.argmin(np.abs(found - true))]
        assert abs(nearest - true) < 0.15 * abs(true.real) + 0.1


def test_a_peak_narrower_than_three_lines_counts_as_that_wide_and_few_lines_give_none():
    found = resonant_poles(FREQUENCY, two_inertias(FREQUENCY, 0.01, 0.01))
    narrowest = 3.0 * np.median(np.diff(FREQUENCY))
    np.testing.assert_allclose(found.real.max(), -narrowest)
    assert resonant_poles(FREQUENCY[:8], two_inertias(FREQUENCY[:8])).size == 0
    assert resonant_poles(FREQUENCY, np.zeros(FREQUENCY.size, complex)).size == 0
    np.testing.assert_array_equal(resonant_power(FREQUENCY, np.empty(0, complex)), 1.0)


def test_third_order_power_is_that_of_a_cube_of_random_phase_multisines():
    """6000 realizations: a line's power is good to 1.3 %; the peak holds some six lines."""
    grid, samples, count = loop.lines(128), 512, 6000
    amplitude = 1.0 / (1.0 + ((grid.excited - 20) / 6.0) ** 2)
    rng = np.random.default_rng(1)
    spectrum = np.zeros((count, samples // 2 + 1), complex)
    phases = np.exp(2j * np.pi * rng.random((count, grid.excited.size)))
    spectrum[:, grid.excited] = amplitude * phases
    cube = np.fft.rfft(np.fft.irfft(spectrum, samples) ** 3)
    turned = cube[:, grid.excited] / phases
    excited = np.mean(np.abs(turned - turned.mean(axis=0)) ** 2, axis=0)
    odd = np.mean(np.abs(cube[:, grid.odd]) ** 2, axis=0)
    at = np.concatenate([grid.excited, grid.odd])
    ratio = np.concatenate([excited, odd]) / third_order_power(grid.excited, amplitude**2, at)
    np.testing.assert_allclose(ratio / np.median(ratio), 1.0, atol=0.07)
    flat_neighbours = np.interp(20, grid.odd, odd) / np.interp(20, grid.excited, excited)
    assert flat_neighbours > 1.1  # what the weights are for


def test_third_order_power_is_flat_where_not_all_lines_are_reached():
    at = np.array([1, 3, 5, 101])
    np.testing.assert_array_equal(third_order_power(np.array([1, 3]), np.ones(2), at), 1.0)
