"""What commands print on narrow terminals: every number whole."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console
from synthetic_result import make_result

from bla_analyzer.results.summary import summarize
from fjr_bringup.replay.comparison import Difference
from fjr_bringup.replay.publishing import Published, PublishedTopic
from fjr_cli import analysis_summary, diagnosis_summary
from fjr_cli.replay_summary import print_differences, print_published
from gap_diagnosis.outcome.cause import Cause, Place
from gap_diagnosis.outcome.contender import Contender
from gap_diagnosis.outcome.diagnosis import Diagnosis, EvidenceKind, Remainder, Step
from gap_diagnosis.outcome.gap_size import Estimate, Figure, Gap, GapFigures, Gaps, StageFigures

WIDTHS = (40, 60, 80)


@pytest.fixture(params=WIDTHS)
def console(request) -> Console:
    return Console(width=request.param, file=io.StringIO(), force_terminal=False)


def printed(console: Console) -> str:
    text = console.file.getvalue()
    assert "\N{HORIZONTAL ELLIPSIS}" not in text
    assert max(map(len, text.splitlines())) <= console.width
    return text


def test_analyze_cuts_no_number(console):
    result = make_result()
    analysis_summary.print_summary(result, console)
    lists = "level 0, " in console.file.getvalue()
    assert lists == (console.width < 80)
    words = printed(console).split()
    for level in result.levels:
        n = summarize(level)
        for db in (n.linear_db, n.odd_db, n.even_db, n.noise_db):
            assert f"{db:.1f}" in words
        for comparison in level.comparisons:
            assert f"{comparison.v_mean:.3g}" in words


def test_diagnose_cuts_no_number_and_says_the_share_as_a_sentence(console):
    names = ["piecewise_stiffness.soft_ratio", "backlash.half_gap_rad"]
    effects = ["piecewise_stiffness", "backlash"]
    figure = Figure(value=0.987, low=0.981, high=0.993)
    stage = StageFigures(nominal=None, refit=None, explained=None, noise_floor=None, closed=figure)
    chosen = Contender(effects=effects, held_out_chi2=123.4, gain=0.0, converged=True)
    other = Contender(effects=["delay"], held_out_chi2=125.6, gain=-0.0123, converged=False)
    gap = Gaps(
        nominal=Gap(nrmse_position=0.2345, nrmse_torque=0.3456, chi2_per_dof=2.91e4),
        refit=Gap(nrmse_position=0.0567, nrmse_torque=0.0678, chi2_per_dof=1.91e3),
        explained=Gap(nrmse_position=0.00123, nrmse_torque=0.000681, chi2_per_dof=0.662),
        noise_floor=Gap(nrmse_position=0.00124, nrmse_torque=0.000696, chi2_per_dof=1.0),
    )
    diagnosis = Diagnosis(
        verdict="ambiguous",
        effects=effects,
        confidence=0.5,
        steps=[
            Step(
                added=added,
                stage=stage,
                nrmse_position=of.nrmse_position,
                nrmse_torque=of.nrmse_torque,
                chi2_per_dof=of.chi2_per_dof,
            )
            for stage, of, added in (
                ("nominal", gap.nominal, None),
                ("refit", gap.refit, None),
                ("cause", gap.explained, " + ".join(effects)),
            )
        ],
        gap=gap,
        gap_closed=0.987,
        gap_figures=GapFigures(position=stage, torque=stage, bla_sigma=stage, distortion_db=stage),
        contenders=[chosen, other],
        parameters={name: Estimate(value=0.6543, low=0.6521, high=0.6565) for name in names},
    )
    diagnosis_summary.print_summary(diagnosis, console, Path("out"))
    text = printed(console)
    words = text.split()
    for number in ("23.4", "34.6", "2.91e+04", "0.123", "0.0681", "0.662", "123", "126", "-0.0123"):
        assert number in words, number
    for name in (*names, "0.6543", "0.6521", "0.6565"):
        assert name in text
    [share] = [line for line in text.splitlines() if "98.7%" in line]
    assert share.startswith("98.7% of what the refit left is")


def test_diagnose_says_causes_remainder_and_evidence_of_records_whole(console):
    place = Place(level=1, band_hz=(3.125, 15.625), lines="all", signal="position", sigma=4.42)
    share = Figure(value=0.612, low=0.553, high=0.664)
    diagnosis = Diagnosis(
        verdict="partly_explained",
        effects=["gravity"],
        equivalent=[["gravity", "torque_bias"]],
        confidence=0.97,
        evidence=EvidenceKind(
            noise="none", reported_on="blocks", controller="unknown", excitation="record"
        ),
        causes=[Cause(effect="gravity", others=["torque_bias"], present=0.97, share=share)],
        steps=[
            Step(added=None, stage="nominal", nrmse_position=1.42, nrmse_torque=None,
                 chi2_per_dof=None),
            Step(added=None, stage="refit", nrmse_position=0.481, nrmse_torque=0.3,
                 chi2_per_dof=None),
            Step(added="gravity", stage="cause", nrmse_position=0.193, nrmse_torque=0.2,
                 chi2_per_dof=None),
        ],
        remainder=Remainder(
            nrmse_position=0.193, share=0.161, looks_like=["velocity (a law of friction): 42%"],
            where=[place],
        ),
        gap=Gaps(nominal=None, refit=None, explained=None, noise_floor=None),
        parameters={"gravity.torque_nm": Estimate(value=8.058, low=7.914, high=8.202)},
    )  # fmt: skip
    diagnosis_summary.print_summary(diagnosis, console, Path("out"))
    text = " ".join(printed(console).split())
    assert text.startswith("Missing: gravity or torque bias; a remainder stays")
    assert text.endswith("Better simulation: fjr simulate --rig out/updated.yaml")
    diagnosis_summary.print_summary(diagnosis, console, Path("out"), runs=False)
    assert "add yours before fjr simulate" in " ".join(printed(console).split())
    for said in (
        "97%", "61% (55 to 66%)", "8.06", "7.91 to 8.20", "142", "48.1", "19.3",
        "19% of the motion remains, 16% of the refit's squared gap.",
        "velocity (a law of friction): 42%",
        "level 1, 3.1 to 16 Hz (4.4 \N{GREEK SMALL LETTER SIGMA})",
        "The noise is not known", "the recorded torque drove the model", "blocks of the records",
    ):  # fmt: skip
        assert said in text, said


def test_a_linear_axis_has_its_units_and_the_pitch_of_a_ripple(console):
    found = {
        "cogging.amplitude_nm": Estimate(value=6.0, low=5.6, high=6.4),
        "cogging.cycles_per_turn": Estimate(value=261.801, low=261.790, high=261.812),
        "cogging.phase_rad": Estimate(value=0.3, low=0.2, high=0.4),
    }
    diagnosis = Diagnosis(
        verdict="effect",
        effects=["cogging"],
        equivalent=[["cogging"]],
        confidence=0.9,
        evidence=EvidenceKind(
            noise="none", reported_on="blocks", controller="known", excitation="record",
            axis="linear",
        ),
        gap=Gaps(nominal=None, refit=None, explained=None, noise_floor=None),
        parameters=found,
    )  # fmt: skip
    diagnosis_summary.print_summary(diagnosis, console, Path("out"))
    text = " ".join(printed(console).split())
    assert "Its pitch is 23.9999 mm (23.9988 to 24.0009 mm)." in text
    assert set(text.split()) >= {"5.60", "6.40", "N", "261.790", "per", "pi", "rad"}, text
    assert "N m" not in text


def test_replay_cuts_no_number(console):
    difference = Difference(
        unit="N m",
        played_anew=True,
        samples=20000,
        different=17,
        first_different=12345,
        rms_recorded=1.234e-3,
        mean=1e-9,
        rms=5.678e-7,
        worst=9.012e-6,
        worst_sample=12346,
    )
    print_differences({"torque": difference}, console)
    line = PublishedTopic("/rig/motor_position", 1234567, "reliable, volatile, depth 100", 12)
    print_published(Published((line,), 1.0, 2.0, None), console)
    text = printed(console)
    for word in ("0.001234", "5.678e-07", "9.012e-06", "12346", line.topic, "1234567"):
        assert word in text.split(), word
