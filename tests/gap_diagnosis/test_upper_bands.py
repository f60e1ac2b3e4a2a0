"""What changes gain from a band upwards is what least squares on those lines alone says."""

from __future__ import annotations

import numpy as np
import pytest
from test_evidence import NOMINAL, records

from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.starts.promising import ALL, promising
from gap_diagnosis.starts.upper_bands import UpperBands


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    return Evidence(records({}, runs=2), NOMINAL)


@pytest.mark.parametrize("seed", range(3))
def test_gains_are_those_of_least_squares_on_the_lines_that_count(evidence, seed):
    rng, parts = np.random.default_rng(seed), evidence.parts_for("fit")
    band = evidence.cell_of(parts) % evidence.bands
    left, *changes = rng.standard_normal((3, band.size)) * 10.0 ** rng.uniform(-3, 3, (3, 1))
    jacobian = rng.standard_normal((band.size, 4)) * 10.0 ** rng.uniform(-4, 4, 4)
    jacobian[:, 3] = np.where(band < 2, jacobian[:, 3], 0.0)  # shows on slow lines alone
    found = UpperBands(evidence, parts, jacobian, left)
    sizes, falls, squares = found.gains(np.array(changes))
    assert len(found) == len(falls) == evidence.bands
    for lowest in range(len(found)):
        on = band >= lowest
        basis = np.linalg.svd(jacobian[on] / np.abs(jacobian).max(0), full_matrices=False)
        kept = basis[0][:, basis[1] > 1e-9]
        beyond = [row[on] - kept @ (kept.T @ row[on]) for row in (left, *changes)]
        best, residual, *_ = np.linalg.lstsq(np.array(beyond[1:]).T, -beyond[0], rcond=None)
        assert sizes[lowest] == pytest.approx(best, rel=1e-5)
        assert falls[lowest] == pytest.approx(beyond[0] @ beyond[0] - residual[0], rel=1e-5)
        assert squares[lowest] == pytest.approx(
            np.mean([row @ row for row in beyond[1:]]), rel=1e-5
        )
        assert found.left(lowest)[on] == pytest.approx(beyond[0], abs=1e-6 * np.abs(left).max())
        assert not found.left(lowest)[~on].any()


def test_a_number_that_pulls_little_is_found_beside_one_that_moves_much():
    """Where a number beats with the motion it moves far more than those beside it."""
    tried = np.linspace(1.0, 100.0, 4000)
    right, beating = 1616, 1820  # of the numbers
    pulls, moves = np.full((2, 1, tried.size), 1e-3), np.ones((2, tried.size))
    pulls[:, 0, right], pulls[:, 0, beating - 40 : beating + 41 : 4] = 50.0, 1e4
    moves[:, beating - 45 : beating + 46] = 1e6
    calculated = []

    def squares(number: float) -> np.ndarray:
        calculated.append(number)
        return moves[:, np.argmin(np.abs(tried - number))]

    found = promising(tried, pulls, squares)
    assert tried[right] in found
    assert len(found) <= ALL and set(calculated) <= set(found)
