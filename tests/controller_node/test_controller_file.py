"""Controllers as a user knows them: structures, gains known or not, and what is refused."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from controller_node import pd_filtered
from controller_node.controller_file import describe, read_controller
from controller_node.law import as_transfer_function, law_as_run, law_of
from controller_node.structures import ONE_DEGREE, TWO_DEGREES
from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError

RATE = 500.0


def described(tmp_path, text: str) -> dict:
    file = tmp_path / "controller.yaml"
    file.write_text(text)
    return describe(read_controller(file), RATE, str(file))


def torque(law: dict, r: np.ndarray, y: np.ndarray) -> np.ndarray:
    reference, position = (law.get(part, law) for part in ("reference", "position"))
    return lfilter(reference["numerator"], reference["denominator"], r) - lfilter(
        position["numerator"], position["denominator"], y
    )


def signals() -> tuple[np.ndarray, np.ndarray]:
    return tuple(np.random.default_rng(3).normal(size=(2, 400)))


def test_pid_with_the_derivative_on_the_measurement(tmp_path):
    law = described(tmp_path, "kind: pid\np: 40\ni: 5.5\nd: 0.2\nderivative_on: measurement\n")
    assert law["kind"] == TWO_DEGREES
    r, y = signals()
    e = r - y
    expected = 40 * e + 5.5 * np.cumsum(e) / RATE - 0.2 * RATE * np.diff(y, prepend=0.0)
    np.testing.assert_allclose(torque(law, r, y), expected, rtol=1e-9, atol=1e-8)


def test_cascade_with_integral_and_feed_forward(tmp_path):
    text = "kind: p_pi\nk_position: 20\nk_velocity: 1.5\nintegral_time_s: 0.1\n"
    law = described(tmp_path, text + "feed_forward: {velocity: 0.3, acceleration: 0.01}\n")
    r, y = signals()
    error = 20 * (r - y) - RATE * np.diff(y, prepend=0.0)
    speed = RATE * np.diff(r, prepend=0.0)
    forward = 0.3 * speed + 0.01 * RATE * np.diff(speed, prepend=0.0)
    expected = 1.5 * (error + np.cumsum(error) / RATE / 0.1) + forward
    np.testing.assert_allclose(torque(law, r, y), expected, rtol=1e-8, atol=1e-6)


def test_the_law_of_the_node_is_kept_as_it_is_and_that_of_drives_damps_by_its_gain(tmp_path):
    """Right after a step the node's law is D N; drives low-pass a difference of D/Ts."""
    law = described(tmp_path, "kind: pd_filtered\np: 200\nd: 60\nn: 24\ntorque_limit_nm: 9\n")
    assert law == {"kind": "pd_filtered", "p": 200, "d": 60, "n": 24, "torque_limit_nm": 9.0}
    own = pd_filtered.from_description(law, RATE)
    same = described(tmp_path, "kind: pd\np: 200\nd: 60\nn: 24\ntorque_limit_nm: 9\n")
    assert same["kind"] == ONE_DEGREE and same["torque_limit_nm"] == 9.0
    node = TransferFunction.of_pd(pd_filtered.coefficients(own))
    found, decay = law_of(same, RATE), np.exp(-24.0 / RATE)
    difference = 60.0 * RATE * (1.0 - decay) * np.array([1.0, -1.0])
    np.testing.assert_allclose(found.position, 200.0 * np.array([1.0, -decay]) + difference)
    np.testing.assert_allclose(found.denominator, node.denominator)
    np.testing.assert_allclose(node.position[0], 200.0 + 60.0 * 24.0)


def test_a_continuous_law_becomes_the_one_of_tustin(tmp_path):
    text = '{"kind": "transfer_function", "numerator": [2, 3], "denominator": [1, 0], '
    law = described(tmp_path, text + '"domain": "continuous"}')
    # 2 + 3/s, the integral by trapezoids
    half = 3 / (2 * RATE)
    np.testing.assert_allclose(law["numerator"], [2 + half, half - 2])
    np.testing.assert_allclose(law["denominator"], [1, -1])


def test_unknown_gains_stay_and_are_listed(tmp_path):
    text = "kind: two_degrees_of_freedom\nreference: {numerator: [unknown], denominator: [1]}\n"
    law = described(tmp_path, text + "position: {numerator: [4, unknown], denominator: [1]}\n")
    assert law["unknown"] == ["reference.numerator.0", "position.numerator.1"]
    assert law["position"]["numerator"] == [4, None]
    assert described(tmp_path, "kind: pid\np: unknown\n") == {
        "kind": "pid",
        "p": None,
        "unknown": ["p"],
    }
    json.dumps(law, allow_nan=False)
    with pytest.raises(InputError, match=r"p is unknown, so the law cannot be simulated"):
        law_of({"kind": "pid", "p": None, "unknown": ["p"]}, RATE)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "controller: must be names with values"),
        ("p: 1\n", "controller: the kind is missing"),
        ("kind: fuzzy\n", "the kind is 'fuzzy'; known are 'pd', 'pid'"),
        ("kind: pd\n", r"controller\.p: is missing"),
        ("kind: pd\np: x\n", r"controller\.p"),
        ("kind: pd\np: true\n", r"controller\.p: must be a number, or unknown"),
        ("kind: pd\np: .nan\n", r"controller\.p"),
        ("kind: pd\np: 1\nq: 2\n", r"controller\.q: is not known here"),
        ("kind: pd\np: 1\ntorque_limit_nm: -1\n", r"controller\.torque_limit_nm"),
        ("kind: pd\np: 1\nd: 1\nn: 0\n", r"controller\.n"),
        ("kind: [pd\n", "this is not YAML"),
        ("kind: &a pd\np: *a\n", "line 2: YAML aliases .* are not read: write the value out"),
        ("\x00\xff", "control characters are not allowed"),
        (
            "kind: transfer_function\nnumerator: [1]\ndenominator: [1, -2]\n",
            r"controller has a pole of magnitude 2 outside",
        ),
        ("kind: transfer_function\nnumerator: [1]\ndenominator: [0, 1]\n", "is not causal"),
        (
            "kind: transfer_function\nnumerator: [1, 0, 0]\ndenominator: [1, 1]\n"
            "domain: continuous\n",
            "is not causal",
        ),
        (
            "kind: transfer_function\nnumerator: [1]\ndenominator: [1, unknown]\n",
            r"denominator\.1: must be a number; only coefficients of a numerator may be unknown",
        ),
        ("kind: pd\np: 1\nanti_windup: 2\n", "anti_windup: is not known here"),
    ],
)
def test_a_bad_file_is_refused_in_a_sentence(tmp_path, text, says):
    with pytest.raises(InputError, match=says) as refused:
        described(tmp_path, text)
    sentence = str(refused.value)
    assert sentence.startswith(str(tmp_path)) and sentence.endswith(".") and "\n" not in sentence


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_controller(tmp_path / "none.yaml")


CONTENTS = st.dictionaries(
    st.sampled_from(["kind", "p", "i", "d", "n", "numerator", "denominator", "domain", "k_position",
                     "k_velocity", "integral_time_s", "torque_limit_nm", "feed_forward",
                     "reference", "position"]),
    st.sampled_from(["pd", "pid", "p_pi", "transfer_function", "two_degrees_of_freedom", "unknown",
                     "pd_filtered", "continuous", 0, 1e300, -1, 2.5, [1, -0.5], [], [0], {}, None,
                     {"velocity": 1e308}, {"numerator": [1, 2], "denominator": [1, -1]},
                     {"numerator": [1e300], "denominator": [1e-300, 1e300]}]),
)  # fmt: skip


@settings(max_examples=200)
@given(st.text(max_size=200) | CONTENTS.map(json.dumps))
def test_whatever_the_file_holds_it_is_described_or_refused(tmp_path_factory, text):
    file = tmp_path_factory.getbasetemp() / "fuzzed.yaml"
    file.write_text(text, encoding="utf-8", errors="replace")
    try:
        entry = describe(read_controller(file), RATE, str(file))
        json.dumps(entry, allow_nan=False)
        if "unknown" not in entry:
            law_of(entry, RATE)
    except InputError as refused:
        assert "\n" not in str(refused)


@settings(max_examples=300)
@given(CONTENTS, st.sampled_from([None, "p", ["p"], ["p", "p"], ["numerator.0"], [3], ["q.1"]]))
def test_whatever_a_bag_describes_it_is_a_law_or_refused(content, unknown):
    content = content if unknown is None else {**content, "unknown": unknown}
    whole = {"kind": "pd", "p": 1.0, "given": {"rate_hz": 2000.0, **content}}
    for made, gains in itertools.product(
        (content, whole), (None, {"p": 3.0}, {"numerator.0": 2.0})
    ):
        try:
            as_transfer_function(law_of(made, RATE, gains))
            law_as_run(made, RATE, gains)
        except InputError as refused:
            sentence = str(refused)
            assert sentence.startswith("experiment description: controller")
            assert sentence.endswith(".") and "\n" not in sentence
