"""Effects switched on as a user does: parameter files, `--set`, the ROS simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from effect_rig import MODERATE, axis, named, relative_rms
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from fjr_bringup.campaign.batch_run import simulate_campaign
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.campaign.progress import CampaignProgress
from fjr_bringup.campaign.settings import parse_settings
from fjr_cli.app import app
from fjr_interface.parameter_file import load_parameter_file, save_parameter_file
from fjr_kit.errors import InputError
from fjr_sim_node import effects
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

SHORT = {
    "excitation": {
        "base_frequency_hz": 1.0, "f_min_hz": 1.0, "f_max_hz": 40.0, "realizations": 1,
        "periods": 1,
    },
}  # fmt: skip
TWO = {
    **named("backlash", half_gap_rad=0.001),
    **named("presliding_friction", motor_rad=5e-4, link_rad=5e-4),
}
DOTTED = """
/rig/simulator:
  ros__parameters:
    backlash.half_gap_rad: 0.001
    presliding_friction.motor_rad: 5e-4
    presliding_friction.link_rad: 5e-4
"""
NESTED = """
/rig/simulator:
  ros__parameters:
    backlash: {half_gap_rad: 0.001}
    presliding_friction:
      motor_rad: 5e-4
      link_rad: 5e-4
"""


def simulator_values(text: str, folder: Path) -> dict:
    file = folder / "rig.yaml"
    file.write_text(text)
    return SIMULATOR.check(load_parameter_file(file)["simulator"])


def test_dotted_and_nested_names_in_a_parameter_file_are_the_same(tmp_path):
    values = simulator_values(DOTTED, tmp_path)
    assert values == simulator_values(NESTED, tmp_path) == SIMULATOR.check(TWO)
    assert np.array_equal(effects.coefficients(values), effects.coefficients(TWO))


@pytest.mark.parametrize("text", [
    DOTTED + "    backlash.half_gap_rad: 0.002\n", DOTTED.replace(".half_gap_rad", ".halfgap_rad"),
    NESTED.replace("0.001", "-0.001"), NESTED.replace("{half_gap_rad: 0.001}", "0.001"),
], ids=["twice", "misspelt", "negative", "no parameter"])  # fmt: skip
def test_a_bad_effect_in_a_parameter_file_is_one_sentence(text, tmp_path):
    with pytest.raises(InputError, match="backlash") as caught:
        simulator_values(text, tmp_path)
    assert str(caught.value).endswith((".", "?"))
    assert "\n" not in str(caught.value)


@given(st.data())
def test_every_effect_survives_saving_and_loading(tmp_path_factory, data):
    values = {}
    for effect in effects.CATALOGUE:
        for name, parameter in zip(effect.names, effect.parameters, strict=True):
            values[name] = data.draw(st.floats(parameter.low, parameter.high, allow_nan=False))
    file = tmp_path_factory.mktemp("saved") / "rig.yaml"
    save_parameter_file(file, {"simulator": values}, {"simulator": SIMULATOR})
    assert load_parameter_file(file)["simulator"] == values


def test_set_switches_effects_on():
    overrides = parse_settings(
        [f"simulator.{name}={value}" for name, value in TWO.items()]
        + ["simulator.torque_saturation.limit_nm=.inf"]
    )
    values = Campaign.create(None, overrides).values["simulator"]
    assert np.array_equal(effects.coefficients(values), effects.coefficients(TWO))


def test_fjr_simulate_rehearses_a_rig_with_backlash(tmp_path):
    options = ["--out", str(tmp_path / "rig"), "--realizations", "1", "--periods", "1"]
    short = [f"--set=excitation.{k}={v}" for k, v in SHORT["excitation"].items() if "hz" in k]
    switch = ["--set", "simulator.backlash.half_gap_rad=0.001"]
    result = CliRunner().invoke(app, ["simulate", *options, *short, *switch])
    assert result.exit_code == 0, result.output
    recorded = load_parameter_file(tmp_path / "rig" / "campaign.yaml")["simulator"]
    assert recorded["backlash.half_gap_rad"] == 0.001
    bad = CliRunner().invoke(app, ["simulate", "--set", "simulator.backlash.half_gap_rad=2.0"])
    assert bad.exit_code != 0 and "must lie in [0, 1] rad" in bad.output


def test_every_effect_reaches_a_realization_by_its_names():
    later = experiment()
    for identifier, values in MODERATE.items():
        rigid = axis(identifier)
        bare = run_realization(SIMULATOR.check(rigid), later)
        if identifier == "torque_saturation":
            values = {"limit_nm": 5.0}
        on = SIMULATOR.check(named(identifier, **values) | rigid)
        assert relative_rms(run_realization(on, later).torque, bare.torque) > 1e-5, identifier


def experiment():
    overrides = {"excitation": {**SHORT["excitation"], "realizations": 3}}
    return Campaign.create(None, overrides).experiment(0, 2)


def mcaps(folder: Path) -> list[bytes]:
    return [file.read_bytes() for file in sorted(folder.glob("level_*/*.mcap"))]


@pytest.mark.parametrize(
    "on",
    [TWO, {**named("delay", time_s=7e-4), **named("nonstationary", friction_per_s=0.05)}],
    ids=["backlash, presliding", "delay, drift"],
)
def test_graph_and_batch_with_two_effects_give_the_same_bytes(domain, tmp_path, on):
    from fjr_bringup.graph.graph_run import run_campaign

    given = {"excitation": {**SHORT["excitation"], "realizations": 2}}
    what = Campaign.create(None, {**given, "simulator": on})
    with CampaignProgress() as progress:
        simulate_campaign(what, tmp_path / "batch", progress=progress, workers=1)
        run_campaign(what, tmp_path / "graph", progress=progress)
        bare = Campaign.create(None, given)
        simulate_campaign(bare, tmp_path / "bare", progress=progress, workers=1)
    batch = mcaps(tmp_path / "batch")
    assert len(batch) == 2
    assert mcaps(tmp_path / "graph") == batch
    assert not set(mcaps(tmp_path / "bare")) & set(batch)


@pytest.mark.parametrize("text", [DOTTED, NESTED, None], ids=["dotted", "nested", "-p"])
def test_the_ros_simulator_takes_effects_and_describes_them(domain, tmp_path, start, peer, text):
    from rcl_interfaces.srv import DescribeParameters, GetParameters

    names = [*TWO, "torque_saturation.limit_nm", "encoder_quantization.resolution_rad"]
    if text is None:
        start.node("fjr_sim_node", **TWO)
    else:
        (tmp_path / "rig.yaml").write_text(text)
        start("fjr_sim_node", "--ros-args", "--params-file", str(tmp_path / "rig.yaml"))
    request = GetParameters.Request(names=names)
    answer = peer.call(GetParameters, "/rig/simulator/get_parameters", request)
    given = [value.double_value for value in answer.values]
    assert given == [*TWO.values(), np.inf, 0.0]
    request = DescribeParameters.Request(names=names)
    answer = peer.call(DescribeParameters, "/rig/simulator/describe_parameters", request)
    for name, descriptor in zip(names, answer.descriptors, strict=True):
        described = SIMULATOR[name]
        assert f"[{described.unit}]" in descriptor.description
        bounds = descriptor.floating_point_range[0]
        assert (bounds.from_value, bounds.to_value) == (described.low, described.high)


def test_the_ros_simulator_refuses_a_bad_effect_in_one_sentence(domain, start):
    node = start.node("fjr_sim_node", **{"backlash.half_gap_rad": -0.001})
    assert node.exit_status() == 2
    assert "backlash.half_gap_rad must lie in [0, 1] rad" in node.output
    misspelt = start.node("fjr_sim_node", **{"backlash.gap_rad": 0.001})
    assert misspelt.exit_status() == 2
    assert "did you mean backlash.half_gap_rad?" in misspelt.output
