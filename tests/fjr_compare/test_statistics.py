"""The tests of differences against Monte Carlo, those of many tests by their definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bla_analyzer.bla.robust import confidence_radius
from fjr_compare.statistics import complex_p, degrees_of, fisher, holm, welch


@given(degrees=st.floats(1.0, 1e4), variance=st.floats(1e-12, 1e3))
def test_degrees_are_found_from_the_disc(degrees: float, variance: float):
    radius = confidence_radius(np.array([variance]), degrees)
    assert degrees_of(radius, np.array([variance]))[0] == pytest.approx(degrees, rel=1e-6)


@pytest.mark.parametrize(
    ("one", "two", "ratio"), [(6, 6, 1.0), (2, 6, 1.0), (3, 12, 5.0), (1, 1, 1.0)]
)
def test_differences_of_what_is_the_same_are_found_as_often_as_stated(one, two, ratio):
    """Means of complex normal numbers with estimated variances: never oftener than 1.2 times."""
    rng = np.random.default_rng(1)
    trials = 40_000

    def estimate(count: int, std: float) -> tuple[np.ndarray, np.ndarray]:
        z = rng.normal(size=(count, trials, 2)) @ np.array([1.0, 1j]) * std / np.sqrt(2.0)
        return z.mean(axis=0), np.var(z, axis=0, ddof=1) / count

    (a, va), (b, vb) = estimate(one + 1, 1.0), estimate(two + 1, ratio)
    degrees = np.full(trials, float(one)), np.full(trials, float(two))
    lines = [slice(k, k + 40) for k in range(0, trials, 40)]
    n = np.concatenate([welch((va[k], vb[k]), (degrees[0][k], degrees[1][k])) for k in lines])
    p = complex_p(b - a, va + vb, n)
    for rate in (0.05, 0.01):
        assert 0.5 * rate < np.mean(p < rate) < 1.2 * rate
    assert np.mean(complex_p(b - a + 6.0 * np.sqrt(va + vb), va + vb, degrees[0]) < 0.05) > 0.9


def test_holm_is_what_its_paper_says():
    assert holm([0.01, 0.04, 0.03, 0.005]).tolist() == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([]).size == 0


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_corrected_values_keep_their_order_and_are_no_smaller(p: list[float]):
    adjusted = holm(p)
    assert (adjusted >= np.array(p)).all() and (adjusted <= 1.0).all()
    assert (np.diff(adjusted[np.argsort(p, kind="stable")]) >= 0.0).all()


def test_tests_together_are_uniform_where_each_is():
    p = np.random.default_rng(2).uniform(size=(4000, 20))
    together = np.array([fisher(row) for row in p])
    assert 0.04 < np.mean(together < 0.05) < 0.06
    assert fisher(np.full(20, 0.2)) < 0.02 < fisher(np.full(20, 0.5))
