from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations_with_replacement, permutations

import numpy as np
import pytest
import simulated_loop as loop
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import optimize, stats

from bla_analyzer.bla.fast import NEIGHBOURS, fast_bla
from bla_analyzer.distortion.levels import line_levels
from bla_analyzer.distortion.resonant_poles import resonant_poles
from fjr_kit.errors import InputError
from fjr_records.lines import Lines

GRID = loop.lines(128)


def simulate(periods=7, **options):
    options = {"cubic": 2e-7, "noise_std": 0.05} | options
    rng = np.random.default_rng(5)
    return loop.experiment(GRID, 1, periods, rng, samples=128, **options)


def third_order(power):
    """Stochastic power of all products of three lines, enumerated: {line: power}."""
    found = Counter()
    signed = [sign * line for line in power for sign in (1, -1)]
    for product in combinations_with_replacement(signed, 3):
        line = sum(product)
        orders = len(set(permutations(product)))
        repeats_in_each_realization = line in product
        if line > 0 and not repeats_in_each_realization:
            found[line] += orders**2 * np.prod([power[abs(one)] for one in product])
    return found


def transcription(signals, grid):
    """paper.md's fast method from all periods at once, G interpolated by a plain loop."""
    dft = lambda x: np.fft.fft(x[0], axis=-1) * 2 / x.shape[-1]  # noqa: E731
    U, Y = dft(signals.torque), dft(signals.position)
    P = len(U)
    U0, Y0 = U.mean(0), Y.mean(0)
    k = grid.excited
    G = Y0[k] / U0[k]

    def at(line):
        if line <= k[0] or line >= k[-1]:
            return G[0] if line <= k[0] else G[-1]
        b = next(i for i in range(k.size) if k[i] >= line)
        w = np.log(line / k[b - 1]) / np.log(k[b] / k[b - 1])
        return G[b - 1] * np.exp(w * np.log(G[b] / G[b - 1]))

    def noise(line, g):
        d = (Y - Y0)[:, line] - g * (U - U0)[:, line]
        return (abs(d) ** 2).sum() / (P * (P - 1))

    def local(line, near, power):
        """exp(a + b x) by maximum likelihood, b by root finding, a in closed form, unbiased."""
        x = np.log(np.array(near) / line)
        part = lambda b: power * np.exp(-b * x)  # noqa: E731
        slope = lambda b: (x * part(b)).sum() / part(b).sum() - x.mean()  # noqa: E731
        mean = part(optimize.brentq(slope, -150.0, 150.0, xtol=1e-14, rtol=1e-14)).mean()
        X = np.stack([np.ones(x.size), x], axis=1)
        C = np.linalg.inv(X.T @ X)
        bias = C[0, 0] / 2 - (C @ X.T @ np.diag(X @ C @ X.T))[0] / 2
        return mean * np.exp(-bias), 1 / C[0, 0]

    poles = resonant_poles(k / 1.28, G)
    peaks = lambda line: abs(np.prod(abs(poles) ** 2 / ((1j * line / 1.28 - poles)  # noqa: E731
                             * (1j * line / 1.28 - poles.conj())))) ** 2  # fmt: skip
    triples = third_order({line: (line * abs(Y0[line])) ** 2 for line in k})
    shape = lambda line: peaks(line) * triples[line]  # noqa: E731

    var_noise = [noise(line, g) / abs(U0[line]) ** 2 for line, g in zip(k, G, strict=True)]
    total, p_value, var_input, degrees = [], [], [], []
    for line in k:
        near = sorted(grid.odd, key=lambda odd: (abs(odd - line), odd))[:NEIGHBOURS]
        power = np.array([abs(Y0[n] - at(n) * U0[n]) ** 2 for n in near])
        ratio = power.mean() / np.mean([noise(n, at(n)) for n in near])
        plain, freedom = local(line, near, power)
        whitened, _ = local(line, near, power / [shape(n) for n in near])
        share = min(1 / ratio, 1)
        expected = share * plain + (1 - share) * whitened * shape(line)
        total.append(expected / abs(U0[line]) ** 2)
        degrees.append(freedom)
        p_value.append(stats.f.sf(ratio, 2 * len(near), 2 * len(near) * (P - 1)))
        var_input.append(np.mean([abs(U0[n]) ** 2 for n in near]) / abs(U0[line]) ** 2)
    total, var_noise = np.array(total), np.array(var_noise)
    return {
        "g": G,
        "var_noise": var_noise,
        "var_total": total,
        "var_nonlinear": total - var_noise,
        "nonlinear_p_value": np.array(p_value),
        "radius_95": np.sqrt(total * stats.f.ppf(0.95, 2, 2 * np.array(degrees))),
        "input_relative_variance": np.array(var_input),
    }


@pytest.mark.parametrize("periods", [2, 7])
def test_equals_a_plain_transcription_of_the_formulas(periods):
    signals = simulate(periods)
    got = fast_bla(loop.spectra(signals, GRID.last)[0], GRID)
    expected = transcription(signals, GRID)
    scale = {"var_nonlinear": expected["var_total"]}
    for name, values in expected.items():
        error = np.abs(getattr(got, name) - values) / np.abs(scale.get(name, values))
        assert error.max() < 1e-10, name
    assert (got.method, got.realizations, got.periods) == ("fast", 1, periods)


def test_even_lines_are_at_round_off_for_an_odd_nonlinearity_without_noise():
    spectra = loop.spectra(simulate(noise_std=0.0, transient=8), GRID.last)
    g = fast_bla(spectra[0], GRID).g
    excited = line_levels(spectra, GRID, GRID.excited, g).position.max()
    assert line_levels(spectra, GRID, GRID.even, g).corrected.max() < 1e-13 * excited
    assert line_levels(spectra, GRID, GRID.odd, g).corrected.max() > 1e-6 * excited


def test_one_period_is_refused_with_the_way_out():
    with pytest.raises(InputError, match=r"has 1; record more periods, or use the robust method"):
        fast_bla(loop.spectra(simulate(1), GRID.last)[0], GRID)


def test_without_detection_lines_only_the_total_variance_is_unknown():
    none = np.array([], int)
    grid = Lines(GRID.excited, none, none)
    spectra = loop.spectra(simulate(), GRID.last)[0]
    got, full = fast_bla(spectra, grid), fast_bla(spectra, GRID)
    for name in ("var_total", "var_nonlinear", "nonlinear_p_value", "radius_95"):
        assert np.isnan(getattr(got, name)).all()
    np.testing.assert_array_equal(got.g, full.g)
    np.testing.assert_array_equal(got.var_noise, full.var_noise)
    levels = line_levels([spectra], grid, grid.odd, got.g)
    assert levels.frequency_hz.size == levels.smoothed.size == levels.noise.size == 0


def test_few_detection_lines_give_few_degrees_of_freedom():
    grid = replace(GRID, odd=GRID.odd[:2])
    got = fast_bla(loop.spectra(simulate(), GRID.last)[0], grid)
    ratio = got.radius_95**2 / got.var_total
    np.testing.assert_allclose(ratio, stats.f.ppf(0.95, 2, 4))


SIGNALS = simulate(3)


@settings(max_examples=25)
@given(shift=st.integers(0, 127), torque=st.floats(1e-3, 1e3), position=st.floats(1e-3, 1e3))
def test_invariance_under_shift_and_scale(shift, torque, position):
    before = fast_bla(loop.spectra(SIGNALS, GRID.last)[0], GRID)
    moved = loop.Signals(
        np.roll(SIGNALS.reference, shift, axis=-1),
        np.roll(SIGNALS.torque, shift, axis=-1) * torque,
        np.roll(SIGNALS.position, shift, axis=-1) * position,
    )
    after = fast_bla(loop.spectra(moved, GRID.last)[0], GRID)
    gain = position / torque
    np.testing.assert_allclose(after.g, gain * before.g, rtol=1e-9)
    np.testing.assert_allclose(after.var_total, gain**2 * before.var_total, rtol=1e-7)
    np.testing.assert_allclose(after.var_noise, gain**2 * before.var_noise, rtol=1e-7)
