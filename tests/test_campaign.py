"""Campaigns from the command line: options, resuming, Ctrl-C, damaged folders, the demo."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ros_domain import PATIENCE_S, Starter, wait_for

from fjr_bringup import execute
from fjr_bringup.campaign import Campaign, bag_folder
from fjr_bringup.execute import parse_settings, run_demo, simulate_in_batch
from fjr_interface.bag_reader import BagReader, audit
from fjr_interface.errors import InputError

INTERRUPTED = (130, -signal.SIGINT)
"""A shell shows 130 for both: `python -m` ends by the signal itself if it came within an exec()."""

SHORT = [
    *("--realizations", "2", "--periods", "1"),
    *("--set", "excitation.base_frequency_hz=1", "--set", "excitation.f_min_hz=1"),
]


def fjr(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "fjr_bringup", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=PATIENCE_S)


def files(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.glob("level_*/*"))}


def test_simulate_makes_a_new_folder_and_names_it_last(tmp_path):
    done = fjr("simulate", *SHORT, "--level", "1e-3", "--level", "7e-3", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
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


def test_options_win_over_settings_and_these_over_the_file(tmp_path):
    rig = tmp_path / "rig.yaml"
    rig.write_text("/rig/simulator: {ros__parameters: {k1: 5.0, fs: 1.0}}\n")
    arguments = ["--rig", str(rig), "--out", "x", "--set", "simulator.k1=7", *SHORT]
    done = fjr("simulate", *arguments, "--set", "excitation.seed=3", "--seed", "4", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
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

    from fjr_bringup.cli import app

    out = tmp_path / "x"
    done = CliRunner().invoke(app, [command, "--out", str(out), *arguments])
    assert done.exit_code == 2
    assert done.stderr.startswith(sentence) and done.stderr.count("\n") == 1
    assert not out.exists()


def test_a_folder_with_something_else_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="exists and holds no campaign; name another --out"):
        simulate_in_batch(None, tmp_path, {})
    with pytest.raises(InputError, match="exists and holds no campaign"):
        simulate_in_batch(None, tmp_path / "notes.txt", {})


def short(**given: object) -> dict[str, dict[str, object]]:
    values = {"base_frequency_hz": 1.0, "f_min_hz": 1.0, "realizations": 3, "periods": 1}
    return {"excitation": {**values, **given}}


def test_another_campaign_in_the_folder_is_refused(tmp_path):
    folder = simulate_in_batch(None, tmp_path / "x", short(), workers=1)
    before = files(folder)
    with pytest.raises(InputError, match=r"excitation.seed is 1, not 2: another campaign"):
        simulate_in_batch(None, folder, short(seed=2), workers=1)
    assert files(folder) == before


def test_a_damaged_bag_is_refused_on_resuming(tmp_path):
    folder = simulate_in_batch(None, tmp_path / "x", short(), workers=1)
    bag = bag_folder(folder, 0, 1)
    (data,) = bag.glob("*.mcap")
    data.write_bytes(data.read_bytes()[:-1000])
    with pytest.raises(InputError) as caught:
        simulate_in_batch(None, folder, {}, workers=1)
    assert str(data) in str(caught.value)


def test_resuming_makes_only_what_is_missing_with_the_same_bytes(tmp_path, capsys):
    import shutil

    folder = simulate_in_batch(None, tmp_path / "x", short(), workers=2)
    whole = files(folder)
    kept = bag_folder(folder, 0, 2)
    before = kept.stat().st_mtime_ns
    shutil.rmtree(bag_folder(folder, 0, 1))
    assert simulate_in_batch(None, folder, {}) == folder  # the folder's own campaign
    assert "2 of 3 bags are there already." in capsys.readouterr().err
    assert files(folder) == whole and kept.stat().st_mtime_ns == before


@pytest.mark.ros
@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run_keeps_bags_and_resumes_to_the_same_bytes(
    tmp_path, start: Starter, signal_number
):
    options = ["--realizations", "3", "--periods", "3", "--transient-periods", "0"]
    out = tmp_path / "x"
    run = start("fjr_bringup", "run", "--out", str(out), *options)
    first, second = bag_folder(out, 0, 0), out / f".{bag_folder(out, 0, 1).name}.partial"
    wait_for(second.exists, f"the second bag: {run.output}")
    run.process.send_signal(signal_number)
    assert run.exit_status() in INTERRUPTED, run.output
    assert f"Interrupted: 1 of 3 bags are finished and kept in {out}" in run.output
    assert f"to go on: fjr run --out {out}" in run.output
    assert [path.name for path in out.glob("level_*")] == [first.name]
    assert not list(out.glob(".*"))
    audit(first)
    resumed = start("fjr_bringup", "run", "--out", str(out), "--composed")
    assert resumed.exit_status() == 0, resumed.output
    assert "1 of 3 bags are there already." in resumed.output
    assert resumed.output.splitlines()[-1] == str(out)
    overrides = {"excitation": {"realizations": 3, "periods": 3, "transient_periods": 0}}
    assert files(out) == files(simulate_in_batch(None, tmp_path / "whole", overrides, workers=1))


def test_interrupted_simulation_keeps_finished_bags(tmp_path, mark):
    starter = Starter(tmp_path)
    out = tmp_path / "x"
    options = ["--realizations", "400", "--periods", "3", "--workers", "2"]
    run = starter("fjr_bringup", "simulate", "--out", str(out), *options)
    wait_for(lambda: list(out.glob("level_*")), f"a bag: {run.output}")
    assert run.interrupt() in INTERRUPTED, run.output
    bags = list(out.glob("level_*"))
    assert 0 < len(bags) < 400
    assert f"Interrupted: {len(bags)} of 400 bags are finished and kept in {out}" in run.output
    assert not list(out.glob(".*"))
    for bag in bags:
        audit(bag)


def test_no_worker_survives_a_killed_simulation(tmp_path, mark):
    run = Starter(tmp_path)(
        "fjr_bringup", "simulate", "--out", str(tmp_path / "x"), "--realizations", "500",
        "--workers", "2",
    )  # fmt: skip
    wait_for(lambda: list((tmp_path / "x").glob("level_*")), f"a bag: {run.output}")
    run.process.kill()
    run.process.wait()  # the fixture `mark` waits for the end of all workers


def test_settings_are_typed_as_ros_does():
    parsed = parse_settings(["excitation.amplitudes_rad=[1e-3, 7e-3]", "simulator.k1=0"])
    assert parsed == {"excitation": {"amplitudes_rad": (1e-3, 7e-3)}, "simulator": {"k1": 0}}


@pytest.mark.ros
def test_demo_ends_with_its_report_and_a_second_one_keeps_the_bags(
    tmp_path, domain, monkeypatch, capsys
):
    excitation = {**execute.DEMO["excitation"], "base_frequency_hz": 0.5, "f_min_hz": 0.5}
    monkeypatch.setitem(execute.DEMO, "excitation", excitation)
    report = run_demo(tmp_path / "demo")
    assert report == tmp_path / "demo" / "analysis" / "report.html"
    assert "BLA" in report.read_text(encoding="utf-8")
    bags = files(tmp_path / "demo")
    assert len(bags) == 14
    assert run_demo(tmp_path / "demo") == report
    assert "7 of 7 bags are there already." in capsys.readouterr().err
    assert files(tmp_path / "demo") == bags
