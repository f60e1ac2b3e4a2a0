"""Campaigns in batch from the command line: options, resuming, Ctrl-C, damaged folders."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from processes import INTERRUPTED

from bla_analyzer import Fit
from fjr_bringup.campaign.plan import CAMPAIGN_FILE, Campaign
from fjr_bringup.campaign.settings import parse_settings
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.reader import BagReader, audit, read_record
from fjr_sim_node.simulation.simulator import run_realization

SHORT = [
    *("--realizations", "2", "--periods", "1"),
    *("--set", "excitation.base_frequency_hz=1", "--set", "excitation.f_min_hz=1"),
]


def files(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.glob("level_*/*"))}


def test_simulate_makes_a_new_folder_and_names_it_last(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run("simulate", *SHORT, "--level", "1e-3", "--level", "7e-3", "--workers", "1")
    assert done.exit_code == 0, done.stderr
    folder = tmp_path / done.stdout.splitlines()[-1]
    assert re.fullmatch(r"\d{4}-\d\d-\d\d_\d{6}", folder.name)
    assert folder.parent == tmp_path / "experiments"
    bags = sorted(path.name for path in folder.glob("level_*"))
    assert bags == [f"level_{a}_realization_00{m}" for a in (0, 1) for m in (0, 1)]
    experiment = BagReader(folder / bags[2]).experiment
    assert (experiment.level, experiment.amplitude_rad, experiment.levels) == (1, 7e-3, 2)


@pytest.mark.parametrize(
    ("order", "runs"),
    [
        ("levels", [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]),
        ("interleaved", [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)]),
    ],
)
def test_realizations_are_played_in_the_order_that_the_description_gives(order, runs):
    values = {"order": order, "amplitudes_rad": (1e-3, 7e-3), "realizations": 3}
    campaign = Campaign.create(overrides={"excitation": values})
    assert campaign.runs == runs
    starts = [campaign.experiment(*run).elapsed_s for run in runs]
    assert starts == [30.0 * number for number in range(6)]


def test_options_win_over_settings_and_these_over_the_file(run, tmp_path):
    rig = tmp_path / "rig.yaml"
    rig.write_text("/rig/simulator: {ros__parameters: {k1: 5.0, fs: 1.0}}\n")
    own = ["--rig", str(rig), "--set", "simulator.k1=7", "--workers", "1"]
    arguments = [*own, "--out", tmp_path / "x", *SHORT]
    done = run("simulate", *arguments, "--set", "excitation.seed=3", "--seed", "4")
    assert done.exit_code == 0, done.stderr
    values = Campaign.create(tmp_path / "x" / "campaign.yaml").values
    assert values["simulator"]["k1"] == 7.0 and values["simulator"]["fs"] == 1.0
    assert values["excitation"]["seed"] == 4


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--set", "simulator.k1"], "--set simulator.k1: write NODE.PARAMETER=VALUE"),
        (["--set", "motor.k1=1"], "--set motor.k1=1: write NODE.PARAMETER=VALUE"),
        (["--set", "simulator.jm=-1"], "simulator: jm must lie in"),
        (["--set", "simulator.k1=[1, a]"], "--set simulator.k1=[1, a] mixes types"),
        (["--set", "simulator.k1={"], "--set simulator.k1={: '{' is not a value."),
        (["--realizations", "0"], "excitation: realizations must lie in"),
        (["--level", "0"], "amplitudes_rad[0] must be greater than zero."),
        (["--rig", "none.yaml"], "none.yaml: cannot be read"),
        (["--set", "controller.sample_rate_hz=500"], "sample_rate_hz differs"),
        (["--set", "excitation.base_frequency_hz=0.7"], "base_frequency_hz 0.7 Hz gives a period"),
    ],
)
@pytest.mark.parametrize("command", ["run", "simulate"])
def test_bad_input_is_one_sentence_and_leaves_nothing(tmp_path, command, arguments, sentence):
    from typer.testing import CliRunner

    from fjr_cli.app import app

    out = tmp_path / "x"
    done = CliRunner().invoke(app, [command, "--out", str(out), *arguments])
    assert done.exit_code == 2
    assert done.stderr.startswith(sentence) and done.stderr.count("\n") == 1
    assert not out.exists()


def test_a_folder_with_something_else_is_refused(run, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    done = run("simulate", "--out", tmp_path)
    assert done.exit_code == 2 and "exists and holds no campaign; name another --out" in done.stderr
    done = run("simulate", "--out", tmp_path / "notes.txt")
    assert done.exit_code == 2
    assert re.search("exists and holds no campaign|is a file; name a folder", done.stderr)


THREE = [
    *("--realizations", "3", "--periods", "1", "--workers", "1"),
    *("--set", "excitation.base_frequency_hz=1", "--set", "excitation.f_min_hz=1"),
]


def test_another_campaign_in_the_folder_is_refused(run, tmp_path):
    folder = tmp_path / "x"
    assert run("simulate", "--out", folder, *THREE).exit_code == 0
    before = files(folder)
    done = run("simulate", "--out", folder, *THREE, "--seed", "2")
    assert done.exit_code == 2 and "excitation.seed is 1, not 2: another campaign" in done.stderr
    assert files(folder) == before


def test_a_damaged_bag_is_refused_on_resuming(run, tmp_path):
    folder = tmp_path / "x"
    assert run("simulate", "--out", folder, *THREE).exit_code == 0
    (data,) = bag_folder(folder, 0, 1).glob("*.mcap")
    data.write_bytes(data.read_bytes()[:-1000])
    done = run("simulate", "--out", folder)
    assert done.exit_code == 2 and str(data) in done.stderr


def test_resuming_makes_only_what_is_missing_with_the_same_bytes(run, tmp_path):
    import shutil

    folder = tmp_path / "x"
    assert run("simulate", "--out", folder, *THREE, "--workers", "2").exit_code == 0
    whole = files(folder)
    kept = bag_folder(folder, 0, 2)
    before = kept.stat().st_mtime_ns
    shutil.rmtree(bag_folder(folder, 0, 1))
    done = run("simulate", "--out", folder)  # the folder's own campaign
    assert done.exit_code == 0 and done.stdout.splitlines()[-1] == str(folder)
    assert "2 of 3 bags are there already." in done.stderr
    assert files(folder) == whole and kept.stat().st_mtime_ns == before


def test_interrupted_simulation_keeps_finished_bags(tmp_path, start_program):
    out = tmp_path / "x"
    options = ["--realizations", "400", "--periods", "3", "--workers", "2"]
    run = start_program("fjr_cli", "simulate", "--out", str(out), *options)
    run.wait_for(lambda: list(out.glob("level_*")), "a bag")
    assert run.interrupt() in INTERRUPTED, run.output
    bags = list(out.glob("level_*"))
    assert 0 < len(bags) < 400
    assert f"Interrupted: {len(bags)} of 400 bags are finished and kept in {out}" in run.output
    assert not list(out.glob(".*"))
    for bag in bags:
        audit(bag)


def test_no_worker_survives_a_killed_simulation(tmp_path, start_program):
    run = start_program(
        "fjr_cli", "simulate", "--out", str(tmp_path / "x"), "--realizations", "500",
        "--workers", "2",
    )  # fmt: skip
    run.wait_for(lambda: list((tmp_path / "x").glob("level_*")), "a bag")
    run.process.kill()
    run.process.wait()  # the fixture `mark` waits for the end of all workers


def test_a_second_encoder_is_recorded_and_both_are_analyzed_and_fitted(run, tmp_path):
    out = tmp_path / "two"
    two = ("--set", "simulator.link_encoder=true", "--set", "simulator.noise_std_rad=1e-5")
    done = run("simulate", "--out", out, *SHORT, "--realizations", "4", "--workers", "1", *two)
    assert done.exit_code == 0, done.output
    bag = BagReader(bag_folder(out, 0, 3))
    expected = run_realization(
        Campaign.create(out / CAMPAIGN_FILE).values["simulator"], bag.experiment
    )
    np.testing.assert_array_equal(read_record(bag.path).link, expected.link)
    refused = run("simulate", "--out", out, "--set", "simulator.link_encoder=false")
    assert refused.exit_code == 2 and "simulator.link_encoder is True, not False" in refused.stderr
    done = run("fit", out, "--model", "two-inertia", "--no-report")
    assert done.exit_code == 0, done.output
    level = Fit.read(out / "fit" / "fit.json").levels[0]
    assert [one.output for one in level.outputs] == ["motor_position", "link_position"]


def test_settings_are_typed_as_ros_does():
    parsed = parse_settings(["excitation.amplitudes_rad=[1e-3, 7e-3]", "simulator.k1=0"])
    assert parsed == {"excitation": {"amplitudes_rad": (1e-3, 7e-3)}, "simulator": {"k1": 0}}
