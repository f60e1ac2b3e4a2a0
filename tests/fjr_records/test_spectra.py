from __future__ import annotations

import numpy as np
import pytest
import simulated_loop as loop

from fjr_records.lines import classify, interpolate_frf, local_mean, nearest
from fjr_records.spectra import PeriodSums, line_spectrum


def test_lines_are_scaled_to_peak_amplitude():
    time = np.arange(100) / 100
    x = 3.0 + 0.5 * np.cos(2 * np.pi * 7 * time + 0.3) + 2.0 * np.sin(2 * np.pi * 20 * time)
    spectrum = line_spectrum(x)
    assert spectrum[0] == pytest.approx(3.0)
    assert spectrum[7] == pytest.approx(0.5 * np.exp(0.3j))
    assert abs(spectrum[20]) == pytest.approx(2.0)
    assert np.abs(np.delete(spectrum, [0, 7, 20])).max() < 1e-14


@pytest.mark.parametrize("periods", [2, 3, 19])
def test_running_sums_equal_sums_over_all_periods(periods):
    rng = np.random.default_rng(periods)
    data = rng.standard_normal((3, periods, 64)) + 1e3  # a large mean must not cost digits
    sums = PeriodSums(64)
    for p in range(periods):
        sums.add(tuple(data[:, p]))
    got = sums.spectra(0.5, 20)

    lines = np.fft.rfft(data)[..., :21] * 2 / 64
    lines[..., 0] /= 2
    mean = lines.mean(axis=1)
    d_u, d_y = lines[1] - mean[1], lines[2] - mean[2]
    scale = 1 / (periods * (periods - 1))
    np.testing.assert_allclose(got.frequency_hz, 0.5 * np.arange(21))
    np.testing.assert_allclose([got.reference, got.torque, got.position], mean, rtol=1e-12)
    np.testing.assert_allclose(got.var_torque, (abs(d_u) ** 2).sum(0) * scale, rtol=1e-10)
    np.testing.assert_allclose(got.var_position, (abs(d_y) ** 2).sum(0) * scale, rtol=1e-10)
    np.testing.assert_allclose(
        got.cov_position_torque, (d_y * d_u.conj()).sum(0) * scale, rtol=0, atol=1e-10
    )


def test_one_period_leaves_the_noise_unknown():
    sums = PeriodSums(16)
    sums.add(tuple(np.random.default_rng(0).standard_normal((3, 16))))
    got = sums.spectra(1.0, 5)
    assert np.isfinite(got.torque).all()
    assert np.isnan(got.var_torque).all()
    assert np.isnan(got.var_position).all()
    assert np.isnan(got.cov_position_torque).all()


def test_whatever_is_not_excited_is_a_detection_line():
    lines = classify([3, 9, 5, 11], [7, 13])
    assert lines.excited.tolist() == [3, 5, 9, 11]
    assert lines.odd.tolist() == [7, 13]
    assert lines.even.tolist() == [4, 6, 8, 10, 12]
    assert (lines.first, lines.last) == (3, 13)


def test_detection_line_below_the_excited_ones_belongs_to_the_band():
    lines = classify([13, 17], [11, 15])
    assert lines.odd.tolist() == [11, 15]
    assert lines.even.tolist() == [12, 14, 16]


def test_every_line_excited_leaves_none():
    lines = classify(range(2, 9))
    assert lines.odd.size == lines.even.size == 0
    assert lines.last == 8


@pytest.mark.parametrize("order", [-2, -1, 0, 1])
def test_interpolation_is_exact_for_powers_of_s(order):
    known = np.array([1, 5, 7, 21])
    asked = np.array([2, 3, 6, 11, 20])
    got = interpolate_frf(asked, known, 3.0 * (1j * known) ** order)
    np.testing.assert_allclose(got, 3.0 * (1j * asked) ** order, rtol=1e-12)


def test_interpolation_holds_beyond_the_ends_and_meets_known_lines():
    known, g = np.array([3, 5, 9]), np.array([1 + 1j, 2 - 1j, 0.5j])
    got = interpolate_frf(np.array([1, 3, 5, 9, 30]), known, g)
    np.testing.assert_allclose(got, [g[0], g[0], g[1], g[2], g[2]])
    np.testing.assert_array_equal(interpolate_frf(np.array([1, 8]), known[:1], g[:1]), g[[0, 0]])


def test_interpolated_frf_of_the_loop_is_close_between_lines():
    z = np.exp(2j * np.pi * np.arange(1, 100) / 1024)
    g = 1 / ((z - 1) ** 2 + 0.12 * (z - 1) + 0.01)
    known = np.arange(1, 100, 2)
    asked = np.arange(2, 99, 2)
    got = interpolate_frf(asked, known, g[known - 1])
    assert (np.abs(got / g[asked - 1] - 1) < 0.05).all()


def test_nearest_lines():
    candidates = np.array([1, 4, 9, 10])
    got = nearest(np.array([2, 11]), candidates, 2)
    assert candidates[got].tolist() == [[1, 4], [10, 9]]


def test_the_simulated_loop_is_the_linear_loop_without_cubic_term():
    grid = loop.lines()
    signals = loop.experiment(grid, 1, 1, np.random.default_rng(0), transient=6)
    k = grid.excited
    u, y = line_spectrum(signals.torque[0, 0])[k], line_spectrum(signals.position[0, 0])[k]
    z, h = np.exp(2j * np.pi * k / 512), 1 / loop.RATE_HZ
    g = h**2 * z / ((z - 1) * (z - 1 + 12.0 * h) + 100.0 * h**2 * z)
    np.testing.assert_allclose(y / u, g, rtol=1e-8)


@pytest.mark.parametrize("lines", [1, 2, 4, 7, 20])
def test_a_local_mean_has_as_many_lines_and_takes_the_neighbours_that_there_are(lines):
    values = np.random.default_rng(lines).normal(size=lines)
    near = [values[max(k - 3, 0) : k + 4].mean() for k in range(lines)]
    np.testing.assert_allclose(local_mean(values, 7), near, rtol=1e-12)
