"""`fjr export` from simulated bags: files, effects, replays, and what it refuses."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from fjr_cli.app import app
from fjr_export import Export, export
from fjr_export.joint import read_joint
from fjr_export.mjcf import mujoco_model
from fjr_export.replay import record_folder
from fjr_export.targets import MuJoCoJoint
from fjr_export.treatments import TARGETS, TREATMENTS, table
from fjr_interface.bags.writer import BagWriter
from fjr_kit.document_tables import in_step
from fjr_kit.errors import InputError
from fjr_records.records import read_records
from fjr_sim_node import effects

SETTINGS = {
    "excitation.base_frequency_hz": 1.0, "excitation.f_min_hz": 1.0, "excitation.periods": 2,
    "simulator.delay.time_s": 4e-4, "simulator.backlash.half_gap_rad": 3e-4,
    "simulator.noise_std_rad": 2e-6,
}  # fmt: skip
TWO_LEVELS = ["--level", "5e-3", "--level", "2e-2", "--realizations", "2", "--workers", "1"]


def fjr(*arguments: str | Path):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "rig"
    settings = [word for name, value in SETTINGS.items() for word in ("--set", f"{name}={value}")]
    made = fjr("simulate", "--out", folder, *TWO_LEVELS, *settings)
    assert made.exit_code == 0, made.output
    return folder


def write(folder: Path, **values: float) -> Path:
    file = folder / "joint.yaml"
    lines = [f"    {name}: {float(value)!r}" for name, value in values.items()]
    text = "\n".join(["/rig/simulator:", "  ros__parameters:", *lines]) + "\n"
    file.write_text(text.replace(": inf", ": .inf"), encoding="utf-8")
    return file


def test_a_held_link_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(InputError, match="j is infinite, a link that is held; give the inertia j"):
        read_joint(write(tmp_path, jm=0.2, j=math.inf, k0=900.0))


def test_every_target_treats_every_effect_and_the_document_says_how():
    for target in TARGETS:
        assert set(TREATMENTS[target]) == set(effects.EFFECTS)
    document = (Path(__file__).parents[2] / "docs" / "export.md").read_text(encoding="utf-8")
    assert in_step(document, {"treatments": table()}) == document, (
        "renew it: python -m fjr_export.treatments docs/export.md"
    )


def test_mujoco_plays_the_held_out_runs_of_a_campaign_as_our_simulation_does(campaign, tmp_path):
    pytest.importorskip("mujoco")
    rig = campaign / "campaign.yaml"
    done = fjr("export", rig, "--to", "mjcf", "--out", tmp_path / "o", "--replay", campaign)
    assert done.exit_code == 0, done.output
    made = Export.read(tmp_path / "o" / "export.json")
    assert [run.record[:7] for run in made.replays] == ["level_0", "level_1"]
    for run in made.replays:
        assert run.held_out and run.loop == "closed" and run.seconds == 3.0
        assert run.nrms_simulation < 0.01
        assert run.simulation_nrms_record < 0.01 and run.nrms_record < 0.015
    assert {part.effect: part.kind for part in made.effects}["backlash"] == "native"
    assert "The encoder noise of the parameter file is not exported." in made.notes
    assert "our simulation" in done.output and str(tmp_path / "o" / "joint.xml") in done.output


def test_where_the_controller_is_not_known_an_observer_holds_the_motion(campaign, tmp_path):
    pytest.importorskip("mujoco")
    for record in read_records(campaign).records:
        description = record.description.model_copy(update={"controller": None})
        with BagWriter(tmp_path / "rig" / record.name, description) as writer:
            writer.write_arrays(r=record.reference, u=record.torque, y=record.position)
    made = export(campaign / "campaign.yaml", "mjcf", tmp_path / "o", replay=tmp_path / "rig")
    assert [run.held_out for run in made.replays] == [True, True]
    assert all(run.loop == "observed" and run.nrms_simulation < 0.01 for run in made.replays)


def test_a_diagnosis_stands_for_the_bags_around_it(campaign, tmp_path):
    diagnosis = campaign / "diagnosis"
    diagnosis.mkdir()
    (diagnosis / "diagnosis.json").write_text("{}", encoding="utf-8")
    assert record_folder(diagnosis) == record_folder(diagnosis / "diagnosis.json")
    assert record_folder(diagnosis).samefile(campaign)
    alone = tmp_path / "without_bags" / "diagnosis"  # beside tmp_path lie the bags of other tests
    alone.mkdir(parents=True)
    (alone / "diagnosis.json").write_text("{}", encoding="utf-8")
    said = fjr("export", campaign / "campaign.yaml", "--to", "mjcf", "--out", tmp_path / "o",
               "--replay", alone)  # fmt: skip
    assert said.exit_code == 2 and "no bags stand around this diagnosis" in said.output
    (diagnosis / "diagnosis.json").unlink()
    diagnosis.rmdir()


def test_python_control_is_linear_about_the_replayed_motion(campaign, tmp_path):
    pytest.importorskip("control")
    bag = campaign / "level_1_realization_000"
    rig = campaign / "campaign.yaml"
    without = fjr("export", rig, "--to", "control", "--out", tmp_path / "o")
    assert without.exit_code == 2 and "Coulomb friction, k1, backlash can only" in without.output
    made = export(rig, "control", tmp_path / "o", replay=bag)
    assert 0.0 < made.replays[0].nrms_simulation < 0.6
    assert "stiffness_nm_rad = " in made.notes[0]


def test_the_urdf_has_the_values_and_its_interfaces(tmp_path):
    file = write(tmp_path, jm=0.2, j=0.3, fv=4.0, fvm=2.0, fs=5.0, fsm=6.0, k1=0.0,
                 **{"torque_saturation.limit_nm": 30.0})  # fmt: skip
    made = export(file, "urdf", tmp_path / "o")
    robot = ET.parse(tmp_path / "o" / made.file).getroot()
    dynamics, limit = (robot.find(f"joint/{name}").attrib for name in ("dynamics", "limit"))
    assert dynamics == {"damping": "6", "friction": "11"} and limit["effort"] == "30"
    assert robot.find("link[@name='link']/inertial/inertia").get("izz") == "0.5"
    control = robot.find("ros2_control/joint")
    assert [part.get("name") for part in control.findall("state_interface")] == [
        "position", "velocity", "effort",
    ]  # fmt: skip
    assert control.find("command_interface").get("name") == "effort"
    kinds = {part.effect: part.kind for part in made.effects}
    assert kinds["k0"] == "equivalent" and kinds["torque_saturation"] == "native"


def test_a_rigid_axis_is_exact_in_a_urdf_that_mujoco_plays(campaign, tmp_path):
    pytest.importorskip("mujoco")
    rigid = tmp_path / "rigid"
    said = fjr("simulate", "--out", rigid, "--level", "5e-3", "--realizations", "2", "--workers",
               "1", "--periods", "1", "--set", "excitation.base_frequency_hz=1.0", "--set",
               "excitation.f_min_hz=1.0", "--set", "simulator.k0=.inf")  # fmt: skip
    assert said.exit_code == 0, said.output
    for target in ("urdf", "mjcf"):
        made = export(rigid / "campaign.yaml", target, tmp_path / target, replay=rigid)
        assert made.replays[0].nrms_simulation < 0.01
        assert "k0" not in {part.effect for part in made.effects}


def test_what_a_target_cannot_express_is_refused_by_name_or_left_out(tmp_path):
    file = write(tmp_path, **{"kinematic_error.amplitude_rad": 1e-3, "dead_band.width_nm": 0.1})
    said = fjr("export", file, "--to", "mjcf", "--out", tmp_path / "o")
    assert said.exit_code == 2 and not (tmp_path / "o").exists()
    assert "cannot express kinematic_error: a tendon is linear in the angles; dead_band" in (
        said.output
    )
    assert "Give --without kinematic_error,dead_band to export the rest." in said.output
    left = fjr("export", file, "--to", "mjcf", "--out", tmp_path / "o", "--without",
               "kinematic_error,dead_band")  # fmt: skip
    assert left.exit_code == 0 and "kinematic_error: left out (as asked)" in left.output
    kinds = json.loads((tmp_path / "o" / "export.json").read_text("utf-8"))["effects"]
    assert {"effect": "dead_band", "kind": "left_out", "how": "as asked"} in kinds


def test_bad_input_is_one_sentence(tmp_path):
    file = write(tmp_path, jm=0.2)
    for arguments, sentence in (
        ([tmp_path / "none.yaml"], "cannot be read"),
        ([file, "--without", "backlsh"], "There is no effect 'backlsh'; did you mean backlash?"),
        ([file, "--replay", tmp_path / "none"], "none"),
    ):
        said = fjr("export", *arguments, "--to", "mjcf", "--out", tmp_path / "o")
        assert said.exit_code == 2 and sentence in said.output
        assert "Traceback" not in said.output
    (tmp_path / "other.yaml").write_text("/rig/controller:\n  ros__parameters:\n    p: 1.0\n")
    said = fjr("export", tmp_path / "other.yaml", "--to", "mjcf")
    assert said.exit_code == 2 and "/rig/simulator is missing" in said.output


def test_a_rigid_joint_has_all_inertia_in_one_body(tmp_path):
    joint = read_joint(write(tmp_path, jm=0.2, j=0.3, k0=math.inf))
    assert joint.one_body and joint.body["jm"] == pytest.approx(0.5)


def test_what_must_play_and_is_not_installed_is_said(campaign, tmp_path, monkeypatch):
    rig = campaign / "campaign.yaml"
    monkeypatch.setitem(sys.modules, "mujoco", None)
    said = fjr("export", rig, "--to", "mjcf", "--out", tmp_path / "o", "--replay", campaign)
    assert said.exit_code == 2 and "install fjr-rig[export]." in said.output
    assert not (tmp_path / "o").exists()
    assert fjr("export", rig, "--to", "mjcf", "--out", tmp_path / "o").exit_code == 0
    assert "give --replay" in Export.read(tmp_path / "o" / "export.json").notes[-1]


def test_a_simulation_that_diverges_in_the_target_is_said_and_leaves_no_log(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    joint = read_joint(write(tmp_path, jm=0.2))
    target = MuJoCoJoint.of_mjcf(mujoco_model(joint))
    target.begin(0.0, 0.0)
    target.hold(1e9)
    target.hold(float("inf"))
    assert math.isnan(target.position())
    assert [file.name for file in tmp_path.iterdir()] == ["joint.yaml"]
