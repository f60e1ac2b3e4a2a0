"""What a replay is made of and how it is judged, without ROS."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bag_tools import MS, WHOLE, experiment, foreign_bag, rig_streams, write_bag
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from fjr_bringup.replay.bag import the_bag
from fjr_bringup.replay.comparison import Difference, compare, report, write_report
from fjr_bringup.replay.lockstep_plan import plan_replay
from fjr_kit.errors import InputError

PD = pd_filtered.describe(pd_filtered.CONTROLLER.defaults())
TRANSFER = {"kind": "transfer_function", "numerator": [1.0], "denominator": [1.0]}


def bag_with(folder: Path, **changes) -> Path:
    write_bag(folder, experiment(**{"controller": PD, **changes}))
    return folder


def campaign_file(folder: Path, text: str) -> None:
    (folder / "campaign.yaml").write_text(f"/rig/simulator:\n  ros__parameters:\n    {text}\n")


def test_the_campaign_beside_the_bag_gives_the_rig_and_settings_win(tmp_path):
    bag = bag_with(tmp_path / "bag")
    campaign_file(tmp_path, "{k1: 5.0, noise_std_rad: 1e-5}")
    plan = plan_replay(bag, "closed-loop", settings=["simulator.k1=7.0", "controller.p=100.0"])
    assert plan.values["simulator"]["k1"] == 7.0
    assert plan.values["simulator"]["noise_std_rad"] == 1e-5
    assert plan.rig == str(tmp_path / "campaign.yaml")
    assert plan.values["controller"]["p"] == plan.experiment.controller["p"] == 100.0
    assert plan_replay(bag, "closed-loop", "paper").values["simulator"]["k1"] == 3000.0
    assert plan_replay(bag, "plant", "paper").experiment == experiment(controller=PD)


def test_the_rate_is_the_bags(tmp_path):
    bag = bag_with(tmp_path / "bag", sample_rate_hz=500.0)
    plan = plan_replay(bag, "closed-loop", "paper")
    assert {values["sample_rate_hz"] for values in plan.values.values()} == {500.0}
    campaign_file(tmp_path, "{sample_rate_hz: 1000.0}")
    with pytest.raises(InputError, match=r"sample_rate_hz is 1000 but the bag's is 500"):
        plan_replay(bag, "plant")


@pytest.mark.parametrize(
    ("changes", "into", "rig", "settings", "sentence"),
    [
        ({}, "plant", None, [], r"no campaign.yaml lies beside the bag; name .* --rig FILE"),
        ({}, "controller", "paper", [], "--rig names a simulated plant, but none takes part"),
        ({}, "controller", None, ["simulator.k1=0"], "no simulator node takes part"),
        ({}, "plant", "paper", ["controller.p=1"], "no controller node takes part"),
        ({}, "plant", "paper", ["excitation.seed=1"], "no excitation node takes part"),
        ({}, "plant", "paper", ["simulator.jm=-1"], "jm must lie in"),
        ({"controller": TRANSFER}, "closed-loop", "paper", [], "is a transfer_function, which"),
        ({"controller": TRANSFER}, "controller", None, [], r"cannot play; replay .* --into plant"),
        ({"controller": None}, "controller", None, [], "describes no controller; give one with"),
        (
            {"controller": None},
            "plant",
            "paper",
            ["simulator.noise_snr_db=20"],
            "noise_snr_db needs the controller",
        ),
    ],
)
def test_what_cannot_be_replayed_is_refused(tmp_path, changes, into, rig, settings, sentence):
    bag = bag_with(tmp_path / "bag", **changes)
    with pytest.raises(InputError, match=sentence):
        plan_replay(bag, into, rig, settings)


def test_a_bag_of_any_controller_can_go_into_the_plant(tmp_path):
    bag = bag_with(tmp_path / "bag", controller=TRANSFER)
    assert plan_replay(bag, "plant", "paper").experiment.controller == TRANSFER
    bare = bag_with(tmp_path / "bare", controller=None)
    plan = plan_replay(bare, "controller", settings=["controller.p=3.0"])
    assert plan.experiment.controller["p"] == 3.0


def test_a_bag_without_description_or_one_that_is_not_whole_is_refused(tmp_path):
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    undescribed = foreign_bag(tmp_path / "undescribed", streams)
    with pytest.raises(InputError, match="describes no experiment, so the nodes cannot replay it"):
        plan_replay(undescribed, "plant", "paper")
    holed = rig_streams({"r": WHOLE, "y": WHOLE, "u": WHOLE[:9] + WHOLE[10:]})
    bag = foreign_bag(tmp_path / "holed", holed, custom=experiment(controller=PD).to_json())
    with pytest.raises(InputError, match=r"motor_torque: sample 10 at 0.01 s is missing"):
        plan_replay(bag, "plant", "paper")


def test_one_bag_is_replayed(tmp_path):
    bag = bag_with(tmp_path / "campaign" / "first")
    assert the_bag(tmp_path / "campaign") == the_bag(bag) == bag
    bag_with(tmp_path / "campaign" / "second")
    with pytest.raises(InputError, match=r"holds 2 bags; name the one to replay, such as .*first"):
        the_bag(tmp_path / "campaign")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--rig", "paper"], "need --into"),
        (["--out", "x"], "need --into"),
        (["--into", "plant", "--loop"], "are for publishing"),
    ],
)
def test_options_that_exclude_each_other_are_refused(run, tmp_path, options, sentence):
    done = run("replay", tmp_path, *options)
    assert done.exit_code == 2 and sentence in done.stderr


@pytest.mark.parametrize("rate", ["0", "-1", "inf", "nan", "fast"])
def test_a_rate_is_a_factor_or_max(run, tmp_path, rate):
    done = run("replay", bag_with(tmp_path / "bag"), "--rate", rate)
    assert done.exit_code == 2
    assert done.stderr == f"--rate {rate}: give a factor greater than zero, or max.\n"


finite = st.floats(-1e3, 1e3)


@given(
    st.lists(st.tuples(finite, st.one_of(st.just(0.0), finite)), min_size=1, max_size=30),
    st.integers(1, 7),
)
def test_differences_do_not_depend_on_how_the_samples_come(pairs, size):
    before = np.array([pair[0] for pair in pairs])
    after = before + np.array([pair[1] for pair in pairs])
    stamps = np.arange(1, len(pairs) + 1) * MS
    found = Difference(unit="rad", played_anew=True)
    for at in range(0, len(pairs), size):
        part = slice(at, at + size)
        found = found.with_block(stamps[part], before[part], after[part])
    error = after - before
    different = np.flatnonzero(before.view(np.int64) != after.view(np.int64))
    assert found.samples == len(pairs)
    assert found.identical == (different.size == 0)
    assert found.first_different == (different[0] + 1 if different.size else None)
    assert found.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9, abs=1e-12)
    assert found.rms_recorded == pytest.approx(np.sqrt(np.mean(before**2)), rel=1e-9, abs=1e-12)
    assert found.mean == pytest.approx(error.mean(), rel=1e-9, abs=1e-9)
    assert found.worst == np.abs(error).max()
    if found.worst:
        assert np.abs(error)[found.worst_sample - 1] == found.worst
        assert found.worst_s == pytest.approx(found.worst_sample * 1e-3)


def test_a_zero_of_another_sign_is_another_sample():
    stamps, zero = np.array([MS, 2 * MS]), np.array([0.0, 1.0])
    found = Difference(unit="rad", played_anew=True).with_block(stamps, zero, np.array([-0.0, 1.0]))
    assert (found.different, found.first_different, found.worst) == (1, 1, 0.0)


def test_the_report_is_strict_json_and_replaced_as_a_whole(tmp_path):
    bag = bag_with(tmp_path / "bag")
    plan = plan_replay(bag, "closed-loop", "paper")
    found = compare(bag, bag, plan.into)
    for _ in range(2):
        path = write_report(tmp_path, report(plan, found, None))
    said = json.loads(path.read_text(), parse_constant=pytest.fail)
    assert said["schema"] == "fjr_rig/replay/1" and said["identical"]
    assert said["parameters"]["controller"]["torque_limit_nm"] == "Infinity"
    assert said["signals"]["torque"]["samples"] == 60
    assert said["replayed_bag"] is None and said["rig"] == "paper"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bag", "replay.json"]
    with pytest.raises(InputError, match="cannot be written"):
        write_report(tmp_path / "absent", "{}")
