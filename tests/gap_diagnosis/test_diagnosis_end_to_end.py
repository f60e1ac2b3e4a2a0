"""From real bags through the command line to the verdict, and on with the updated file."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from gap_cases import simulate_case, write_bags
from typer.testing import CliRunner

from fjr_cli.app import app
from fjr_records.periodic import read_experiment
from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.steady_periods import NOTHING_NAMED

pytestmark = pytest.mark.slow

SEED = 31
SHORT = {"base_frequency_hz": 0.5, "transient_periods": 2, "levels_rad": (2e-3, 1e-2)}
HALF_GAP_RAD = 1e-3


@pytest.fixture(scope="module")
def run():
    def invoke(*arguments):
        done = CliRunner().invoke(app, [str(a) for a in arguments], env={"COLUMNS": "120"})
        assert done.exit_code == 0, done.output
        return done

    return invoke


def diagnosed(run, folder, effects):
    """Record a rig and diagnose it; return its case, the diagnosis and what was printed."""
    case = simulate_case(effects, seed=SEED, **SHORT)
    bags = write_bags(case, folder / "bags")
    done = run("diagnose", bags, "--nominal", "paper", "--out", folder / "out")
    return case, Diagnosis.read(folder / "out" / "diagnosis.json"), done.stdout


@pytest.fixture(scope="module")
def backlash(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("backlash")
    return folder, *diagnosed(run, folder, {"backlash.half_gap_rad": HALF_GAP_RAD})


@pytest.fixture(scope="module")
def bare(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bare")
    return folder, *diagnosed(run, folder, {})


def test_a_rig_with_backlash_is_named_and_its_gap_closed(backlash):
    _, case, diagnosis, text = backlash
    assert diagnosis.verdict in ("effect", "ambiguous")
    assert "backlash" in diagnosis.equivalent[0]
    assert set(diagnosis.equivalent[0]) <= {"backlash", "piecewise_stiffness"}
    ranked = {tuple(candidate.effects): candidate for candidate in diagnosis.ranking}
    half_gap = ranked[("backlash",)].parameters["backlash.half_gap_rad"]
    assert half_gap.value == pytest.approx(HALF_GAP_RAD, rel=0.05)
    if len(diagnosis.equivalent[0]) > 1:
        chosen, *others = diagnosis.contenders
        assert chosen.effects == diagnosis.effects and chosen.gain == 0.0
        assert [one.effects[-1] for one in others] == diagnosis.equivalent[0][1:]
        assert all(one.gain < 1.0 and one.held_out_chi2 < 2.0 for one in others)
        assert all(f"{one.effects[-1].replace('_', ' ')} for " in text for one in others)
    assert diagnosis.gap_closed > 0.9
    assert 0.9 < diagnosis.causes[0].share.low <= diagnosis.causes[0].share.high <= 1.0
    assert diagnosis.gap.explained.nrmse_position < 2 * diagnosis.gap.noise_floor.nrmse_position
    for name in PLANT.names:
        assert diagnosis.parameters[name].value == pytest.approx(case.truth.plant[name], rel=0.05)
    assert "backlash" in text.splitlines()[0]
    assert text.splitlines()[-1].endswith("report.html")


def test_a_rig_without_effect_needs_parameters_only(bare):
    _, _, diagnosis, text = bare
    assert diagnosis.verdict == "parameters_only" and diagnosis.effects == []
    assert diagnosis.gap.refit.nrmse_position < 1.5 * diagnosis.gap.noise_floor.nrmse_position
    assert diagnosis.gap.nominal.nrmse_position > 10 * diagnosis.gap.refit.nrmse_position
    assert "Parameters only" in text


@pytest.mark.parametrize("which", ["backlash", "bare"])
def test_fjr_simulate_with_the_updated_file_repeats_the_rig_within_the_stated_gap(
    run, which, request, tmp_path
):
    folder, case, diagnosis, _ = request.getfixturevalue(which)
    rig_file = folder / "out" / "updated.yaml"
    seed = SEED + 1  # of the rig's phases, so that both play the same reference
    options = ("--rig", rig_file, "--seed", seed, "--workers", 1, "--out", tmp_path / "again")
    run("simulate", *options)
    again = read_experiment(tmp_path / "again")
    shares = []
    for rig, simulated in zip(case.recorded.realizations, again.realizations, strict=True):
        assert np.array_equal(rig.reference, simulated.reference)
        if rig.experiment.realization == 1:  # held out of the fit
            y = rig.kept(rig.position).mean(0)
            error = simulated.kept(simulated.position).mean(0) - y
            shares.append(np.mean(error**2) / np.mean(y**2))
    stated = diagnosis.gap.explained if diagnosis.effects else diagnosis.gap.refit
    missed = np.sqrt(np.mean(shares))  # with noise of all frequencies, in both
    assert 0.9 * stated.nrmse_position < missed < 1.5 * stated.nrmse_position


def test_a_rig_that_warms_up_is_nonstationary(run, tmp_path):
    effects = {"nonstationary.friction_per_s": 1e-3}
    _, diagnosis, text = diagnosed(run, tmp_path, effects)
    assert diagnosis.verdict == "nonstationary" and diagnosis.effects == []
    assert any("drifts within bags" in note for note in diagnosis.notes)
    assert diagnosis.steps[-1].added == "nonstationary" and NOTHING_NAMED not in diagnosis.notes
    assert "The rig changes while it is recorded" in text


FEW = {
    "one realization": ({"realizations": 1}, "one realization only"),
    "one level": ({"levels_rad": (1e-2,)}, "one level only"),
    "one period": ({"periods": 1}, "Only one period was kept"),
    "no noise": ({"noise_rad": 0.0}, "no noise, so significance"),
}


@pytest.mark.parametrize("what", FEW)
def test_what_too_few_data_cannot_say_is_said_and_the_rest_goes_on(run, what, tmp_path):
    change, words = FEW[what]
    effects = {"backlash.half_gap_rad": HALF_GAP_RAD}
    case = simulate_case(effects, seed=SEED, **{**SHORT, **change})
    bags = write_bags(case, tmp_path / "bags")
    few = "backlash,piecewise_stiffness,delay,hysteresis"  # what is said is the subject, not found
    out = tmp_path / "out"
    done = run("diagnose", bags, "--nominal", "paper", "--effects", few, "--out", out)
    text = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    diagnosis = Diagnosis.read(tmp_path / "out" / "diagnosis.json")
    assert any(words in note for note in diagnosis.notes), diagnosis.notes
    assert words in " ".join(done.stdout.split())
    assert diagnosis.verdict in ("effect", "ambiguous")
    assert "backlash" in diagnosis.equivalent[0]
    assert (text["gap_figures"]["bla_sigma"]["noise_floor"] is None) == (what == "one period")
    if what == "one realization":  # no run to hold out, but blocks of runs
        assert diagnosis.reported_on == "blocks"
        report = (tmp_path / "out" / "report.html").read_text()
        for said in (" ".join(done.stdout.split()), report):
            assert "block by block" in said
    else:
        assert diagnosis.reported_on == "records"


def test_a_coarse_encoder_is_judged_by_its_statistics_and_no_share_is_stated(run, tmp_path):
    case = simulate_case(
        {"encoder_quantization.resolution_rad": 6e-4}, seed=5, base_frequency_hz=0.5,
        levels_rad=(4e-3, 1.2e-2), transient_periods=2,
    )  # fmt: skip
    bags = write_bags(case, tmp_path / "bags")
    few = "encoder_quantization,encoder_eccentricity,presliding_friction,delay"
    out = tmp_path / "out"
    done = run("diagnose", bags, "--nominal", "paper", "--effects", few, "--out", out)
    text = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert text["effects"] == ["encoder_quantization"]
    assert text["gap_closed"] is None
    assert all(figure["closed"] is None for figure in text["gap_figures"].values())
    stdout = " ".join(done.stdout.split())
    note = next(note for note in text["notes"] if "judged by its statistics" in note)
    assert " ".join(note.split()) in stdout
    made, left = (float(s) for s in re.search(r"by (\S+)% of .* leaves (\S+)%", note).groups())
    assert 0.5 < made / left < 2.0
    report = (tmp_path / "out" / "report.html").read_text()
    for said in (stdout, report):
        assert "No share of the gap is stated" in said and "is closed" not in said


def test_unseen_bags_of_the_same_rig_have_no_gap_to_the_updated_parameters(bare):
    _, _, diagnosis, _ = bare
    nominal = {name: diagnosis.parameters[name].value for name in PLANT.names}
    again = simulate_case({}, seed=SEED, **{**SHORT, "levels_rad": (4e-3, 1.5e-2)})
    found = investigate(again.recorded, nominal)
    assert found.diagnosis.verdict == "no_gap"


def test_parameters_that_a_gain_scales_are_said_to_lie_beyond_the_tolerance():
    case = simulate_case({"torque_gain.relative_error": -0.25}, seed=SEED, off=0.0, **SHORT)
    diagnosis = investigate(case.recorded, PLANT.defaults()).diagnosis
    assert diagnosis.verdict == "parameters_only"
    note = next(note for note in diagnosis.notes if "beyond the tolerance" in note)
    assert "jm, j, fs, fsm, fv, fvm, k0" in note and "gain" in note
    assert diagnosis.parameters["k0"].value == pytest.approx(
        PLANT.defaults()["k0"] / 0.75, rel=0.02
    )


def test_parameters_within_the_tolerance_have_no_such_note(bare):
    assert not [note for note in bare[2].notes if "beyond the tolerance" in note]
