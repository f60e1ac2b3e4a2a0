"""The confidence of a verdict: features, and the regression that blind cases calibrate."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gap_diagnosis.outcome.diagnosis import (
    Candidate,
    Diagnosis,
    EvidenceKind,
    Gap,
    Gaps,
    NextExperiment,
)
from gap_diagnosis.outcome.verdict_words import ON, OUT_OF_TIME, action, is_better, meaning
from gap_diagnosis.which.confidence import (
    COEFFICIENTS,
    NAMES,
    UNTESTED,
    confidence,
    features,
    group,
)


def gap(chi2):
    return Gap(nrmse_position=0.1, nrmse_torque=0.1, chi2_per_dof=chi2)


def candidate(effects, chi2):
    return Candidate(effects=effects, held_out_chi2=chi2, delta=1.0, converged=True, parameters={})


def said(verdict, left=1.0, second=50.0, effects=(), refit=100.0):
    named = list(effects)
    ranking = [candidate(named or ["cogging"], left), candidate(["delay"], second)]
    return Diagnosis(
        verdict=verdict, effects=named, equivalent=[[name] for name in named], confidence=0.0,
        gap=Gaps(nominal=gap(200.0), refit=gap(refit), explained=gap(left), noise_floor=gap(1.0)),
        ranking=ranking,
    )  # fmt: skip


NOTHING_HELD_OUT = EvidenceKind(
    noise="repeats", reported_on="none", controller="known", excitation="periodic"
)
VERDICTS = [
    said("effect", effects=("backlash",)), said("ambiguous", effects=("backlash", "gravity")),
    said("no_gap", refit=1.0), said("parameters_only", refit=1.0), said("unexplained", 30.0, 30.0),
    said("nonstationary"), said("bad_data"),
]  # fmt: skip


@pytest.mark.parametrize("diagnosis", VERDICTS, ids=lambda d: d.verdict)
def test_every_verdict_has_a_confidence_between_half_and_one(diagnosis):
    assert len(features(diagnosis)) == len(COEFFICIENTS[group(diagnosis)])
    assert len(NAMES[group(diagnosis)]) == len(COEFFICIENTS[group(diagnosis)])
    assert 0.5 < confidence(diagnosis) < 1.0


@pytest.mark.parametrize("diagnosis", VERDICTS, ids=lambda d: d.verdict)
def test_where_nothing_was_held_out_no_fit_is_more_likely_right_than_not(diagnosis):
    untested = diagnosis.model_copy(update={"evidence": NOTHING_HELD_OUT})
    if group(diagnosis) == "gate":  # rests on no fit
        assert confidence(untested) == confidence(diagnosis)
    else:
        assert confidence(untested) == UNTESTED <= 0.5
    text = f"{meaning(untested)} {ON['none']}"
    assert "not seen" not in text and "held-out" not in text


def test_a_name_is_the_surer_the_further_the_next_one_lies_behind():
    sure = [confidence(said("effect", 1.0, second, ("backlash",))) for second in (1.0, 3.0, 15.0)]
    assert all(a < b for a, b in pairwise(sure))


def test_what_contains_the_named_effect_or_is_in_its_set_is_no_rival():
    equivalent = [["backlash", "piecewise_stiffness"]]
    diagnosis = said("ambiguous", effects=("backlash",)).model_copy(
        update={"equivalent": equivalent}
    )
    lead = features(diagnosis)[1]
    diagnosis.ranking.append(candidate(["backlash", "gravity"], 0.9))
    diagnosis.ranking.append(candidate(["piecewise_stiffness"], 1.0))
    assert features(diagnosis)[1] == lead
    diagnosis.ranking.append(candidate(["hysteresis"], 1.5))
    assert features(diagnosis)[1] == pytest.approx(np.log(1.5))


def test_a_search_that_the_budget_ended_is_no_proof_that_nothing_explains_the_gap():
    (unexplained,) = [d for d in VERDICTS if d.verdict == "unexplained"][:1]
    cut = unexplained.model_copy(update={"notes": [*unexplained.notes, OUT_OF_TIME]})
    assert "no explanation of the catalogue closes it" in meaning(unexplained)
    assert "--budget" in meaning(cut) and "closes it" not in meaning(cut)


def test_nobody_is_sent_to_an_experiment_that_is_not_named():
    (ambiguous,) = [d for d in VERDICTS if d.verdict == "ambiguous"][:1]
    planned = NextExperiment(
        kind="level", description="Twice the level.", separates=["backlash", "gravity"],
        predicted_sigma=5.0, rig_time_s=60.0, settings={},
    )  # fmt: skip
    named = ambiguous.model_copy(update={"next_experiment": planned})
    assert ambiguous.next_experiment is None and "Run the next experiment" in action(named)
    assert "No experiment was found" in action(ambiguous) and "Run the" not in action(ambiguous)


@pytest.mark.parametrize("verdict", ["unexplained", "parameters_only"])
def test_updated_parameters_are_advised_only_where_they_come_nearer(verdict):
    after = said(verdict, left=30.0, refit=30.0)
    worse = Gap(nrmse_position=0.2, nrmse_torque=0.1, chi2_per_dof=300.0)
    mixed = Gap(nrmse_position=0.2, nrmse_torque=0.1, chi2_per_dof=30.0)
    for end, better in ((worse, False), (mixed, True), (gap(200.0), False), (None, False)):
        gaps = after.gap.model_copy(update={"refit": end, "explained": end})
        diagnosis = after.model_copy(update={"gap": gaps})
        assert is_better(diagnosis) == better
        assert ("Use the nominal parameters" in action(diagnosis)) != better


def test_a_nominal_that_diverges_is_worse_than_any_fit():
    gaps = said("unexplained").gap.model_copy(update={"nominal": None})
    assert is_better(said("unexplained").model_copy(update={"gap": gaps}))
