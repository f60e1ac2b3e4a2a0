"""`fjr diagnose` as a user meets it: bad input, verdicts on bad data, Ctrl-C."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import simulate_case, write_bags

from fjr_interface.parameter_file import save_parameter_file
from fjr_sim_node.plant import PLANT
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.steady_periods import NOTHING_NAMED

SHORT = {"base_frequency_hz": 0.5, "transient_periods": 2, "levels_rad": (3e-3, 1e-2)}


@pytest.fixture(scope="module")
def case():
    return simulate_case(seed=21, **SHORT)


@pytest.fixture(scope="module")
def bags(case, tmp_path_factory):
    return write_bags(case, tmp_path_factory.mktemp("rig") / "bags")


def written(case, folder, change):
    """Write the bags of a case with realizations changed by a function."""
    bags = tuple(change(r) for r in case.recorded.realizations)
    return write_bags(replace(case, recorded=replace(case.recorded, realizations=bags)), folder)


def refused(done, *words):
    assert done.exit_code == 2, done.output
    assert len(done.stderr.strip().splitlines()[-1].split(". ")) == 1
    for word in words:
        assert word in done.stderr
    assert "Traceback" not in done.output


def test_a_nominal_must_be_named(run, bags):
    done = run("diagnose", bags)
    assert done.exit_code == 2 and "--nominal" in done.stderr


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"k0": 1500.0}, "missing"),
        ({**PLANT.defaults(), "j": -0.3}, "j must lie in"),
        ({**PLANT.defaults(), "friction": 1.0}, "no parameter 'friction'"),
        ({**PLANT.defaults(), "k0": 26.18}, "26.18 N m/deg would"),
        ({**PLANT.defaults(), "delay.time_s": 1e-3}, "delay.time_s switches an effect on"),
    ],
)
def test_bad_nominal_files_are_one_sentence_and_write_nothing(run, bags, tmp_path, values, words):
    file = tmp_path / "sheet.yaml"
    save_parameter_file(file, {"simulator": values})
    refused(run("diagnose", bags, "--nominal", file, "--out", tmp_path / "out"), words, str(file))
    assert not (tmp_path / "out").exists()


def test_missing_folders_and_options_out_of_range_are_refused(run, bags, tmp_path):
    refused(run("diagnose", tmp_path / "none", "--nominal", "paper"), "none")
    assert run("diagnose", bags, "--nominal", "paper", "--tolerance", "0.9").exit_code == 2
    refused(run("diagnose", bags, "--nominal", "paper", "--map", "speed=/a:b"), "speed")


def test_bags_of_two_controllers_in_one_folder_are_refused(run, case, tmp_path):
    def other(r):
        if r.experiment.realization == 0:
            return r
        law = {**r.experiment.controller, "p": 150.0}
        return replace(r, experiment=r.experiment.model_copy(update={"controller": law}))

    folder = written(case, tmp_path / "bags", other)
    sentence = "differ in controller; put them into separate folders"
    refused(run("diagnose", folder, "--nominal", "paper"), sentence)


def verdict(run, folder, tmp_path, name):
    """Diagnose a folder; return the diagnosis and what was printed."""
    out = tmp_path / "out"
    done = run("diagnose", folder, "--nominal", "paper", "--out", out)
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == str(out / "report.html")
    diagnosis = Diagnosis.read(out / "diagnosis.json")
    assert diagnosis.verdict == name and f"verdict: {name}" in done.stdout
    return diagnosis, done.stdout


def test_a_response_that_is_not_periodic_is_bad_data_with_its_evidence(run, case, tmp_path):
    def subharmonic(r):
        t = np.arange(r.position.size) / r.position.size
        beat = 2e-3 * np.sin(2 * np.pi * 30.5 * len(r.position) * t).reshape(r.position.shape)
        return replace(r, position=r.position + beat)

    folder = written(case, tmp_path / "bags", subharmonic)
    diagnosis, text = verdict(run, folder, tmp_path, "bad_data")
    assert any("not periodic" in note for note in diagnosis.notes)
    assert "not periodic" in text and not diagnosis.ranking and not diagnosis.parameters


def test_a_torque_that_is_not_the_controllers_is_bad_data(run, case, tmp_path):
    folder = written(case, tmp_path / "bags", lambda r: replace(r, torque=r.torque + 0.5))
    diagnosis, _ = verdict(run, folder, tmp_path, "bad_data")
    assert any("offset by 0.5 N m" in note for note in diagnosis.notes)


def test_a_transient_that_has_not_decayed_is_bad_data(run, tmp_path):
    case = simulate_case(seed=3, base_frequency_hz=1.0, levels_rad=(3e-3,))
    folder = write_bags(case, tmp_path / "bags")
    diagnosis, _ = verdict(run, folder, tmp_path, "bad_data")
    assert any("discard more periods" in note for note in diagnosis.notes)


def test_a_nominal_that_is_unstable_in_the_loop_is_bad_data(run, bags, tmp_path):
    file = tmp_path / "sheet.yaml"
    weak = {"jm": 1e-4, "k0": 5.0, "fsm": 0.0, "fvm": 0.01}
    save_parameter_file(file, {"simulator": {**PLANT.defaults(), **weak}})
    done = run("diagnose", bags, "--nominal", file, "--out", tmp_path / "out")
    assert done.exit_code == 0 and "Warning: " in done.stderr
    diagnosis = Diagnosis.read(tmp_path / "out" / "diagnosis.json")
    assert diagnosis.verdict == "bad_data"
    assert any("nominal loop is not stable" in note for note in diagnosis.notes)
    assert NOTHING_NAMED in diagnosis.notes and diagnosis.gap.refit is not None


def test_ctrl_c_leaves_an_earlier_diagnosis_as_it_was(start_program, tmp_path):
    late = simulate_case({"delay.time_s": 1e-3}, seed=3, levels_rad=(7e-3,))
    bags, out = write_bags(late, tmp_path / "bags"), tmp_path / "out"
    out.mkdir()
    (out / "diagnosis.json").write_text("earlier")
    command = ["diagnose", str(bags), "--nominal", "paper", "--out", str(out)]
    run = start_program("fjr_cli", *command, errors_apart=True)
    run.wait_for_text("(2 of")
    assert run.interrupt() == 130
    assert "Interrupted: nothing was written" in run.errors
    assert run.output == "" and (out / "diagnosis.json").read_text() == "earlier"
    assert [path.name for path in out.iterdir()] == ["diagnosis.json"]


@pytest.mark.parametrize("names", [
    ["gravity,backlsh"], ["gravity", "--effects", "backlsh"], ["backlsh", "--effects", "gravity"],
])  # fmt: skip
def test_effects_may_be_named_at_once_or_one_by_one(run, bags, tmp_path, names):
    done = run(
        "diagnose", bags, "--nominal", "paper", "--out", tmp_path / "out", "--effects", *names
    )
    refused(done, "backlsh", "backlash")
