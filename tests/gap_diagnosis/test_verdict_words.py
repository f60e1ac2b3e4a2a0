"""What a verdict tells to do, and what it does not claim."""

from __future__ import annotations

import pytest

from gap_diagnosis.outcome.diagnosis import Diagnosis, Gap, Gaps, NextExperiment
from gap_diagnosis.outcome.verdict_words import OUT_OF_TIME, action, headline, is_better, meaning


def gap(chi2):
    return Gap(nrmse_position=0.1, nrmse_torque=0.1, chi2_per_dof=chi2)


def said(verdict, left=1.0, effects=(), refit=100.0):
    named = list(effects)
    return Diagnosis(
        verdict=verdict, effects=named, equivalent=[[name] for name in named], confidence=0.0,
        gap=Gaps(nominal=gap(200.0), refit=gap(refit), explained=gap(left), noise_floor=gap(1.0)),
    )  # fmt: skip


def test_a_search_that_the_budget_ended_is_no_proof_that_nothing_explains_the_gap():
    unexplained = said("unexplained", 30.0)
    cut = unexplained.model_copy(update={"notes": [*unexplained.notes, OUT_OF_TIME]})
    assert "no explanation of the catalogue closes it" in meaning(unexplained)
    assert "--budget" in meaning(cut) and "closes it" not in meaning(cut)


def test_nobody_is_sent_to_an_experiment_that_is_not_named():
    ambiguous = said("ambiguous", effects=("backlash", "gravity"))
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


def test_the_headline_counts_causes_and_not_the_members_of_a_set():
    one = said("ambiguous", effects=("backlash",)).model_copy(
        update={"equivalent": [["backlash", "piecewise_stiffness"]]}
    )
    assert headline(one) == "An effect is missing: backlash or piecewise stiffness"
    two = one.model_copy(update={"equivalent": [*one.equivalent, ["gravity"]]})
    assert headline(two) == "Effects are missing: backlash or piecewise stiffness; gravity"
