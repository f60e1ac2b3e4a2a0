"""The lapped transform: orthonormal, and what its definition says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gap_diagnosis.model.lapped import lapped, windows_in


@given(st.integers(2, 20), st.integers(0, 9), st.integers(0, 2**31))
def test_lines_are_those_of_the_definition(half_hop, more, seed):
    hop = 2 * half_hop
    signal = np.random.default_rng(seed).standard_normal((2, 3 * hop + more))
    n = np.arange(2 * hop)
    window = np.sin(np.pi / (2 * hop) * (n + 0.5))
    k = np.arange(hop)[:, None]
    cosines = np.cos(np.pi / hop * (n + 0.5 + hop / 2) * (k + 0.5))
    basis = np.sqrt(2.0 / hop) * cosines * window
    found = lapped(signal, hop)
    assert found.shape == (2, windows_in(signal.shape[1], hop), hop)
    for m in range(found.shape[1]):
        expected = signal[:, m * hop : (m + 2) * hop] @ basis.T
        np.testing.assert_allclose(found[:, m], expected, atol=1e-12)


def test_squares_sum_to_those_of_what_lies_inside():
    hop = 32
    signal = np.zeros(hop * 12)
    signal[2 * hop : 9 * hop] = np.random.default_rng(1).standard_normal(7 * hop)
    assert np.sum(lapped(signal, hop) ** 2) == pytest.approx(np.sum(signal**2), rel=1e-12)


def test_white_noise_stays_white_with_its_variance():
    lines = lapped(3.0 * np.random.default_rng(2).standard_normal(64 * 4001), 64)
    np.testing.assert_allclose(np.mean(lines**2, axis=0), 9.0, rtol=0.12)  # 4000 windows: 5 sigma
    apart = np.corrcoef(lines[:, 5], lines[:, 6])[0, 1], np.corrcoef(lines[1:, 5], lines[:-1, 5])
    assert abs(apart[0]) < 0.08 and abs(apart[1][0, 1]) < 0.08


def test_a_tone_stands_in_its_lines():
    hop, rate = 200, 1000.0
    tone = np.sin(2.0 * np.pi * 51.3 * np.arange(20 * hop) / rate)
    power = np.mean(lapped(tone, hop) ** 2, axis=0)
    line = int(51.3 / (rate / (2 * hop)))
    assert power[line - 2 : line + 3].sum() > 0.99 * power.sum()
