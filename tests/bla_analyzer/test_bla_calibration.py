"""Monte Carlo: do the predicted variances and discs hold over 150 experiments of M = 7, P = 2?

Bounds: a line's empirical variance from 150 experiments is good to 8 %, the median over 68 lines to
about 1.5 %; 10,200 discs give the coverage to about 0.3 %.
"""

from __future__ import annotations

import numpy as np
import pytest
import simulated_loop as loop

from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT, confidence_radius, robust_bla

EXPERIMENTS, M, P = 150, 7, 2
GRID = loop.lines()
NOISE = 0.05
CUBIC = 2e-7


def all_spectra(cubic, noise_std, seed=1):
    rng = np.random.default_rng(seed)
    signals = loop.experiment(
        GRID, EXPERIMENTS * M, P, rng, cubic=cubic, noise_std=noise_std, transient=3
    )
    return loop.spectra(signals, GRID.last)


def robust_experiments(spectra):
    return [robust_bla(spectra[i : i + M], GRID.excited) for i in range(0, len(spectra), M)]


def column(estimates, name):
    return np.array([getattr(one, name) for one in estimates])


@pytest.fixture(scope="module")
def nonlinear():
    return all_spectra(CUBIC, NOISE)


@pytest.fixture(scope="module")
def linear():
    return all_spectra(0.0, NOISE)


@pytest.fixture(scope="module")
def fast_linear(linear):
    return [fast_bla(one, GRID) for one in linear]


@pytest.mark.parametrize("case", ["linear", "nonlinear"])
def test_robust_variance_and_discs_are_calibrated(case, request):
    estimates = robust_experiments(request.getfixturevalue(case))
    g = column(estimates, "g")
    ratio = g.var(axis=0, ddof=1) / column(estimates, "var_total").mean(axis=0)
    assert 0.95 < np.median(ratio) < 1.05
    covered = np.abs(g - g.mean(axis=0)) <= column(estimates, "radius_95")
    assert 0.93 < covered.mean() < 0.97


def test_f_test_is_uniform_for_a_linear_loop_and_small_for_a_nonlinear_one(linear, nonlinear):
    p = column(robust_experiments(linear), "nonlinear_p_value")
    for level in (0.05, 0.5, 0.95):
        assert np.mean(p < level) == pytest.approx(level, abs=0.02)
    assert np.mean(column(robust_experiments(nonlinear), "nonlinear_p_value") < 0.05) > 0.15


def test_signed_nonlinear_variance_is_unbiased_and_clipping_is_not(linear):
    estimates = robust_experiments(linear)
    relative = column(estimates, "var_nonlinear") / (
        M * column(estimates, "var_noise").mean(axis=0)
    )
    assert abs(relative.mean()) < 0.03
    assert 0.45 < np.mean(relative < 0) < 0.6
    assert np.maximum(relative, 0.0).mean() > 0.15


def test_signed_nonlinear_variance_meets_that_of_the_same_loop_without_noise(nonlinear):
    noisy = column(robust_experiments(nonlinear), "var_nonlinear").mean(axis=0)
    clean = robust_experiments(all_spectra(CUBIC, 0.0))
    truth = M * column(clean, "var_total").mean(axis=0)
    noise = M * column(robust_experiments(nonlinear), "var_noise").mean(axis=0)
    strong = truth > 0.2 * noise
    assert strong.sum() > 5
    assert np.median(noisy[strong] / truth[strong]) == pytest.approx(1.0, abs=0.15)


def test_noise_variance_falls_with_periods_and_matches_the_fast_method(linear, fast_linear):
    robust = column(robust_experiments(linear), "var_noise").mean(axis=0)
    fast = column(fast_linear, "var_noise").mean(axis=0)
    np.testing.assert_allclose(fast / (M * robust), 1.0, atol=0.02)


def test_fast_variance_and_discs_are_calibrated_where_distortion_is_smooth(
    linear, fast_linear, nonlinear
):
    fast_nonlinear = [fast_bla(one, GRID) for one in nonlinear]
    cases = (linear, fast_linear, 0.93), (nonlinear, fast_nonlinear, 0.90)
    for spectra, estimates, lowest in cases:
        g = column(estimates, "g")
        ratio = g.var(axis=0, ddof=1) / column(estimates, "var_total").mean(axis=0)
        assert 0.9 < np.median(ratio) < 1.1
        truth = column(robust_experiments(spectra), "g").mean(axis=0)
        covered = np.abs(g - truth) <= column(estimates, "radius_95")
        assert lowest < covered.mean() < 0.97


def noisy_input_experiments(input_variance, count, trials=40_000):
    """Return (U, Y), each (trials, count): G U0 = 0.7 and errors on U alone, U0 = 1."""
    parts = np.random.default_rng(11).standard_normal((2, trials, count))
    error = (parts[0] + 1j * parts[1]) * np.sqrt(count * input_variance / 2)
    return 1.0 + error, np.full(error.shape, 0.7 + 0j)


def test_bias_by_noise_on_the_input_is_the_documented_one():
    for input_variance in (INPUT_VARIANCE_LIMIT, 0.25, 0.5):
        torque, position = noisy_input_experiments(input_variance, 1, 400_000)
        mean = np.mean(position / torque)
        assert abs(mean / 0.7 - (1 - np.exp(-1 / input_variance))) < 0.01


@pytest.mark.parametrize("count", [2, 3, 7, 40])
def test_discs_hold_up_to_the_limit_of_the_input_variance(count):
    torque, position = noisy_input_experiments(INPUT_VARIANCE_LIMIT, count)
    mean = torque.mean(axis=1)
    got = position.mean(axis=1) / mean
    residual = (np.abs(position - got[:, None] * torque) ** 2).sum(axis=1)
    variance = residual / (count * (count - 1) * np.abs(mean) ** 2)
    covered = np.abs(got - 0.7) <= confidence_radius(variance, count - 1)
    assert 0.93 < covered.mean() < 0.97
