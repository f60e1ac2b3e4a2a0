"""The control law: the step-invariant filtered PD, its limit and its description."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from controller_node import pd_filtered
from fjr_kit.errors import InputError

gains = st.fixed_dictionaries(
    {
        "p": st.floats(1e-3, 1e4),
        "d": st.floats(0.0, 1e3),
        "n": st.floats(0.0, 1e3),
        "sample_rate_hz": st.floats(100.0, 20_000.0),
    }
)


def run(values, error):
    c, x, torque = pd_filtered.coefficients(pd_filtered.CONTROLLER.check(values)), 0.0, []
    for e in error:
        x, u = pd_filtered.step(x, e, c)
        torque.append(u)
    return np.array(torque)


@given(gains, st.integers(0, 1000))
def test_it_is_the_step_invariant_discretisation(values, seed):
    """C(s) = P + D N/(1 + N/s) = ((P + D N) s + P N) / (s + N), held as scipy holds it."""
    p, d, n = values["p"], values["d"], values["n"]
    transfer = ([p + d * n, p * n], [1.0, n])
    numerator, denominator, _ = cont2discrete(transfer, 1.0 / values["sample_rate_hz"], "zoh")
    error = np.random.default_rng(seed).normal(size=200)
    expected = lfilter(numerator.ravel(), denominator, error)
    np.testing.assert_allclose(run(values, error), expected, rtol=1e-9, atol=1e-9 * (1 + p + d * n))


@given(gains)
def test_a_step_is_answered_as_the_continuous_controller_does(values):
    p, d, n = values["p"], values["d"], values["n"]
    t = np.arange(50) / values["sample_rate_hz"]
    expected = p + d * n * np.exp(-n * t)
    np.testing.assert_allclose(
        run(values, np.ones(50)), expected, rtol=0.0, atol=1e-12 * expected[0]
    )


@given(gains, st.floats(0.0, 100.0), st.integers(0, 1000))
def test_the_limit_clamps_the_torque_and_leaves_the_filter_alone(values, limit, seed):
    error = np.random.default_rng(seed).normal(size=100)
    free, limited = run(values, error), run({**values, "torque_limit_nm": limit}, error)
    np.testing.assert_array_equal(limited, np.clip(free, -limit, limit))


def test_the_defaults_are_the_papers():
    values = pd_filtered.CONTROLLER.defaults()
    assert (values["p"], values["d"], values["n"]) == (200.0, 60.0, 24.0)
    assert math.isinf(values["torque_limit_nm"])
    np.testing.assert_array_equal(
        pd_filtered.coefficients(values), [200.0, 1440.0, math.exp(-0.024), math.inf]
    )


@given(gains, st.one_of(st.just(math.inf), st.floats(0.0, 1e6)))
def test_description_round_trip(values, limit):
    values = pd_filtered.CONTROLLER.check({**values, "torque_limit_nm": limit})
    described = pd_filtered.describe(values)
    assert (described["torque_limit_nm"] is None) == math.isinf(limit)
    assert pd_filtered.from_description(described, values["sample_rate_hz"]) == values


def test_description_is_the_one_of_the_interface():
    assert pd_filtered.describe(pd_filtered.CONTROLLER.defaults()) == {
        "kind": "pd_filtered",
        "p": 200.0,
        "d": 60.0,
        "n": 24.0,
        "torque_limit_nm": None,
    }


GOOD = {"kind": "pd_filtered", "p": 200.0, "d": 60.0, "n": 24.0, "torque_limit_nm": None}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "lqr"}, "controller.kind is 'lqr'"),
        ({"kind": None}, "controller.kind is None"),
        ({"p": -1.0}, "p must lie in"),
        ({"p": "high"}, "p must be a number"),
        ({"d": math.nan}, "d must be a number"),
        ({"n": math.inf}, "n must lie in"),
        ({"torque_limit_nm": -5.0}, "torque_limit_nm must lie in"),
        ({"torque_limit_nm": True}, "torque_limit_nm must be a number"),
    ],
    ids=str,
)
def test_a_bad_description_is_one_sentence(change, words):
    with pytest.raises(InputError) as raised:
        pd_filtered.from_description({**GOOD, **change}, 1000.0)
    message = str(raised.value)
    assert message.startswith("experiment description: controller")
    assert words in message
    assert message.endswith(".")


@pytest.mark.parametrize("name", ["kind", "p", "d", "n"])
def test_a_missing_key_is_named(name):
    with pytest.raises(InputError, match=rf"controller\.{name} is "):
        pd_filtered.from_description({k: v for k, v in GOOD.items() if k != name}, 1000.0)


def test_a_missing_limit_is_no_limit_and_further_keys_are_ignored():
    described = {k: v for k, v in GOOD.items() if k != "torque_limit_nm"} | {"note": "ours"}
    assert math.isinf(pd_filtered.from_description(described, 1000.0)["torque_limit_nm"])
