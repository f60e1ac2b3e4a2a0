"""Shares in words: their digits, and what is said where there is none."""

from __future__ import annotations

import pytest

from gap_diagnosis.outcome.cause import Cause, Place
from gap_diagnosis.outcome.cause_words import (
    NO_SHARE,
    choice_sentences,
    contender_names,
    share_sentences,
    share_words,
    tells,
)
from gap_diagnosis.outcome.contender import Contender
from gap_diagnosis.outcome.diagnosis import Diagnosis, Step
from gap_diagnosis.outcome.gap_size import Figure, Gaps


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((0.0096, 0.0042, 0.019), "0.96% (0.42 to 1.9%)"),
        ((0.44, 0.0041, 1.17), "44% (0.41 to 117%)"),
        ((0.612, 0.553, 0.664), "61% (55 to 66%)"),
        ((0.612, None, None), "61%"),
        ((-0.0017, -0.0025, -0.00084), NO_SHARE),
        ((0.01, -0.02, 0.04), NO_SHARE),
        ((-0.01, None, None), NO_SHARE),
        ((10.0, 9.8, 10.0), "1000% or more"),
    ],
)
def test_a_share_and_both_its_ends_have_the_digits_they_need(ends, words):
    assert share_words(Figure(value=ends[0], low=ends[1], high=ends[2])) == words


def biased(after_nm: float) -> Diagnosis:
    """Return a diagnosis of a bias that an integrating loop keeps out of the position."""

    def step(added, stage, position, torque):
        return Step(
            added=added, stage=stage, nrmse_position=position, nrmse_torque=torque,
            chi2_per_dof=4.0,
        )  # fmt: skip

    place = Place(level=1, band_hz=(0.0, 2.6), lines="slow", signal="position", sigma=22.0)
    none = Figure(value=-0.0017, low=-0.0025, high=-0.00084)
    some = Figure(value=0.67, low=0.52, high=0.99)
    causes = [
        Cause(effect="coulomb_friction", present=0.99, share=some),
        Cause(effect="torque_bias", others=["gravity"], present=0.98, share=none, where=[place]),
    ]
    steps = [
        step(None, "nominal", 1e-3, 1.3), step(None, "refit", 9e-4, 1.3),
        step("coulomb_friction", "cause", 1.31e-4, 0.883),
        step("torque_bias", "cause", 1.36e-4, after_nm),
    ]  # fmt: skip
    nothing = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)
    return Diagnosis(
        verdict="partly_explained", effects=[c.effect for c in causes], confidence=0.98,
        causes=causes, steps=steps, gap=nothing,
    )  # fmt: skip


def test_a_cause_without_a_share_tells_what_it_does_to_the_torque():
    [said] = share_sentences(biased(0.0571))
    assert said.startswith("torque bias or gravity: ")
    assert "the torque's error falls from 88% to 5.7%" in said


def test_a_cause_that_closes_nothing_is_said_to_make_the_simulation_no_better():
    [said] = share_sentences(biased(0.884))
    assert "no part of the position's rms error on these runs" in said
    assert "level 1, 0 to 2.6 Hz" in said


def test_an_explanation_that_does_better_than_the_named_one_is_told_with_what_it_has_instead():
    def contender(effects, better, misfit=2.0):
        return Contender(
            effects=effects, held_out_chi2=misfit, gain=1.3, better=better, converged=True
        )

    named = ["coulomb_friction", "torque_bias"]
    for surely, misfit, does in ((False, 1.0, False), (True, 1.0, True), (True, 2.5, False)):
        found = [contender(named, False), contender(["torque_bias", "delay"], surely, misfit)]
        told = biased(0.1).model_copy(update={"contenders": found})
        assert contender_names(told) == ["as named", "delay for coulomb friction"]
        better = [s for s in choice_sentences(told) if "--effects torque_bias,delay" in s]
        assert len(better) == does


def test_an_experiment_says_which_pairs_it_tells_apart_by_what_they_do_not_share():
    three = [("delay", "gravity"), ("delay", "cogging"), ("delay", "torque_bias")]
    assert tells([(0, 1), (0, 2), (1, 2)], [(0, 1), (1, 2)], three) == (
        "It will tell gravity from cogging, cogging from torque bias. "
        "It will not tell gravity from torque bias."
    )
    assert tells([(0, 1)], [(0, 1)], three[:2]) == "It will tell gravity from cogging."
