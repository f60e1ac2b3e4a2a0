"""Scores of the blind check, against numbers worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fjr_validation.blind.answers import WORLDS, Answer, Cause, Kind, World
from fjr_validation.blind.claims import claims
from fjr_validation.blind.outcome import CLEAR, Outcome
from fjr_validation.blind.score import TARGETS, auroc, bootstrapped, met, rate, scores

SIZE = "backlash.half_gap_rad"


def cause(name: str, shows: float = 5.0, **parameters: float) -> Cause:
    full = {f"{name}.{key}": value for key, value in parameters.items()}
    return Cause(name, shows, shows, shows, 0.9, full)


def answer(world: World, kind: Kind, causes: tuple[Cause, ...] = (), weak: tuple[Cause, ...] = (),
           k0: float = 100.0) -> Answer:  # fmt: skip
    return Answer(
        world=world, kind=kind, causes=causes, weak=weak, laws=(), plant={"k0": k0}, nominal={},
        settings={}, noise_rad=1e-5, scatter=0.0, remainder=0.01, excitation="multisine",
        controller_known=True, facts={},
    )  # fmt: skip


def said(
    *named: str,
    present: float = 0.95,
    sets: dict[str, list[str]] | None = None,
    parameters: dict[str, Any] | None = None,
    doubted: tuple[str, ...] = (),
) -> dict[str, Any]:
    """Return what is kept of a diagnosis of schema 2."""
    causes = [
        {"effect": name, "or": (sets or {}).get(name, []), "present": present,
         "parameters": parameters or {}}
        for name in named
    ]  # fmt: skip
    beside = [{"effect": name, "present": 0.3} for name in doubted]
    return {"verdict": "partly_explained" if named else "unexplained", "effects": list(named),
            "causes": causes, "doubted": beside, "confidence": 0.5, "parameters": {}}  # fmt: skip


def outcome(truth: Answer, diagnosis: dict[str, Any] | None) -> Outcome:
    line: dict[str, Any] = {"case": "open_0000", "method": "fjr", "seconds": 3.0}
    if diagnosis is None:
        return Outcome.of(truth, {**line, "error": "InputError: no bags"})
    return Outcome.of(truth, {**line, "diagnosis": diagnosis})


GAP, LAG = cause("backlash", half_gap_rad=2e-3), cause("actuator_lag")
ONE = answer("open", "single", (GAP,))
TWO = answer("open", "two", (GAP, LAG))
REMAINDER = answer("open", "remainder")
OUTSIDE = answer("open", "outside", (cause("eddy_drag"),))
CASES = [ONE, TWO, REMAINDER, OUTSIDE, answer("open", "single", (LAG,), (GAP,))]


def interval(low: float, high: float) -> dict[str, Any]:
    return {"half_gap_rad": {"value": 0.5 * (low + high), "low": low, "high": high}}


def perfect(truth: Answer) -> dict[str, Any]:
    names = () if truth.kind == "outside" else tuple(c.name for c in truth.causes)
    return said(*names, parameters=interval(1e-3, 3e-3), doubted=("delay",))


def test_a_perfect_diagnosis_meets_everything():
    found = scores([outcome(truth, perfect(truth)) for truth in CASES])
    for name in ("dominant_named", "two_causes_f1", "nothing_named", "outside_not_named",
                 "interval_holds", "auroc_present", "verdict_right"):  # fmt: skip
        assert found[name].value == 1.0, name
    assert found["wrong_name"].value == found["failed"].value == 0.0
    assert found["seconds_median"].value == 3.0
    for world in WORLDS:
        for name in TARGETS:
            if name not in ("interval_holds", "two_causes_f1"):
                assert met(name, world, found[name].value) is not False


def test_an_empty_diagnosis_names_nothing_wrong_and_nothing_right():
    found = scores([outcome(truth, said()) for truth in CASES])
    assert found["wrong_name"].value == found["two_causes_f1"].value == 0.0
    assert found["dominant_named"].value == 0.0 and found["dominant_named"].cases == 2
    assert found["nothing_named"].value == found["outside_not_named"].value == 1.0
    assert found["interval_holds"].value is None and found["auroc_present"].value is None
    assert found["verdict_right"].value == pytest.approx(2 / 5)


def test_a_diagnosis_that_fails_misses_all_that_is_asked():
    found = scores([outcome(truth, None) for truth in CASES])
    assert found["wrong_name"].value == found["failed"].value == 1.0
    for name in ("dominant_named", "two_causes_f1", "nothing_named", "outside_not_named"):
        assert found[name].value == 0.0


@pytest.mark.parametrize(
    ("truth", "diagnosis", "wrong", "found"),
    [
        (ONE, said("backlash"), False, 1),
        (ONE, said("piecewise_stiffness"), False, 1),  # which contains it
        (ONE, said("hysteresis", sets={"hysteresis": ["backlash"]}), False, 1),
        (ONE, said("hysteresis"), True, 0),
        (ONE, said("hysteresis", present=0.79), False, 0),
        (ONE, said("backlash", "hysteresis"), True, 1),
        (ONE, said("backlash", "transmission_damping"), False, 1),  # whose shaft is damped
        (answer("open", "single", (LAG,)), said("transmission_damping"), True, 0),
        (TWO, said("backlash", "piecewise_stiffness"), False, 1),  # one cause is found once
        (TWO, said("actuator_lag", "backlash"), False, 2),
        (answer("open", "single", (LAG,), (GAP,)), said("backlash"), False, 0),  # weak, but there
        (OUTSIDE, said("eddy_drag"), True, 0),
        (answer("open", "single", (cause("piecewise_stiffness"),)), said("backlash"), True, 0),
    ],
)
def test_what_is_wrong_and_what_is_found(truth, diagnosis, wrong, found):
    seen = outcome(truth, diagnosis)
    assert bool(seen.wrong_names) is wrong
    assert seen.matches == found


def test_equivalences_hold_only_where_they_are_exact():
    def passes(true: Cause, name: str, k0: float = 100.0) -> bool:
        return not outcome(answer("closed", "single", (true,), k0=k0), said(name)).wrong_names

    coulomb = cause("asymmetric_friction", coulomb_nm=1.0)
    viscous = cause("asymmetric_friction", viscous_nm_s_rad=1.0)
    hanging, level = cause("gravity", angle_rad=0.1), cause("gravity", angle_rad=-1.57)
    assert passes(coulomb, "torque_bias") and not passes(viscous, "torque_bias")
    assert passes(level, "torque_bias") and not passes(hanging, "torque_bias")
    assert passes(hanging, "cogging", math.inf) and not passes(hanging, "cogging")
    assert passes(cause("presliding_friction"), "lugre_friction")
    assert not passes(cause("lugre_friction"), "presliding_friction")


def test_only_causes_that_are_clear_are_asked_for():
    for world in WORLDS:
        truths = [answer(world, "single", (cause("backlash", s),)) for s in (0.9, 1.1)]
        faint, clear = (outcome(t, said()) for t in truths)
        assert not faint.clear and not clear.clear
        plain = outcome(answer(world, "single", (cause("backlash", CLEAR),)), said())
        assert plain.clear
    closed = Cause("backlash", 9.0, None, None, 1.0, {})
    assert outcome(answer("closed", "single", (closed,)), said()).clear


def test_f1_counts_needless_names_but_no_weak_ones_that_are_there():
    weak = answer("open", "two", (GAP, LAG), (cause("gravity"),))
    lines = [
        outcome(weak, said("backlash", "actuator_lag", "gravity")),
        outcome(weak, said("backlash", "delay")),
    ]
    assert scores(lines)["two_causes_f1"].value == pytest.approx(2 * 3 / (2 + 2 + 4))


def test_intervals_are_compared_modulo_a_turn_only_for_angles():
    turned = cause("gravity", angle_rad=3.1, torque_nm=2.0)
    estimates = {
        "gravity.angle_rad": {"value": -3.18, "low": -3.2, "high": -3.17},
        "gravity.torque_nm": {"value": 2.0 + 2 * math.pi, "low": 8.0, "high": 8.5},
    }
    seen = outcome(answer("closed", "single", (turned,)), said("gravity", parameters=estimates))
    assert seen.covered() == [True, False]


def test_a_drift_is_found_by_its_verdict_and_not_a_wrong_name_elsewhere():
    drifting = {"verdict": "nonstationary", "effects": [], "confidence": 0.9, "parameters": {}}
    drift = outcome(answer("closed", "single", (cause("nonstationary"),)), drifting)
    assert drift.found(drift.asked[0]) and drift.right
    assert not outcome(ONE, drifting).wrong_names and not outcome(ONE, drifting).right


def test_schema_1_is_read_as_claims_as_sure_as_the_verdict():
    estimates = {SIZE: {"value": 1.0, "low": 0.9, "high": 1.1}, "jm": {"value": 1.0}}
    old = {
        "verdict": "ambiguous",
        "effects": ["backlash"],
        "confidence": 0.9,
        "equivalent": [["backlash", "piecewise_stiffness"]],
        "parameters": estimates,
    }
    (claim,) = claims(old)
    assert claim.present == 0.9 and claim.named
    assert claim.names == {"backlash", "piecewise_stiffness"}
    assert claim.parameters == {SIZE: (1.0, 0.9, 1.1)}
    assert claims({**old, "verdict": "unexplained"}) == ()


def test_auroc_is_the_chance_that_right_claims_are_surer():
    assert auroc([[(0.9, True), (0.2, False)], [(0.8, True)]]) == 1.0
    assert auroc([[(0.9, True)], [(0.9, False)]]) == 0.5
    assert auroc([[(0.9, True), (0.5, True), (0.7, False)]]) == 0.5
    assert auroc([[(0.9, True)]]) is None and auroc([[]]) is None


def test_intervals_of_scores():
    share = rate([True] * 19 + [False])
    assert (share.low, share.high) == (
        pytest.approx(0.7513, abs=1e-4),
        pytest.approx(0.9987, abs=1e-4),
    )
    none = rate([])
    assert none.value is None and none.cases == 0
    values = np.random.default_rng(1).normal(5.0, 1.0, 400)
    mean = bootstrapped(values.tolist(), lambda part: float(np.mean(part)))
    assert mean.high - mean.low == pytest.approx(4 * 1.0 / 20.0, rel=0.15)
