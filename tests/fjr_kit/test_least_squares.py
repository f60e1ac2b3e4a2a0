"""The batch Levenberg-Marquardt: minima within bounds, never worse than the start."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fjr_kit.least_squares import solve

FREE = np.full(2, -10.0), np.full(2, 10.0)


def rosenbrock(points):
    """Return the residuals of Rosenbrock's valley, whose minimum is (1, 1)."""
    return np.stack([10.0 * (points[:, 1] - points[:, 0] ** 2), 1.0 - points[:, 0]], axis=1)


def counted(residuals):
    calls = []

    def of(points):
        calls.append(len(points))
        return residuals(points)

    return of, calls


@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -2.0), (0.0, 0.0)])
def test_the_valley_leads_to_its_minimum(start):
    found = solve(rosenbrock, np.array(start), *FREE, most_steps=200)
    assert found.converged
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-3)


@given(st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0)), st.integers(0, 5))
@example((-0.15, 0.5), 0)
@settings(max_examples=50)
def test_no_fit_is_worse_than_its_start(start, steps):
    begun = rosenbrock(np.array([start]))[0]
    before = float(begun @ begun)  # summed as the search does, so that rounding is the same
    assert solve(rosenbrock, np.array(start), *FREE, most_steps=steps).cost <= before


def test_bounds_hold_and_the_minimum_on_them_is_found():
    low, high = np.array([-10.0, -10.0]), np.array([0.5, 10.0])
    found = solve(rosenbrock, np.array([-1.0, 1.0]), low, high, most_steps=200)
    assert found.converged
    assert found.x == pytest.approx([0.5, 0.25], abs=1e-3)


def test_a_known_jacobian_saves_evaluations_and_a_wrong_one_is_found_out():
    matrix = np.random.default_rng(0).normal(size=(30, 4))
    target = np.arange(1.0, 5.0)

    def residuals(points):
        return (points - target) @ matrix.T

    bounds = np.full(4, -10.0), np.full(4, 10.0)
    costs = {}
    for name, known in {"none": None, "right": matrix[:, :3], "wrong": -matrix[:, :3]}.items():
        found = solve(residuals, np.zeros(4), *bounds, known=known)
        assert found.converged and found.x == pytest.approx(target, abs=1e-4)
        of, calls = counted(residuals)
        solve(of, np.zeros(4), *bounds, known=known, most_steps=1)
        costs[name] = sum(calls)
    assert costs["right"] == costs["none"] - 3


def test_what_stays_above_a_limit_is_given_up():
    def residuals(points):
        return np.hstack([points, np.full((len(points), 1), 100.0)])

    found = solve(residuals, np.array([3.0]), np.array([-5.0]), np.array([5.0]), give_up_above=10.0)
    assert found.cost >= 1e4 and found.x == pytest.approx([0.0], abs=1e-2)


@pytest.mark.parametrize("seed", range(20))
def test_a_step_that_stays_where_it_is_gains_nothing(seed):
    errors = np.random.default_rng(seed).normal(size=500)

    def residuals(points):
        return np.tile(errors, (len(points), 1))  # no parameter changes anything

    with np.errstate(all="raise"):
        found = solve(residuals, np.zeros(2), *FREE)
    assert found.converged and not found.jacobian.any()
    assert found.x.tolist() == [0.0, 0.0]


def test_what_may_not_move_is_not_tried():
    tried = []

    def residuals(points):
        tried.extend(points[:, 0].tolist())
        return rosenbrock(points)

    found = solve(residuals, np.array([2.0, 1.0]), np.array([2.0, -10.0]), FREE[1] * [0.2, 1.0])
    assert set(tried) == {2.0} and found.x == pytest.approx([2.0, 4.0], abs=1e-3)
    assert not found.jacobian[:, 0].any() and found.jacobian[:, 1].any()
