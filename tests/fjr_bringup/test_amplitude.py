from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bla_analyzer.compare.bootstrap import interval, resampled
from bla_analyzer.compare.optimum import is_bracketed, least
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.amplitude import Limits, bag_levels, search
from fjr_bringup.design.bench import batch_bench
from fjr_cli.app import app
from fjr_kit.errors import InputError
from fjr_validation.paper.search_check import draw, searched

run_command = CliRunner().invoke


def campaign(**values):
    excitation = {"realizations": 5, "periods": 2, **values}
    return Campaign.create(None, {"excitation": excitation, "simulator": {"noise_std_rad": 2e-5}})


@pytest.mark.parametrize("number", [0, 8])
def test_it_is_near_the_true_optimum_without_knowing_g0(number):
    """The issue's target; `fjr paper` tries 20 parameter sets."""
    found = searched(draw(number), number + 1, true_realizations=8)
    assert bool(found["true_bracketed"])
    assert found["distortion"] == pytest.approx(found["true_rad"], rel=0.2)


def test_a_limit_ends_the_search_before_it_is_exceeded():
    played = []

    def bench(one, name):
        level = batch_bench(one, name)
        played.append(level.peak)
        return level

    found = search(campaign(), bench, limits=Limits(torque_nm=250.0, position_rad=0.09))
    torque, position = np.max(played, axis=0)[1:]
    assert torque <= 250.0 and position <= 0.09
    assert not found.bracketed and "limit" in found.ended_by
    assert found.best_rad == pytest.approx(found.amplitudes_rad[-1])


def test_an_amplitude_range_without_any_use_is_refused():
    with pytest.raises(InputError, match=r"Even 0\.001 rad is too much: the torque limit"):
        search(campaign(), batch_bench, limits=Limits(torque_nm=1.0))
    with pytest.raises(InputError, match="above zero and below the highest"):
        search(campaign(), batch_bench, lowest_rad=1e-2, highest_rad=1e-3)


def test_the_least_value_of_a_power_law_valley_is_found_between_the_points():
    amplitudes = np.geomspace(1e-3, 1e-1, 12)
    values = np.exp(np.log(amplitudes / 7.3e-3) ** 2)
    assert least(amplitudes, values) == pytest.approx(7.3e-3, rel=1e-9)
    gaps = np.where(np.arange(12) % 4 == 1, np.nan, values)
    assert least(amplitudes, gaps) == pytest.approx(7.3e-3, rel=1e-9)
    assert is_bracketed(amplitudes, values)
    assert not is_bracketed(amplitudes, amplitudes)
    assert least(amplitudes, amplitudes) == pytest.approx(amplitudes[0])
    assert np.isnan(least(amplitudes, np.full(12, np.nan)))


def test_the_bootstrap_gives_the_standard_error_of_a_mean():
    values = np.random.default_rng(0).standard_normal(50)
    low, high = interval(resampled(50, lambda chosen: values[chosen].mean(), 2000))
    expected = 1.96 * values.std() / np.sqrt(50)
    assert (high - low) / 2 == pytest.approx(expected, rel=0.1)


def test_bags_of_several_levels_are_enough(tmp_path: Path):
    folder = tmp_path / "levels"
    arguments = ["simulate", "--out", str(folder), "--realizations", "3"]
    for amplitude in ("2e-3", "4e-3", "7e-3", "1.2e-2", "2e-2"):
        arguments += ["--level", amplitude]
    arguments += ["--set", "excitation.base_frequency_hz=0.5", "--set", "excitation.f_min_hz=0.5"]
    arguments += ["--set", "excitation.transient_periods=3", "--workers", "1"]
    assert run_command(app, arguments).exit_code == 0
    result = run_command(app, ["amplitude", str(folder)])
    assert result.exit_code == 0, result.output
    answer = float(result.output.split("Best amplitude of a line: ")[1].split()[0])
    assert 5e-3 < answer < 2.2e-2  # fewer lines share the torque here: more amplitude each
    peaks = [level.peak[1] for _, level in bag_levels(folder)]
    limit = str(0.5 * (peaks[2] + peaks[3]))
    result = run_command(app, ["amplitude", str(folder), "--torque-limit", limit])
    assert "ended at the torque or position limit" in result.output
    assert float(result.output.split("Best amplitude of a line: ")[1].split()[0]) <= 7e-3
    assert "Distortion is still falling there" in result.output
    result = run_command(app, ["amplitude", str(folder), "--torque-limit", str(peaks[0])])
    assert result.exit_code == 2
    assert "Only 1 of 5 levels keep the torque and position limits" in result.output


def test_bags_of_one_level_are_refused(tmp_path: Path):
    folder = str(tmp_path / "one")
    arguments = ["simulate", "--out", folder, "--realizations", "2", "--workers", "1"]
    assert run_command(app, arguments).exit_code == 0
    result = run_command(app, ["amplitude", folder])
    assert result.exit_code == 2
    assert "holds 1 levels, but three or more" in result.output
