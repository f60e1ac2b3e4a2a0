from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from excitation_node import multisine
from excitation_node.shaping import Response, ShapingGoal, flatness_db, next_amplitudes
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.bench import batch_bench, graph_bench
from fjr_bringup.design.measured import simulate_level
from fjr_bringup.design.shape import lines_rms, shape
from fjr_cli.app import app
from fjr_interface.parameter_file import load_parameter_file
from fjr_kit.errors import InputError

run_command = CliRunner().invoke


def campaign(**excitation):
    small = {"amplitudes_rad": (5e-3,), "realizations": 4, "periods": 2, "f_min_hz": 1.0}
    return Campaign.create(None, {"excitation": small | excitation})


def test_one_full_step_makes_a_linear_response_as_desired():
    gain = np.geomspace(0.1, 10.0, 20)
    amplitudes = np.full(20, 0.01)
    desired = np.linspace(1.0, 2.0, 20)
    goal = ShapingGoal(torque_rms_nm=0.1, damping=1.0)
    found = next_amplitudes(Response(amplitudes, gain * amplitudes, 1.0, 1.0), goal, desired)
    torque = found * gain
    assert flatness_db(torque, desired) < 1e-12
    assert np.sqrt(np.sum(torque**2) / 2) == pytest.approx(0.1, rel=1e-12)


def test_a_damped_step_goes_that_part_of_the_way_in_db():
    gain = np.geomspace(0.1, 10.0, 20)
    before = np.full(20, 0.01)
    goal = ShapingGoal(torque_rms_nm=0.02, damping=0.5)
    after = next_amplitudes(Response(before, gain * before, 1.0, 1.0), goal)
    assert flatness_db(after * gain) == pytest.approx(0.5 * flatness_db(before * gain))


@pytest.mark.parametrize(
    ("limits", "factor"),
    [({"torque_limit_nm": 20.0}, 20.0 / 40.0), ({"position_limit_rad": 0.5}, 0.5 / 1.0)],
)
def test_limits_scale_the_signal_back(limits, factor):
    line = np.full(5, 0.01)
    response = Response(line, np.full(5, 2.0), 40.0, 1.0)
    goal = ShapingGoal(float(np.sqrt(np.sum(response.torque_nm**2) / 2)), damping=1.0, **limits)
    np.testing.assert_allclose(next_amplitudes(response, goal), 0.95 * factor * line)


def test_a_line_without_response_does_not_get_any_amplitude():
    response = Response(np.full(3, 0.01), np.array([1.0, 1.0, 1e-12]), 1.0, 1.0)
    step = next_amplitudes(response, ShapingGoal(1.0, damping=1.0)) / 0.01
    assert step.max() <= 100.0 * (1 + 1e-9)


def test_the_loop_ends_within_tolerance_and_limits_on_the_nonlinear_rig():
    passes = shape(campaign(), batch_bench, tolerance_db=0.3, torque_limit_nm=300.0)
    assert passes[0].flatness_db > 3.0
    assert passes[-1].flatness_db <= 0.3
    assert passes[-1].response.torque_peak_nm <= 300.0
    assert len(passes) <= 8
    excitation = passes[-1].campaign.values["excitation"]
    assert excitation["soft_start_s"] == 5.0
    assert np.sqrt(np.mean(np.square(excitation["line_shape"]))) == pytest.approx(1.0)


@pytest.mark.parametrize("transient_periods", [1, 2])
def test_the_loop_has_settled_in_every_pass(transient_periods):
    said: list[str] = []
    passes = shape(campaign(transient_periods=transient_periods), batch_bench, say=said.append)
    assert len(said) == len(passes) > 2
    assert not [sentence for sentence in said if "transient" in sentence]


def test_without_limits_the_torque_rms_is_kept():
    passes = shape(campaign(), batch_bench, tolerance_db=0.3)
    ratio = lines_rms(passes[-1].response) / lines_rms(passes[0].response)
    assert ratio == pytest.approx(1.0, abs=0.02)


def test_the_loop_that_does_not_reach_its_goal_says_so():
    with pytest.raises(InputError, match=r"After 1 iterations .* raise the tolerance"):
        shape(campaign(), batch_bench, tolerance_db=1e-6, iterations=1)
    with pytest.raises(InputError, match="transient_periods to 1 or more"):
        shape(campaign(transient_periods=0), batch_bench)


def test_soft_start_rises_within_the_discarded_periods_only():
    plain = campaign().experiment(0, 0)
    soft = campaign(soft_start_s=4.0).experiment(0, 0)
    reference, rising = multisine.reference(plain), multisine.reference(soft)
    rise = int(4.0 * plain.sample_rate_hz)
    np.testing.assert_array_equal(rising[rise:], reference[rise:])
    assert np.abs(rising[:10]).max() < 1e-4 * np.abs(reference).max()
    np.testing.assert_allclose(rising[rise // 2 - 1], 0.5 * reference[rise // 2 - 1])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"line_shape": (1.0, 2.0)}, r"line_shape has 2 numbers, but the grid excites \d+ lines"),
        ({"line_shape": (0.0,)}, "line_shape must be greater than zero"),
        ({"soft_start_s": 10.1}, "must end within the discarded periods"),
    ],
)
def test_bad_shapes_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        campaign(**values)


def test_the_file_that_fjr_shape_writes_is_played_by_simulate(tmp_path: Path):
    arguments = ["shape", "--out", str(tmp_path / "shaped"), "--level", "5e-3"]
    arguments += ["--realizations", "3", "--set", "excitation.f_min_hz=2.0"]
    arguments += ["--set", "excitation.base_frequency_hz=0.5"]
    arguments += ["--set", "excitation.transient_periods=5"]
    result = run_command(app, arguments)
    assert result.exit_code == 0, result.output
    file = tmp_path / "shaped" / "excitation.yaml"
    assert result.output.splitlines()[-1] == str(file)
    assert {"spectra.png", "spectra.pdf"} <= {p.name for p in file.parent.iterdir()}
    assert len(load_parameter_file(file)["excitation"]["line_shape"]) > 10
    level = simulate_level(Campaign.create(file))
    torque = np.mean([np.abs(one.torque[level.lines.excited]) for one in level.spectra], axis=0)
    assert flatness_db(torque) < 1.0


def test_the_graph_and_the_batch_measure_the_same_response(domain: int, tmp_path: Path):
    one = campaign(
        base_frequency_hz=1.0, realizations=2, periods=1, transient_periods=1, soft_start_s=0.5
    )
    batch, graph = batch_bench(one, "x"), graph_bench(tmp_path)(one, "x")
    for ours, theirs in zip(batch.spectra, graph.spectra, strict=True):
        np.testing.assert_array_equal(ours.torque, theirs.torque)
