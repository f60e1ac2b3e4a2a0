"""`--dry-run`: nothing is written, and what is said is what the campaign then takes."""

from __future__ import annotations

from pathlib import Path

import pytest
from graph_runs import campaign, in_batch

from fjr_bringup.campaign.estimate import estimate
from fjr_bringup.design.amplitude import EXTRA, STEP, most_levels
from fjr_validation.blind.check import BlindCheck
from fjr_validation.blind.check_cost import MAKING_S
from fjr_validation.blind.check_cost import estimate as blind_estimate
from fjr_validation.blind.json_lines import JsonLines
from fjr_validation.paper import fig4
from fjr_validation.paper.paper_cost import estimate as paper_estimate
from fjr_validation.paper.settings import QUICK

SHORT = ("--set", "excitation.base_frequency_hz=1.0", "--set", "excitation.f_min_hz=1.0")


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_dry_run_says_what_it_takes_and_writes_nothing(run, tmp_path: Path, command: str):
    out = tmp_path / "rig"
    done = run(command, "--out", out, *SHORT, "--realizations", 3, "--periods", 2, "--dry-run")
    assert done.exit_code == 0, done.output
    assert "1 level, 3 bags of 3000 samples; 3 to record, 9 s of simulated time." in done.stdout
    assert "Disk: " in done.stdout and "Time: about " in done.stdout
    assert not out.exists()


def test_bad_values_are_refused_by_a_dry_run_too(run, tmp_path: Path):
    done = run("simulate", "--dry-run", "--set", "simulator.k0=-1.0")
    assert done.exit_code == 2 and "k0 must lie in" in done.stderr
    done = run("simulate", "--dry-run", "--record", "chirp")
    assert done.exit_code == 2 and "--dry-run is for campaigns" in done.stderr


def test_the_disk_is_what_the_bags_take(tmp_path: Path):
    planned = campaign(m=3, excitation={"periods": 4})
    said = estimate(planned, tmp_path / "rig")
    folder = in_batch(planned, tmp_path / "rig")
    taken = sum(file.stat().st_size for file in folder.glob("level_*/*"))
    assert said.disk_bytes == pytest.approx(taken, rel=0.3)
    assert (said.pending, estimate(planned, folder).pending) == (3, 0)


@pytest.mark.parametrize(
    ("command", "passes"), [("amplitude --lowest 1e-3 --highest 1.6e-2", 11), ("shape", 11)]
)
def test_a_search_says_what_a_pass_takes_and_how_many_there_may_be(
    run, tmp_path: Path, command: str, passes: int
):
    done = run(*command.split(), "--out", tmp_path / "out", "--realizations", 2, "--dry-run")
    assert done.exit_code == 0, done.output
    assert "1 level, 2 bags of 30000 samples; 2 to record" in done.stdout
    assert "Disk: " not in done.stdout
    assert f"That is one pass; there are {passes} at the most." in done.stdout
    assert not (tmp_path / "out").exists()


def test_a_search_measures_no_more_than_was_said():
    coarse = [1e-3 * STEP**k for k in range(20) if 1e-3 * STEP**k <= 1e-1 * (1.0 + 1e-9)]
    assert most_levels(1e-3, 1e-1) == len(coarse) + EXTRA


def test_the_paper_says_what_is_left_of_it(run, tmp_path: Path):
    out = tmp_path / "paper"
    done = run("paper", "--quick", "--out", out, "--dry-run")
    assert done.exit_code == 0, done.output
    assert "Amplitude sweep (Fig. 4): 100 of 100 levels to measure." in done.stdout
    assert "Time: about " in done.stdout and not out.exists()
    whole = paper_estimate(QUICK, out / "cache")
    for task in fig4.tasks(QUICK)[:50]:
        task.file(out).parent.mkdir(exist_ok=True)
        task.file(out).touch()
    half = paper_estimate(QUICK, out)
    assert (half.sweep, half.others) == ((100, 50), None)
    assert 0.2 * whole.processor_s < half.processor_s < whole.processor_s * 1.5


def test_a_blind_check_says_what_is_left_of_it(run, tmp_path: Path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    out = tmp_path / "blind"
    order = ("blind", "run", "--cases", 4, "--world", "open", "--method", "refit", "--out", out)
    done = run(*order, "--dry-run", "--workers", 2)
    assert done.exit_code == 0, done.output
    assert "4 cases (4 open) by refit; 4 to do." in done.stdout and not out.exists()
    assert "of bags, of cases under way." in done.stdout and "with 2 processes" in done.stdout
    check = BlindCheck.begin(out, {"open": 4}, None, ["refit"])
    lines = [{"case": case.name, "method": "refit", "seconds": 94.0} for case in check.cases[:1]]
    JsonLines(out / "verdicts.jsonl").append(*lines)
    left = blind_estimate(out, {"open": 4}, None, ["refit"])
    assert (left.missing, left.measured) == (3, True)
    assert left.processor_s == pytest.approx(3 * (94.0 + MAKING_S))
    other = run("blind", "run", "--cases", 5, "--out", out, "--dry-run")
    assert other.exit_code == 2 and "holds a check of other cases" in other.stderr
