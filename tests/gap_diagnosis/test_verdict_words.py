"""What a verdict tells to do, and what it does not claim."""

from __future__ import annotations

import pytest

from gap_diagnosis.outcome.diagnosis import Candidate, Diagnosis, EvidenceKind, NextExperiment
from gap_diagnosis.outcome.gap_size import Gap, Gaps
from gap_diagnosis.outcome.verdict_words import (
    OUT_OF_TIME,
    action,
    doubt,
    headline,
    is_better,
    meaning,
)
from gap_diagnosis.verdict.judgement import parameters_explain


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
    nearer = gap(30.0)
    advised = {False: "Use the nominal parameters", None: "Choose by what counts for you"}
    for end, better in (
        (worse, False), (mixed, None), (gap(200.0), False), (None, False), (nearer, True),
    ):  # fmt: skip
        gaps = after.gap.model_copy(update={"refit": end, "explained": end})
        diagnosis = after.model_copy(update={"gap": gaps})
        assert is_better(diagnosis) == bool(better)
        said_so = {key for key, words in advised.items() if words in action(diagnosis)}
        assert said_so == {better} - {True}
    choice = action(after.model_copy(update={"gap": Gaps(
        nominal=gap(200.0), refit=mixed, explained=mixed, noise_floor=gap(1.0)
    )}))  # fmt: skip
    assert "by the misfit, but are farther off by the error of the position" in choice


def test_without_a_gap_the_file_of_the_refit_is_no_better_simulation():
    same = said("no_gap", left=0.79)
    assert not is_better(same) and "noise does not tell" in action(same)


def test_fits_that_did_not_converge_are_blamed_only_where_one_did_not():
    for converged in (True, False):
        tried = Candidate(
            effects=["gravity"], held_out_chi2=3.0, delta=-1.0, converged=converged, parameters={}
        )
        words = doubt(said("unexplained").model_copy(update={"ranking": [tried]}))
        assert ("did not converge" in words) != converged
    assert "did not converge" not in doubt(said("unexplained"))


def test_records_are_not_said_to_have_been_searched_for_an_experiment():
    evidence = EvidenceKind(
        noise="repeats", reported_on="records", controller="known", excitation="record"
    )
    told = said("ambiguous", effects=("gravity",)).model_copy(
        update={"evidence": evidence, "equivalent": [["gravity", "cogging"]]}
    )
    assert "fjr plan --effects gravity,cogging" in action(told)
    periodic = evidence.model_copy(update={"excitation": "periodic"})
    assert "No experiment was found" in action(told.model_copy(update={"evidence": periodic}))
    blind = periodic.model_copy(update={"controller": "unknown"})
    assert "was looked for" in action(told.model_copy(update={"evidence": blind}))


def test_parameters_explain_a_gap_only_if_they_close_it():
    """A refit of small misfit that is no nearer than the datasheet explains nothing."""
    for nominal, refit, explains in (
        (5000.0, 3.0, True), (2.5, 1.1, True), (None, 3.0, True),
        (2.285, 2.843, False), (3.9, 3.6, False), (5000.0, 4.5, False), (2.5, None, False),
    ):  # fmt: skip
        assert parameters_explain(nominal, refit) == explains, (nominal, refit)


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
