"""Polynomials, hold and delay of a fit: against exact solutions."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_bla import FREQUENCY_HZ, LINEAR, RATE_HZ, linear_response
from hypothesis import given
from hypothesis import strategies as st

from bla_analyzer.fit.basis import Basis
from bla_analyzer.fit.physical import NAMES, polynomials
from bla_analyzer.fit.sampled import Sampled


@given(degree=st.integers(1, 14), decades=st.floats(0.3, 3.0), seed=st.integers(0, 99))
def test_polynomials_are_orthonormal_and_their_roots_are_roots(degree, decades, seed):
    rng = np.random.default_rng(seed)
    points = 1j * np.logspace(-decades, 0.0, 60)
    weights = np.exp(rng.normal(size=60))
    basis = Basis.on(points, weights, degree)
    values = basis.at(points) * weights[:, None]
    gram = (values.conj().T @ values).real
    np.testing.assert_allclose(gram, np.eye(degree + 1), atol=1e-8)
    coefficients = rng.normal(size=degree + 1)
    roots = basis.roots(coefficients)
    at, slope = basis.with_slope(roots)
    distance = np.abs(at @ coefficients) / np.abs(slope @ coefficients)
    assert (distance < 1e-6 * np.maximum(np.abs(roots), 1.0)).all()


def test_monomials_of_the_same_degree_are_worse_scaled_and_useless_in_z():
    f = np.logspace(-1, 1, 60)
    in_s, in_z = 1j * f / f.max(), np.exp(2j * np.pi * f / 1000.0)
    own = Basis.on(in_z, np.ones(60), 12).at(in_z)
    sizes = {}
    for name, columns in (
        ("s", in_s[:, None] ** np.arange(13)),
        ("z", in_z[:, None] ** np.arange(13)),
        ("own", own),
    ):
        sizes[name] = np.linalg.cond(np.concatenate([columns.real, columns.imag]))
    assert sizes["s"] > 1e4 and sizes["z"] > 1e16
    assert sizes["own"] < 1.0 + 1e-6


def test_aliases_of_a_held_torque_give_the_zero_order_hold_equivalent():
    seen = Sampled.of(FREQUENCY_HZ, RATE_HZ)
    upper, lower = polynomials("two-inertia", LINEAR)
    weight = seen.delayed(0.0) / np.polyval(lower, seen.s)
    g = np.stack([(weight * np.polyval(each, seen.s)).sum(axis=1) for each in upper], axis=1)
    np.testing.assert_allclose(g, linear_response(2), rtol=1e-6)


@pytest.mark.parametrize("share", [0.3, 1.0, 2.5])
def test_aliases_give_the_response_of_a_delay_of_any_part_of_a_sample(share):
    """A double integrator under a held torque, late by a delay, solved by hand sample by sample."""
    rate, delay = 200.0, share / 200.0
    t = np.arange(4000) / rate - delay
    moved = np.where(t > 0, np.minimum(t, 1 / rate) ** 2 / 2, 0.0)
    moved += np.where(t > 1 / rate, (t - 1 / rate) / rate, 0.0)
    damping = np.exp(-np.arange(4000) / 100.0)  # seen at |z| > 1, where the sum converges
    f = np.array([1.0, 7.0, 31.0])
    z_inverse = np.exp(-2j * np.pi * f[:, None] / rate)
    expected = (moved * damping * z_inverse ** np.arange(4000)).sum(axis=1)
    shifted = f + rate / (2j * np.pi) / 100.0
    seen = Sampled.of(shifted.astype(complex), rate)
    g = (seen.delayed(delay) / seen.s**2).sum(axis=1)
    np.testing.assert_allclose(g, expected, rtol=1e-4)


def test_an_extra_mode_without_mass_is_no_mode():
    extra = {f"extra_mode.{n}": v for n, v in (("frequency_hz", 20.0), ("damping_ratio", 0.1))}
    values = LINEAR | extra | {"extra_mode.inertia_kg_m2": 0.0}
    assert set(NAMES["extra-mode"]) <= set(values)
    s = 2j * np.pi * FREQUENCY_HZ
    (with_mode, _), lower = polynomials("extra-mode", values)
    (plain, _), plain_lower = polynomials("two-inertia", LINEAR)
    np.testing.assert_allclose(
        np.polyval(with_mode, s) / np.polyval(lower, s),
        np.polyval(plain, s) / np.polyval(plain_lower, s),
        rtol=1e-9,
    )
