from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from fjr_bringup.design.measured import simulate_level
from fjr_bringup.design.planner import Pilot, pilot_of, predicted_error_db, propose
from fjr_cli.app import app
from fjr_kit.errors import InputError
from fjr_validation.paper.levels import campaign_of
from fjr_validation.paper.planner_check import checked
from gap_diagnosis import Foresight

run_command = CliRunner().invoke
BAND = (1.0, 50.0)


def pilot(nonlinear=1e-3, noise=1e-3):
    frequency = np.arange(0.1, 50.0, 0.2)
    flat = np.ones(frequency.size)
    return Pilot(7e-3, frequency, nonlinear * flat, noise * flat, 10.0, 0.1, 0.03)


def test_the_error_follows_the_laws_of_m_and_p():
    one = pilot(nonlinear=0.0)
    many = predicted_error_db(one, 1000, 2, BAND)
    assert predicted_error_db(one, 1000, 8, BAND) == pytest.approx(many / 2, rel=0.01)
    assert predicted_error_db(one, 4000, 2, BAND) == pytest.approx(many / 2, rel=0.01)
    assert predicted_error_db(one, 1000, 2, BAND, spacing=4.0) == pytest.approx(many / 2, rel=0.01)
    noiseless = pilot(noise=0.0)
    same = predicted_error_db(noiseless, 1000, 2, BAND)
    assert predicted_error_db(noiseless, 1000, 8, BAND, spacing=4.0) == pytest.approx(same)


def test_it_proposes_the_quickest_that_reaches_the_target():
    found = propose([pilot()], 0.2, BAND, 1e5)
    assert found.error_db <= 0.2
    fewer = predicted_error_db(pilot(), found.realizations - 1, found.periods, BAND)
    assert fewer > 0.2
    assert found.time_s == found.realizations * (found.periods + found.transient_periods) * 10.0


def test_noise_asks_for_periods_and_distortion_for_realizations():
    noisy = propose([pilot(nonlinear=1e-5, noise=1e-2)], 0.3, BAND, 1e6)
    distorted = propose([pilot(nonlinear=1e-2, noise=1e-5)], 0.3, BAND, 1e6)
    assert noisy.periods > distorted.periods == 2


def test_a_coarser_grid_costs_less_where_it_is_allowed():
    fine = propose([pilot()], 0.2, BAND, 1e5)
    coarse = propose([pilot()], 0.2, BAND, 1e5, resolution_hz=0.5)
    assert coarse.time_s < fine.time_s and coarse.base_frequency_hz > 0.1
    assert coarse.transient_periods / coarse.base_frequency_hz >= 10.0 - 1e-9


def test_what_the_rig_time_does_not_allow():
    best = propose([pilot()], 1e-4, BAND, 600.0)
    assert best.error_db > 1e-4 and best.time_s <= 600.0
    with pytest.raises(InputError, match="fits into 100 s; give more rig time"):
        propose([pilot()], 1.0, BAND, 100.0)
    with pytest.raises(InputError, match="holds no line of the pilot"):
        propose([pilot()], 1.0, (60.0, 70.0), 1e4)


def test_it_takes_the_pilot_with_the_least_distortion():
    levels = [simulate_level(campaign_of(a, 3, 2)) for a in (2e-3, 7e-3, 2e-2)]
    found = propose([pilot_of(level) for level in levels], 2.0, BAND, 1e4)
    assert found.amplitude_rad == pytest.approx(7e-3)


@pytest.mark.parametrize(("target_db", "seed"), [(1.0, 5), (0.7, 6)])
def test_the_proposed_experiment_reaches_what_was_predicted(target_db, seed):
    """A pilot of 7 realizations knows a smoothed standard deviation to some 7 %."""
    one = checked(7e-3, target_db, 0.1, seed)
    assert one["predicted_db"] <= target_db
    assert one["reached_db"] == pytest.approx(one["predicted_db"], rel=0.2)


def test_the_command_says_what_to_run(tmp_path: Path):
    folder = str(tmp_path / "pilot")
    arguments = ["simulate", "--out", folder, "--realizations", "3", "--workers", "1"]
    assert run_command(app, arguments).exit_code == 0
    result = run_command(app, ["plan", folder, "--target-db", "1", "--band", "2", "40"])
    assert result.exit_code == 0, result.output
    last = result.output.splitlines()[-1]
    assert last.startswith("fjr run --level 0.007 --realizations ")
    result = run_command(app, ["plan", folder, "--target-db", "0.01", "--rig-time", "300"])
    assert "out of reach within 300 s" in result.output


def test_a_pilot_of_one_realization_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="two or more realizations of two or more periods"):
        pilot_of(simulate_level(campaign_of(7e-3, 1, 2)))


def test_the_command_says_what_a_plan_could_show(tmp_path: Path):
    grid = ["--set", "excitation.base_frequency_hz=1", "--set", "excitation.f_min_hz=1"]
    plan = ["plan", "--level", "0.01", "--realizations", "2", *grid, "--effects", "backlash,delay"]
    result = run_command(app, [*plan, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert "backlash.half_gap_rad" in result.output and "Note: The noise" not in result.output
    seen = Foresight.read(tmp_path / "out" / "plan.json")
    assert {one.effect for one in seen.effects} == {"backlash", "delay"}
    folder = str(tmp_path / "bags")
    simulated = ["simulate", "--out", folder, *plan[1:5], *grid, "--workers", "1"]
    assert run_command(app, simulated).exit_code == 0
    result = run_command(app, ["plan", folder, "--nominal", "paper", "--effects", "delay"])
    assert result.exit_code == 0 and "delay.time_s" in result.output


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--target-db", "1"], "needs pilot bags"),
        (["bags", "--level", "0.01"], "--level describes a plan"),
        (["bags"], "Give --nominal"),
        (["--set", "simulator.delay.time_s=0.001"], "switches an effect on"),
        (
            ["--set", "simulator.j=1e-4"],
            "the plan: /rig/simulator: fv / j is 4e+04 1/s, a motion too fast to be simulated at "
            "1000 samples a second; check values and units of fv and j.",
        ),
    ],
)
def test_a_plan_that_says_too_little_or_too_much(arguments, sentence):
    result = run_command(app, ["plan", *arguments])
    assert result.exit_code == 2 and sentence in " ".join(result.output.split())


def test_ctrl_c_ends_a_foresight_at_once_and_leaves_an_earlier_plan(start_program, tmp_path: Path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "plan.json").write_text("earlier")
    run = start_program("fjr_cli", "plan", "--level", "0.01", "--out", str(out), errors_apart=True)
    run.wait_for_text("stribeck_friction_motor")
    assert run.interrupt() == 130
    *counted, said = run.errors.splitlines()
    assert said == "Interrupted: nothing was written." and run.output == ""
    assert len(counted) < 10, "it went on with other effects"
    assert (out / "plan.json").read_text() == "earlier"
    assert [path.name for path in out.iterdir()] == ["plan.json"]
