"""Scores of the blind check, against numbers worked out by hand."""

import numpy as np
import pytest

from fjr_validation.blind.cases import NOMINAL, Answer, Effect
from fjr_validation.blind.outcome import Outcome, indistinguishable
from fjr_validation.blind.score import by_size, calibration_error, met, rate, scores
from gap_diagnosis.outcome.diagnosis import Diagnosis, Estimate, Gaps

NO_GAPS = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)


def effect(name: str, relative: float = 5.0, **catalogue: float) -> Effect:
    return Effect(name, 1.0, 1.0 / relative, relative, catalogue)


def outcome(kind: str, true: list[Effect], verdict: str, named: tuple[str, ...] = (),
            sets: list[list[str]] | None = None, confidence: float = 0.9,
            parameters: dict[str, Estimate] | None = None) -> Outcome:  # fmt: skip
    diagnosis = Diagnosis(
        verdict=verdict,
        effects=list(named),
        equivalent=sets or [[name] for name in named],
        confidence=confidence,
        gap=NO_GAPS,
        gap_closed=0.95 if named else None,
        parameters=parameters or {},
    )
    return Outcome("case_000", "fjr", Answer(kind, true, NOMINAL, 2e-5), diagnosis, "", 1.0)


LAG, GAP = effect("actuator_lag"), effect("backlash")
FAINT = effect("actuator_lag", 0.5)
COULOMB = effect("asymmetric_friction", **{"asymmetric_friction.coulomb_nm": 1.0})
PAIR = ("backlash", "torque_bias")


@pytest.mark.parametrize(
    ("kind", "true", "verdict", "named", "sets", "right"),
    [
        ("none", [], "no_gap", (), None, True),
        ("none", [], "effect", ("delay",), None, False),
        ("none", [], "unexplained", (), None, False),
        ("parameters", [], "parameters_only", (), None, True),
        ("single", [LAG], "effect", ("actuator_lag",), None, True),
        ("single", [LAG], "effect", ("delay",), None, False),
        ("single", [LAG], "effect", ("actuator_lag", "delay"), None, False),
        ("single", [LAG], "ambiguous", ("delay",), [["delay", "actuator_lag"]], True),
        ("single", [LAG], "ambiguous", ("delay",), [["delay", "backlash"]], False),
        ("single", [LAG], "parameters_only", (), None, False),
        ("single", [FAINT], "parameters_only", (), None, True),
        ("single", [LAG], "unexplained", (), None, False),
        ("single", [GAP], "effect", ("piecewise_stiffness",), None, True),
        ("single", [effect("piecewise_stiffness")], "effect", ("backlash",), None, False),
        ("two", [LAG, GAP], "effect", ("backlash", "actuator_lag"), None, True),
        ("two", [LAG, GAP], "effect", ("backlash",), None, False),
        ("two", [GAP, COULOMB], "ambiguous", PAIR, [[PAIR[0]], [PAIR[1], "gravity"]], True),
        ("two", [GAP, LAG], "ambiguous", PAIR, [[PAIR[0]], [PAIR[1], "gravity"]], False),
        ("outside", [effect("frictional_memory")], "unexplained", (), None, True),
        ("outside", [effect("frictional_memory")], "effect", ("backlash",), None, False),
        ("nonstationary", [effect("nonstationary")], "nonstationary", (), None, True),
        ("nonstationary", [effect("nonstationary")], "unexplained", (), None, False),
    ],
)
def test_which_verdicts_are_right(kind, true, verdict, named, sets, right):
    assert outcome(kind, true, verdict, named, sets).right is right


def test_a_failed_method_is_wrong():
    failed = Outcome("case_000", "fjr", Answer("none", [], NOMINAL, 0.0), None, "Error", 1.0)
    assert not failed.right
    assert scores([failed])["false_alarm"].value == 0.0
    assert scores([failed])["abstained_without_effect"].value == 1.0


def test_equivalences_hold_only_where_they_are_exact():
    coulomb = effect("asymmetric_friction", **{"asymmetric_friction.coulomb_nm": 1.0})
    viscous = effect("asymmetric_friction", **{"asymmetric_friction.viscous_nm_s_rad": 1.0})
    hanging = effect("gravity", **{"gravity.angle_rad": 0.1})
    level = effect("gravity", **{"gravity.angle_rad": -1.57})
    assert "torque_bias" in indistinguishable(coulomb) & indistinguishable(level)
    assert indistinguishable(viscous) == {"asymmetric_friction"}
    assert indistinguishable(hanging) == {"gravity"}


def test_a_torque_gain_scales_the_bare_parameters_that_intervals_should_hold():
    gain = Effect("torque_gain", 0.1, None, 0.0, {})
    answer = Answer("single", [gain], NOMINAL, 2e-5, {"gain_error": -0.1})
    scaled = {name: value / 0.9 for name, value in NOMINAL.items()}
    parameters = {
        name: Estimate(value=0.99 * v, low=0.97 * v, high=1.01 * v) for name, v in scaled.items()
    }
    said = outcome("single", [], "parameters_only", parameters=parameters).diagnosis
    bare, effects = Outcome("case_000", "fjr", answer, said, "", 1.0).deviations()
    assert bare == pytest.approx([0.5] * len(NOMINAL)) and effects == []


def test_a_rate_has_the_clopper_pearson_interval():
    found = rate([True] * 9 + [False])
    assert found.value == 0.9
    assert found.low == pytest.approx(0.5550, abs=1e-4)  # tabulated for 9 of 10
    assert found.high == pytest.approx(0.9975, abs=1e-4)
    assert rate([False] * 20).high == pytest.approx(1.0 - 0.025 ** (1 / 20))
    assert rate([]).value is None


def test_the_calibration_error_is_the_weighted_distance():
    pairs = [(0.95, True)] * 3 + [(0.95, False)] + [(0.55, False)] * 4
    assert calibration_error(pairs) == pytest.approx(0.5 * 0.2 + 0.5 * 0.55)
    rng = np.random.default_rng(0)
    honest = [(c, rng.random() < c) for c in rng.uniform(0, 1, 20_000)]
    assert calibration_error(honest) < 0.02


def test_f1_pools_names_over_cases():
    cases = [
        outcome("two", [LAG, GAP], "effect", ("backlash", "actuator_lag")),
        outcome("two", [LAG, GAP], "effect", ("backlash", "delay")),
        outcome("two", [LAG, GAP], "unexplained"),
    ]
    assert scores(cases)["two_effects_f1"].value == pytest.approx(2 * 3 / (4 + 6))


def test_one_name_does_not_stand_for_two_effects():
    true = [effect("torque_bias"), effect("gravity", **{"gravity.angle_rad": 1.57})]
    assert outcome("two", true, "effect", ("torque_bias",)).matches == 1


def test_false_alarms_and_confident_names_are_counted_apart_from_abstention():
    dead = [effect("frictional_memory")]
    cases = [
        outcome("none", [], "effect", ("delay",)),
        outcome("parameters", [], "parameters_only"),
        outcome("parameters", [], "unexplained"),
        outcome("none", [], "no_gap"),
        outcome("outside", dead, "effect", ("delay",), confidence=0.95),
        outcome("outside", dead, "effect", ("delay",), confidence=0.4),
        outcome("outside", dead, "unexplained"),
    ]
    found = scores(cases)
    assert found["false_alarm"].value == 0.25
    assert found["abstained_without_effect"].value == 0.25
    assert found["outside_abstained"].value == pytest.approx(1 / 3)
    assert found["outside_confident_name"].value == pytest.approx(1 / 3)


def test_coverage_counts_intervals_of_right_verdicts_only():
    true = [effect("backlash", **{"backlash.half_gap_rad": 1e-3})]
    spread = {name: Estimate(value=v, low=0.9 * v, high=1.1 * v) for name, v in NOMINAL.items()}
    off = Estimate(value=2e-3, low=1.5e-3, high=2.5e-3)
    hit = outcome("single", true, "effect", ("backlash",),
                  parameters={**spread, "backlash.half_gap_rad": off})  # fmt: skip
    wrong = outcome("single", true, "effect", ("delay",), parameters={"j": off})
    found = scores([hit, wrong])
    assert found["coverage_bare"].value == 1.0
    assert found["coverage_bare"].cases == 1
    assert found["coverage_effect"].value == 0.0


def test_accuracy_is_binned_by_relative_size():
    cases = [
        outcome("single", [effect("backlash", size)], "effect", (name,))
        for size, name in ((0.5, "delay"), (1.0, "backlash"), (4.0, "backlash"), (9.0, "delay"))
    ]
    rows = by_size(cases)
    assert [row.first_right.value for row in rows] == [0.0, 1.0, None, 1.0, 0.0]
    assert rows[0].wrong_name.value == 1.0


def test_targets_are_those_of_the_project():
    assert met("false_alarm", 0.02) is True
    assert met("false_alarm", 0.03) is False
    assert met("coverage_bare", 0.99) is False
    assert met("verdict_right", 0.5) is None
    assert met("in_set_clear", None) is None
