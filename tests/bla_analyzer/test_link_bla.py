"""The BLA of a second output and the joint covariance of both, against plain formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_loop import RATE_HZ, experiment, lines

from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.repeats import pooled
from bla_analyzer.bla.robust import robust_bla
from fjr_records.spectra import PeriodSums, RealizationSpectra

GRID = lines()
N = 512


@pytest.fixture(scope="module")
def signals() -> tuple[np.ndarray, ...]:
    """r, u, y, q of a nonlinear loop, (realizations, periods, N); q lags y, noise of its own."""
    rng = np.random.default_rng(8)
    made = experiment(GRID, 6, 4, rng, cubic=1e-7, noise_std=1e-4)
    spectrum = np.fft.rfft(made.position)
    lag = 1.0 / (1.0 + 0.02j * np.arange(spectrum.shape[-1]))
    link = np.fft.irfft(0.7 * lag * spectrum, N) + 5e-5 * rng.standard_normal(made.position.shape)
    return made.reference, made.torque, made.position, link


def spectra(signals: tuple[np.ndarray, ...], periods: slice = slice(None)):
    made = []
    for m in range(len(signals[0])):
        sums = PeriodSums(N)
        for period in zip(*(signal[m, periods] for signal in signals), strict=True):
            sums.add(period)
        made.append(sums.spectra(RATE_HZ / N, GRID.last))
    return made


def test_the_joint_covariance_is_that_of_plain_formulas(signals):
    bla = robust_bla(spectra(signals), GRID.excited)
    r, u, y, q = (np.fft.rfft(s)[..., GRID.excited] * 2 / N for s in signals)
    turn = np.exp(-1j * np.angle(r[:, :1]))
    u, y, q = u * turn, y * turn, q * turn
    um, ym, qm = u.mean(1), y.mean(1), q.mean(1)
    g, g_link = ym.mean(0) / um.mean(0), qm.mean(0) / um.mean(0)
    power = np.abs(um.mean(0)) ** 2
    m, p = u.shape[:2]
    e, e_link = ym - g * um, qm - g_link * um
    np.testing.assert_allclose(bla.link.g, g_link, rtol=1e-9)
    np.testing.assert_allclose(
        bla.link.cov_total, (e_link * e.conj()).sum(0) / (m * (m - 1) * power), rtol=1e-7
    )
    np.testing.assert_allclose(
        bla.link.var_total, (np.abs(e_link) ** 2).sum(0) / (m * (m - 1) * power), rtol=1e-7
    )
    n = (y - ym[:, None]) - g * (u - um[:, None])
    n_link = (q - qm[:, None]) - g_link * (u - um[:, None])
    noise = (n_link * n.conj()).sum((0, 1)) / (m**2 * p * (p - 1) * power)
    np.testing.assert_allclose(bla.link.cov_noise, noise, rtol=1e-6)
    assert (np.abs(bla.link.cov_total) ** 2 <= bla.link.var_total * bla.var_total * 1.001).all()
    alone = robust_bla(spectra(signals[:3]), GRID.excited)
    assert alone.link is None
    np.testing.assert_array_equal(alone.var_total, bla.var_total)


@pytest.mark.parametrize("method", ["robust", "fast"])
def test_a_link_that_is_the_motor_behind_a_gear_has_its_bla_and_covariance(signals, method):
    gear = -0.25
    made = spectra((*signals[:3], gear * signals[2]))
    bla = robust_bla(made, GRID.excited) if method == "robust" else fast_bla(made[0], GRID)
    np.testing.assert_allclose(bla.link.g, gear * bla.g, rtol=1e-9)
    np.testing.assert_allclose(bla.link.cov_total, gear * bla.var_total, rtol=1e-6, atol=1e-30)
    np.testing.assert_allclose(bla.link.cov_noise, gear * bla.var_noise, rtol=1e-6)
    np.testing.assert_allclose(bla.link.radius_95, abs(gear) * bla.radius_95, rtol=1e-6)


def test_periods_that_come_in_two_bags_are_those_of_one(signals):
    whole = spectra(signals)[0]
    halves = [spectra(signals, part)[0] for part in (slice(0, 2), slice(2, 4))]
    both = pooled(halves)
    for name in (
        f for f in RealizationSpectra.__dataclass_fields__ if f not in ("link", "periods")
    ):
        np.testing.assert_allclose(getattr(both, name), getattr(whole, name), rtol=1e-6, atol=1e-22)
    for name in ("mean", "var", "cov_torque", "cov_position"):
        np.testing.assert_allclose(
            getattr(both.link, name), getattr(whole.link, name), rtol=1e-6, atol=1e-22
        )


def test_errors_of_both_outputs_scatter_as_their_covariance_says():
    """The product of both errors, over 100 experiments of four realizations and all lines."""
    rng = np.random.default_rng(3)
    made = experiment(GRID, 400, 2, rng, noise_std=1e-4)
    link = made.position + 1e-4 * rng.standard_normal(made.position.shape)
    every = spectra((made.reference, made.torque, made.position, link))
    whole = robust_bla(every, GRID.excited)
    ratio = []
    for i in range(0, 400, 4):
        bla = robust_bla(every[i : i + 4], GRID.excited)
        cross = (bla.link.g - whole.link.g) * np.conj(bla.g - whole.g)
        ratio.append((cross.real.mean(), bla.link.cov_total.real.mean()))
    found, said = np.mean(ratio, axis=0)
    assert found == pytest.approx(said, rel=0.1) and said > 0.0


def test_a_level_whose_bags_do_not_all_have_the_link_is_of_one_output(signals):
    made = spectra(signals)
    made[2] = replace(made[2], link=None)
    assert robust_bla(made, GRID.excited).link is None
