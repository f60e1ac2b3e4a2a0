"""Noise of mean spectra: against many periods, white noise of known size, and the limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import NOISE_RAD, simulate_case, write_bags

from fjr_records.noise import noise_levels, scatter_of_mean, smoothed
from fjr_records.periodic import RecordedExperiment, read_experiment


def test_smoothing_keeps_white_noise_unbiased_and_states_its_degrees_of_freedom():
    rng = np.random.default_rng(1)
    lines, trials = 120, 400
    dof = np.full(lines, 4.0)
    dof[0] = 2.0
    mean = np.ones(lines)
    mean[0] = 0.25
    raw = mean * rng.chisquare(dof, (trials, lines)) / dof
    smooth = np.array([smoothed(row, dof)[0] for row in raw])
    degrees = smoothed(raw[0], dof)[1]
    assert np.abs(smooth.mean(0) / mean - 1.0).max() < 4.0 * np.sqrt(2.0 / degrees.min() / trials)
    spread = smooth.var(0) / mean**2 / (2.0 / degrees)
    assert spread.min() > 0.7 and spread.max() < 1.4
    assert degrees[0] == 2 + 4 and degrees[60] == 4 * 9


def test_white_sensor_noise_outside_a_loop_has_the_known_line_noise():
    case = simulate_case(levels_rad=(7e-3,), noise_rad=0.0)
    rng = np.random.default_rng(2)
    recorded = RecordedExperiment(
        "white",
        tuple(
            replace(r, position=r.position + 1e-4 * rng.standard_normal(r.position.shape))
            for r in case.recorded.realizations
        ),
    )
    noise = noise_levels(recorded)
    samples = recorded.experiment.samples_per_period
    expected = np.full(recorded.lines, 1e-4 * 2.0 / np.sqrt(samples) / np.sqrt(2.0))
    expected[0] *= 0.5
    log_ratio = np.log(noise.position[0] / expected)
    assert abs(log_ratio[1:].mean()) < 0.05
    assert np.abs(log_ratio).max() < 4.0 * np.sqrt(0.5 / noise.dof.min())


@pytest.fixture(scope="module")
def case():
    return simulate_case(seed=1)


def test_two_periods_give_the_noise_that_many_periods_show(case):
    noise = noise_levels(case.recorded)
    many = simulate_case(seed=1, periods=60, realizations=1)
    for row, realization in enumerate(many.recorded.realizations):
        for name in ("position", "torque"):
            power = scatter_of_mean(realization, getattr(realization, name), many.recorded.lines)
            ratio = getattr(noise, name)[row] / np.sqrt(power * 60 / 2)
            assert abs(np.log(ratio[10:]).mean()) < 0.1
            assert np.abs(np.log(ratio[1:])).max() < 1.2


def test_noise_read_from_bags_is_that_of_the_arrays(case, tmp_path):
    read = read_experiment(write_bags(case, tmp_path / "bags"))
    mine, theirs = noise_levels(case.recorded), noise_levels(read)
    np.testing.assert_allclose(theirs.position, mine.position, rtol=1e-9)
    assert theirs.levels == (0, 1, 2) and theirs.row(2) == 2


def test_one_period_gives_no_noise():
    assert noise_levels(simulate_case(periods=1, levels_rad=(7e-3,)).recorded) is None


def test_one_realization_is_enough_with_half_the_degrees_of_freedom(case):
    first = RecordedExperiment("one", case.recorded.realizations[::2])
    np.testing.assert_allclose(noise_levels(first).dof, noise_levels(case.recorded).dof / 2)


def test_more_periods_give_less_noise_of_the_mean_and_more_degrees_of_freedom(case):
    more = noise_levels(simulate_case(seed=1, periods=8).recorded)
    fewer = noise_levels(case.recorded)
    ratio = np.median(more.position / fewer.position)
    assert 0.42 < ratio < 0.58
    np.testing.assert_allclose(more.dof, 7 * fewer.dof)


def test_without_noise_the_numerical_floor_stands():
    case = simulate_case(levels_rad=(7e-3,), noise_rad=0.0)
    noise = noise_levels(case.recorded)
    assert not noise.measurable[0]
    assert 0 < noise.position.max() < 1e-3 * NOISE_RAD
    assert noise_levels(simulate_case(levels_rad=(7e-3,)).recorded).measurable[0]
