"""Bags replayed into the real graph: identity, differences by independent arithmetic, Ctrl-C."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from processes import Starter, marked_processes, wait_for

from controller_node.transfer_function import TransferFunction
from fjr_bringup.campaign.batch_run import simulate_campaign
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.campaign.progress import CampaignProgress
from fjr_bringup.replay.lockstep_plan import plan_replay
from fjr_interface.bags.reader import read_record
from fjr_interface.experiment import Experiment
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation.closed_loop import simulate_law
from fjr_sim_node.simulation.simulator import SIMULATOR


def campaign(rate: float = 1000.0, base: float = 1.0, **given: dict[str, Any]) -> Campaign:
    """Return a campaign of two periods of 1/base seconds."""
    band = {"base_frequency_hz": base, "f_min_hz": base, "f_max_hz": min(40.0 * base, 0.4 * rate)}
    excitation = {**band, "realizations": 1, "periods": 1, **given.pop("excitation", {})}
    overrides = {"excitation": excitation, "controller": {}, "simulator": {}, **given}
    for values in overrides.values():
        values["sample_rate_hz"] = rate
    return Campaign.create(None, overrides)


def batch(folder: Path, what: Campaign) -> Path:
    """Simulate a campaign; return its last bag."""
    with CampaignProgress() as progress:
        return sorted(simulate_campaign(what, folder, progress=progress, workers=1))[-1]


def replayed(bag: Path, into: str, out: Path, *settings: str) -> tuple[dict[str, Any], Path]:
    """Replay a bag; return replay.json and the recorded bag."""
    from fjr_bringup.replay.lockstep import replay_into

    path, _ = replay_into(plan_replay(bag, into, settings=settings), out)
    assert path == out / "replay.json"
    return json.loads(path.read_text()), out / bag.name


def contents(bag: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in bag.iterdir()}


NOISY = {"noise_std_rad": 2e-5}


@pytest.mark.parametrize(
    ("rate", "base", "given"),
    [
        (
            100.0,
            1.0,
            {
                "simulator": {"noise_std_rad": 1e-4, "backlash.half_gap_rad": 1e-3, "k1": 0.0},
                "excitation": {"amplitudes_rad": [1e-3, 7e-3], "realizations": 2},
                "controller": {"p": 150.0, "n": 30.0},
            },
        ),
        (
            20_000.0,
            10.0,
            {"controller": {"torque_limit_nm": 5.0}, "simulator": {"noise_snr_db": 20.0}},
        ),
    ],
    ids=["100 Hz, backlash, second level and realization", "20 kHz, torque limit, noise by SNR"],
)
def test_a_bag_of_the_batch_simulation_comes_back_byte_by_byte(domain, tmp_path, rate, base, given):
    bag = batch(tmp_path / "made", campaign(rate, base, **given))
    report, again = replayed(bag, "closed-loop", tmp_path / "again")
    assert contents(again) == contents(bag)
    assert report["identical"] and report["replayed_bag"] == str(again)


def test_a_bag_of_the_graph_comes_back_byte_by_byte_and_the_command_says_so(
    domain, tmp_path, start: Starter
):
    options = ["--realizations", "1", "--periods", "1", "--transient-periods", "1"]
    for setting in ("base_frequency_hz=1.0", "f_min_hz=1.0", "f_max_hz=40.0"):
        options += ["--set", f"excitation.{setting}"]
    run = start("fjr_cli", "run", "--out", "made", "--composed", *options, cwd=tmp_path)
    assert run.exit_status() == 0, run.output
    command = ["replay", "made", "--into", "closed-loop", "--out", "again"]
    replay = start("fjr_cli", *command, cwd=tmp_path)
    assert replay.exit_status() == 0, replay.output
    (bag,) = (tmp_path / "made").glob("level_*")
    assert contents(tmp_path / "again" / bag.name) == contents(bag)
    said = [line.split()[:2] for line in replay.output.splitlines()]
    assert ["position", "yes"] in said and ["torque", "yes"] in said
    assert replay.output.splitlines()[-1] == "again/replay.json"
    before = sorted(tmp_path.rglob("*"))
    refused = start("fjr_cli", *command, cwd=tmp_path)
    assert refused.exit_status() == 2
    assert (
        refused.output == f"again/{bag.name}: exists already; choose another folder or remove it.\n"
    )
    assert [
        path for path in sorted(tmp_path.rglob("*")) if path.suffix not in (".out", ".errors")
    ] == [path for path in before if path.suffix not in (".out", ".errors")]


def test_torque_into_the_same_plant_gives_the_same_position(domain, tmp_path):
    bag = batch(tmp_path / "made", campaign(simulator={**NOISY, "delay.time_s": 1.5e-3}))
    report, again = replayed(bag, "plant", tmp_path / "again")
    assert contents(again) == contents(bag)
    position = report["signals"]["position"]
    assert position["identical"] and position["played_anew"]
    assert position["samples"] == 2000 and position["worst_sample"] is None
    assert not report["signals"]["torque"]["played_anew"]


def test_torque_into_another_plant_gives_the_position_of_that(domain, tmp_path):
    bag = batch(tmp_path / "made", campaign(simulator=dict(NOISY)))
    report, again = replayed(bag, "plant", tmp_path / "again", "simulator.k1=0.0")
    recorded, simulated = read_record(bag), read_record(again)
    nothing = TransferFunction.of([0.0], [1.0], math.inf)
    values = SIMULATOR.check({"k1": 0.0})
    seed = np.random.default_rng([1, 0, 0])
    expected = simulate_law(
        np.zeros(len(recorded.torque)),
        1000.0,
        plant.coefficients(values),
        nothing,
        NOISY["noise_std_rad"] * seed.standard_normal(len(recorded.torque)),
        effects.coefficients(values),
        command=recorded.torque,
    )
    np.testing.assert_array_equal(simulated.position, expected.position)
    np.testing.assert_array_equal(simulated.torque, recorded.torque)
    error = simulated.position - recorded.position
    said = report["signals"]["position"]
    assert not said["identical"] and not report["identical"]
    assert said["rms"] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    assert said["worst"] == np.abs(error).max() > 1e-5
    assert said["worst_sample"] == np.abs(error).argmax() + 1


def test_position_into_the_same_controller_gives_the_same_torque(domain, tmp_path):
    what = campaign(controller={"torque_limit_nm": 8.0, "d": 50.0}, simulator=dict(NOISY))
    bag = batch(tmp_path / "made", what)
    report, again = replayed(bag, "controller", tmp_path / "again")
    assert contents(again) == contents(bag)
    assert report["identical"] and report["rig"] is None
    assert [name for name, each in report["signals"].items() if each["played_anew"]] == ["torque"]


def test_position_into_another_controller_gives_the_torque_of_its_law(domain, tmp_path):
    bag = batch(tmp_path / "made", campaign(simulator=dict(NOISY)))
    (tmp_path / "made" / "campaign.yaml").unlink()  # no plant is simulated: none is needed
    report, again = replayed(bag, "controller", tmp_path / "again", "controller.p=150.0")
    record, torque = read_record(bag), read_record(again).torque
    x, a = 0.0, math.exp(-24.0 * 1e-3)
    expected = []
    for e in (record.reference - record.position).tolist():
        expected.append(150.0 * e + 60.0 * 24.0 * (e - x))
        x = a * x + (1.0 - a) * e
    np.testing.assert_allclose(torque, expected, rtol=0.0, atol=1e-12)
    said = report["signals"]["torque"]
    assert said["different"] > 1900 and said["first_different"] <= 2
    assert said["mean"] == pytest.approx(np.mean(torque - record.torque), rel=1e-9)
    assert report["parameters"]["controller"]["p"] == 150.0
    from fjr_interface.bags.reader import BagReader

    assert BagReader(again).experiment.controller["p"] == 150.0


@pytest.mark.parametrize("out", [True, False], ids=["into a folder", "beside the bag"])
def test_ctrl_c_leaves_nothing_behind(domain, mark, tmp_path, start: Starter, monkeypatch, out):
    bag = batch(tmp_path / "made", campaign(base=0.02, excitation={"f_max_hz": 10.0}))
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    before = sorted(tmp_path.rglob("*"))
    option = ["--out", str(tmp_path / "a" / "b")] if out else []
    replay = start("fjr_cli", "replay", str(bag), "--into", "closed-loop", *option)
    if out:  # in the middle of the recording, else while the nodes start
        wait_for(lambda: list(tmp_path.glob("a/b/.level_*")), "a recording under way")
    else:
        replay.wait_for_text("ROS domain")
    assert replay.interrupt() == 130
    assert "Interrupted: nothing is left of the replay." in replay.output
    assert marked_processes(mark) == []
    left = [path for path in sorted(tmp_path.rglob("*")) if path.suffix not in (".out", ".errors")]
    assert [path for path in left if path not in before] == []


def test_a_stand_in_says_what_is_wrong_with_its_bag(start: Starter, tmp_path):
    bag = batch(tmp_path / "made", campaign())
    shutil.copytree(bag, tmp_path / "half")
    mcap = tmp_path / "half" / f"{bag.name}.mcap"
    mcap.write_bytes(mcap.read_bytes()[:-500])
    for module in ("excitation", "controller", "simulator"):
        node = start.node(f"fjr_bringup.replay.{module}", bag=tmp_path / "half")
        assert node.exit_status() == 2
        assert "error: " in node.output and "the recording was cut off" in node.output
    node = start.node("fjr_bringup.replay.simulator")
    assert node.exit_status() == 2
    assert "error: The parameter bag is empty; give the folder of the bag" in node.output


def test_a_stand_in_refuses_the_experiment_of_another_bag(start: Starter, peer, tmp_path):
    from std_msgs.msg import String

    from fjr_interface.ros import runtime

    bag = batch(tmp_path / "made", campaign())
    node = start.node("fjr_bringup.replay.simulator", bag=bag)
    other = Experiment.from_json(read_text(bag), "bag").model_copy(update={"periods": 7})
    publisher = peer.node.create_publisher(String, "experiment", runtime.EXPERIMENT_QOS)
    publisher.publish(String(data=other.to_json()))
    assert node.exit_status() == 2
    assert "error: The experiment has other stamps than the bag; let the same" in node.output


def read_text(bag: Path) -> str:
    from fjr_interface.bags.metadata import read_metadata

    return (read_metadata(bag).custom_data or {})["experiment"]
