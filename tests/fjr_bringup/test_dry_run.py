"""`--dry-run`: nothing is written, and what is said is what the campaign then takes."""

from __future__ import annotations

from pathlib import Path

import pytest
from graph_runs import campaign, in_batch

from fjr_bringup.campaign.estimate import estimate

SHORT = ("--set", "excitation.base_frequency_hz=1.0", "--set", "excitation.f_min_hz=1.0")


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_dry_run_says_what_it_takes_and_writes_nothing(run, tmp_path: Path, command: str):
    out = tmp_path / "rig"
    done = run(command, "--out", out, *SHORT, "--realizations", 3, "--periods", 2, "--dry-run")
    assert done.exit_code == 0, done.output
    assert "1 levels, 3 bags of 3000 samples; 3 to record, 9 s of simulated time." in done.stdout
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
