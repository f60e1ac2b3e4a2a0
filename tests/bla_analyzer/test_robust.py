from __future__ import annotations

import numpy as np
import pytest
import simulated_loop as loop
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from bla_analyzer.bla.robust import confidence_radius, robust_bla
from bla_analyzer.compare.metrics import ReferenceModel, compare, squared_error_db
from bla_analyzer.distortion.levels import line_levels
from fjr_kit.errors import InputError
from fjr_records.lines import interpolate_frf

GRID = loop.lines(128)


def simulate(periods=2, count=7, seed=0, **options):
    rng = np.random.default_rng(seed)
    options = {"cubic": 2e-7, "noise_std": 0.05} | options
    return loop.experiment(GRID, count, periods, rng, samples=128, **options)


def transcription(signals, lines):
    """paper.md's robust method, line by line, from all periods at once."""
    dft = lambda x: np.fft.fft(x, axis=-1)[..., lines] * 2 / x.shape[-1]  # noqa: E731
    R, U, Y = dft(signals.reference), dft(signals.torque), dft(signals.position)
    M, P = U.shape[:2]
    turn = np.exp(-1j * np.angle(R.mean(axis=1)))[:, None]
    U, Y = U * turn, Y * turn
    Um, Ym = U.mean(axis=1), Y.mean(axis=1)
    U0, Y0 = Um.mean(axis=0), Ym.mean(axis=0)
    G = Y0 / U0

    def covariance(dy, du):
        return (abs(dy) ** 2).sum(0), (abs(du) ** 2).sum(0), (dy * du.conj()).sum(0)

    def variance(yy, uu, yu):
        return abs(G) ** 2 * (
            yy / abs(Y0) ** 2 + uu / abs(U0) ** 2 - 2 * (yu / (Y0 * U0.conj())).real
        )

    DY = (Y - Ym[:, None]).reshape(M * P, -1)
    DU = (U - Um[:, None]).reshape(M * P, -1)
    noise = variance(*(c / (P * (P - 1) * M**2) for c in covariance(DY, DU)))
    total_covariance = [c / (M * (M - 1)) for c in covariance(Ym - Y0, Um - U0)]
    total = variance(*total_covariance)
    p_value = stats.f.sf(total / noise, 2 * (M - 1), 2 * M * (P - 1))
    return {
        "g": G,
        "var_total": total,
        "var_noise": noise,
        "var_nonlinear": M * (total - noise),
        "nonlinear_p_value": p_value,
        "radius_95": np.sqrt(total * stats.f.ppf(0.95, 2, 2 * (M - 1))),
        "input_relative_variance": total_covariance[1] / abs(U0) ** 2,
    }


@pytest.mark.parametrize(("periods", "count"), [(2, 7), (3, 2), (5, 12)])
def test_equals_a_plain_transcription_of_the_formulas(periods, count):
    signals = simulate(periods, count, seed=periods)
    got = robust_bla(loop.spectra(signals, GRID.last), GRID.excited)
    expected = transcription(signals, GRID.excited)
    scale = {"var_nonlinear": count * expected["var_total"]}
    for name, values in expected.items():
        error = np.abs(getattr(got, name) - values) / np.abs(scale.get(name, values))
        assert error.max() < 1e-10, name
    assert (got.method, got.realizations, got.periods) == ("robust", count, periods)
    np.testing.assert_allclose(got.frequency_hz, GRID.excited * loop.RATE_HZ / 128)


def test_total_variance_is_the_residual_around_the_bla():
    spectra = loop.spectra(simulate(), GRID.last)
    got = robust_bla(spectra, GRID.excited)
    turn = [np.exp(-1j * np.angle(one.reference[GRID.excited])) for one in spectra]
    U = np.array([one.torque[GRID.excited] * t for one, t in zip(spectra, turn, strict=True)])
    Y = np.array([one.position[GRID.excited] * t for one, t in zip(spectra, turn, strict=True)])
    residual = (abs(Y - got.g * U) ** 2).sum(0) / (7 * 6 * abs(U.mean(0)) ** 2)
    np.testing.assert_allclose(got.var_total, residual, rtol=1e-10)


def test_ratio_of_means_and_not_the_mean_of_ratios():
    spectra = loop.spectra(simulate(noise_std=0.5), GRID.last)
    got = robust_bla(spectra, GRID.excited).g
    ratios = np.mean([one.position / one.torque for one in spectra], axis=0)[GRID.excited]
    assert np.abs(got / ratios - 1).max() > 1e-3


def test_detection_lines_are_corrected_in_the_closed_loop():
    signals = simulate()
    spectra = loop.spectra(signals, GRID.last)
    bla = robust_bla(spectra, GRID.excited)
    for at in (GRID.odd, GRID.even):
        got = line_levels(spectra, GRID, at, bla.g)
        g = interpolate_frf(at, GRID.excited, bla.g)
        U = np.fft.fft(signals.torque)[..., at] * 2 / 128
        Y = np.fft.fft(signals.position)[..., at] * 2 / 128
        R = np.fft.fft(signals.reference)[..., at] * 2 / 128
        Yc = (Y - g * U).mean(axis=1)
        scatter = Y - g * U - Yc[:, None]
        np.testing.assert_allclose(got.corrected, np.sqrt((abs(Yc) ** 2).mean(0)), rtol=1e-10)
        np.testing.assert_allclose(
            got.noise, np.sqrt((abs(scatter) ** 2).sum((0, 1)) / (7 * 2)), rtol=1e-10
        )
        np.testing.assert_allclose(got.torque, np.sqrt((abs(U.mean(1)) ** 2).mean(0)), rtol=1e-10)
        np.testing.assert_allclose(got.position, np.sqrt((abs(Y.mean(1)) ** 2).mean(0)))
        np.testing.assert_allclose(got.reference, np.sqrt((abs(R) ** 2).mean((0, 1))), atol=1e-15)
        middle = at.size // 2
        window = np.argsort(abs(at - at[middle]), kind="stable")[:7]
        np.testing.assert_allclose(
            got.smoothed[middle], np.sqrt((got.corrected[window] ** 2).mean()), rtol=1e-12
        )


def test_correction_takes_away_what_the_loop_feeds_back():
    # Without distortion and noise, a disturbance on the reference at silent lines is no distortion.
    rng = np.random.default_rng(3)
    period = loop.multisines(GRID.excited, 4, 128, rng)
    period += 0.1 * loop.multisines(GRID.odd, 4, 128, rng)
    torque, position = loop.run(np.tile(period, 12), 0.0)
    part = slice(10 * 128, None)
    shape = (4, 2, 128)
    signals = loop.Signals(
        *(x[:, part].reshape(shape) for x in (np.tile(period, 12), torque, position))
    )
    spectra = loop.spectra(signals, GRID.last)
    levels = line_levels(spectra, GRID, GRID.odd, robust_bla(spectra, GRID.excited).g)
    assert (levels.corrected < 0.1 * levels.position).all()


def test_even_lines_are_at_round_off_for_an_odd_nonlinearity_without_noise():
    signals = simulate(noise_std=0.0, transient=8, cubic=2e-7)
    spectra = loop.spectra(signals, GRID.last)
    bla = robust_bla(spectra, GRID.excited)
    excited = line_levels(spectra, GRID, GRID.excited, bla.g).position.max()
    assert line_levels(spectra, GRID, GRID.even, bla.g).corrected.max() < 1e-13 * excited
    assert line_levels(spectra, GRID, GRID.odd, bla.g).corrected.max() > 1e-6 * excited


def test_linear_noise_free_loop_has_no_variance():
    spectra = loop.spectra(simulate(noise_std=0.0, transient=12, cubic=0.0), GRID.last)
    got = robust_bla(spectra, GRID.excited)
    assert (got.radius_95 < 1e-10 * np.abs(got.g)).all()
    assert got.reliable.all()


def test_one_period_leaves_the_noise_unknown_and_the_rest_known():
    got = robust_bla(loop.spectra(simulate(periods=1), GRID.last), GRID.excited)
    for name in ("var_noise", "var_nonlinear", "nonlinear_p_value"):
        assert np.isnan(getattr(got, name)).all()
    assert np.isfinite(got.radius_95).all()


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_realizations_are_refused_with_the_way_out(count):
    spectra = loop.spectra(simulate(count=1), GRID.last)[:count]
    with pytest.raises(InputError, match=f"has {count}; record more, or use the fast method"):
        robust_bla(spectra, GRID.excited)


def test_lines_with_a_strong_input_variance_are_flagged():
    signals = simulate(count=3, noise_std=0.0)
    drowned = int(GRID.excited[5])
    torque = signals.torque.copy()
    wave = np.cos(2 * np.pi * drowned * np.arange(128) / 128)
    level = np.abs(np.fft.fft(torque)[..., drowned]).max() * 2 / 128
    torque += np.array([4.0, -4.0, 4.0])[:, None, None] * level * wave
    got = robust_bla(
        loop.spectra(loop.Signals(signals.reference, torque, signals.position), GRID.last),
        GRID.excited,
    )
    assert got.reliable.tolist() == [line != drowned for line in GRID.excited]


def test_radius_quantile_is_that_of_the_f_distribution():
    degrees = np.array([1, 2, 6, 39, 99])
    expected = np.sqrt(3.0 * stats.f.ppf(0.95, 2, 2 * degrees))
    np.testing.assert_allclose([confidence_radius(3.0, n) for n in degrees], expected)


SIGNALS = simulate(count=4)


@settings(max_examples=25)
@given(
    shift=st.integers(0, 127),
    torque=st.floats(1e-3, 1e3),
    position=st.floats(1e-3, 1e3),
    reference=st.floats(1e-3, 1e3),
    order=st.permutations(range(4)),
)
def test_invariance_under_shift_scale_and_order(shift, torque, position, reference, order):
    before = robust_bla(loop.spectra(SIGNALS, GRID.last), GRID.excited)
    moved = loop.Signals(
        *(
            np.roll(signal, shift, axis=-1)[list(order)] * gain
            for signal, gain in (
                (SIGNALS.reference, reference),
                (SIGNALS.torque, torque),
                (SIGNALS.position, position),
            )
        )
    )
    after = robust_bla(loop.spectra(moved, GRID.last), GRID.excited)
    gain = position / torque
    np.testing.assert_allclose(after.g, gain * before.g, rtol=1e-9)
    np.testing.assert_allclose(after.var_total, gain**2 * before.var_total, rtol=1e-7)
    np.testing.assert_allclose(after.var_noise, gain**2 * before.var_noise, rtol=1e-7)
    np.testing.assert_allclose(after.nonlinear_p_value, before.nonlinear_p_value, rtol=1e-5)


def test_metric_of_equation_14_and_its_variants():
    bla = robust_bla(loop.spectra(simulate(), GRID.last), GRID.excited)
    model = ReferenceModel("flat", "a gain", lambda f, rate: np.full(f.shape, 2e-3 + rate * 0j))
    got = compare(bla, model, 100.0)
    error = (20 * np.log10(2e-3) - 20 * np.log10(abs(bla.g))) ** 2
    above = error[bla.frequency_hz >= 1]
    assert 0 < above.size < error.size
    assert got.v_mean == pytest.approx(error.mean())
    assert got.v_median == pytest.approx(np.median(error))
    assert got.v_mean_above_1hz == pytest.approx(above.mean())
    assert got.v_median_above_1hz == pytest.approx(np.median(above))
    np.testing.assert_allclose(squared_error_db(np.array([10j]), np.array([1.0])), [400.0])
