"""`fjr rehearse` with real node processes: GO, every fault, an external drive, Ctrl-C, refusals."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from processes import Starter, marked_processes, wait_for

from fjr_bringup.graph.domain import claimed_domain
from fjr_bringup.rehearsal.loop_progress import RehearsalProgress
from fjr_bringup.rehearsal.observer import ARRIVALS, NAMES
from fjr_bringup.rehearsal.rehearse import Graph, distance, judged
from fjr_bringup.rehearsal.request import EXTERNAL, Options, check_options
from fjr_cli.rehearse import NO_GO
from fjr_interface.bags.reader import audit
from fjr_kit.errors import InputError
from fjr_kit.stopping import Interruption
from fjr_sim_node.drive.faults import CATALOGUE, NO_TORQUE, NODE, FaultPlan
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

SHORT = {"base_frequency_hz": 2.0, "f_min_hz": 2.0}
SETTINGS = [f"--set=excitation.{name}={value}" for name, value in SHORT.items()]
BRIEF = {"encoder_dropout": ",for_s=0.3", "node_killed": ",restart_after_s=0.3"}
CALM = """
/rig/rehearsal:
  ros__parameters: {rate_error: 1.0, jitter_p99_s: 10.0, latency_p99_s: 10.0, late_share: 1.0,
    lost: 1000000, delay_margin_share: .inf, bias_db: 100.0, bias_deg: 3600.0, response: .inf}
/rig/controller:
  ros__parameters: {p: 2.0, d: 0.1, position_timeout_s: 5.0, reference_timeout_s: 5.0}
"""
"""Limits that a busy machine keeps, and a loop that no delay makes unstable."""


@pytest.fixture
def calm(tmp_path: Path) -> Path:
    file = tmp_path / "calm.yaml"
    file.write_text(CALM)
    return file


@pytest.mark.parametrize("namespace", ["/rig", "/cell/left"])
def test_an_external_drive_is_waited_for_and_ends_in_go(
    domain, mark, tmp_path, start, calm, namespace
):
    """The drive of somebody else is a simulator that somebody else starts."""
    out = tmp_path / "out"
    rehearsal = start(
        "fjr_cli", "rehearse", "--drive", "external", "--no-hardware", "--rate", "200",
        "--duration", "1.5", "--limits", str(calm), "--out", str(out), "--namespace", namespace,
        *SETTINGS,
    )  # fmt: skip
    rehearsal.wait_for_text(f"Waiting for a drive: nobody publishes {namespace}/motor_position.")
    real_time = {"mode": "realtime", "sample_rate_hz": 200.0}
    drive = start.node("fjr_sim_node", namespace=namespace, **real_time)
    assert rehearsal.exit_status() == 0, rehearsal.output
    assert "GO: all" in rehearsal.output
    assert rehearsal.output.splitlines()[-1] == str(out / "report.html")
    assert drive.interrupt() == 0
    audit(out / "level_0_realization_000")
    found = json.loads((out / "rehearsal.json").read_text())
    assert (found["verdict"], found["drive"], found["bag_damage"]) == ("GO", "external", None)
    assert found["prediction"] is None  # nobody said what plant it is
    with np.load(out / ARRIVALS) as arrivals:
        stamps = [arrivals[name]["stamp"] for name in NAMES]
    for each in stamps:
        np.testing.assert_array_equal(each, 5_000_000 * np.arange(1, 301))


def test_every_fault_ends_in_its_safe_state_and_is_found(domain, mark, tmp_path):
    """One graph plays them all; how fast a safe state is reached is for a quiet machine."""
    options = Options(
        out=tmp_path / "out", rate_hz=500.0, duration_s=1.5, overrides={"excitation": SHORT}
    )
    plan = check_options(options)
    plan.campaign.open_folder(plan.folder)
    wrong = {}
    with contextlib.ExitStack() as stack:
        progress, interruption = map(stack.enter_context, (RehearsalProgress(), Interruption()))
        here = stack.enter_context(claimed_domain())
        graph = stack.enter_context(Graph(plan, progress, interruption))
        for fault in CATALOGUE:
            what = FaultPlan.parse(
                f"{fault.identifier}:after_s=0.7{BRIEF.get(fault.identifier, '')}"
            )
            played = graph.play(what, 3, fault.identifier)
            found = judged(dataclasses.replace(plan, fault=what), played, here)
            checks = {check.name: check for check in found.checks}
            rests = bool((played.arrivals[2]["value"][-20:] == 0.0).all())
            safe = math.isfinite(checks["safe_state"].value)
            safe &= fault.safe_state != NO_TORQUE or fault.acts_on == NODE or rests
            if not safe or checks[fault.finding].passed or found.go:
                wrong[fault.identifier] = (found.ended, found.reasons, checks["safe_state"])
    assert not wrong
    wait_for(lambda: not marked_processes(mark), f"the end of {marked_processes(mark)}")


def test_ctrl_c_brings_the_torque_to_zero_and_reports_what_was_measured(
    domain, mark, tmp_path, start: Starter, calm
):
    out = tmp_path / "out"
    rehearsal = start(
        "fjr_cli", "rehearse", "--rate", "200", "--duration", "600", "--limits", str(calm),
        "--out", str(out), *SETTINGS,
    )  # fmt: skip
    log = out / ".torque.arrivals"
    rehearsal.wait_for(lambda: log.exists() and log.stat().st_size > 10_000, "torques")
    assert rehearsal.interrupt() == 130, rehearsal.output
    assert "course: Ctrl-C ended it after" in rehearsal.output
    found = json.loads((out / "rehearsal.json").read_text())
    assert found["verdict"] == "NO-GO"
    assert found["timing"]["torque"]["messages"] > 100
    assert "samples came with reference, position and torque" in found["bag_damage"]
    with np.load(out / ARRIVALS) as arrivals:
        torque = arrivals["torque"]["value"]
    assert np.abs(torque).max() > 0.0 and torque[-1] == 0.0
    assert not marked_processes(mark)


def test_distance_from_the_simulated_response():
    options = Options(out=Path("unused"), rate_hz=500.0, overrides={"excitation": SHORT})
    experiment = check_options(options).experiment
    values = SIMULATOR.check({"sample_rate_hz": 500.0})
    simulated = run_realization({**values, "delay.time_s": 1e-3}, experiment).position
    seen = np.zeros(experiment.samples, [("stamp", "<i8"), ("value", "<f8")])
    seen["stamp"], seen["value"] = experiment.stamps_ns, simulated
    assert distance(values, experiment, 1e-3, seen) == 0.0
    seen["value"] *= 1.5
    assert distance(values, experiment, 1e-3, seen[::2]) == pytest.approx(0.5)
    assert math.isnan(distance(values, experiment, 1e-3, seen[:0]))


def test_the_greatest_amplitude_is_played_for_whole_periods():
    given = {"excitation": {**SHORT, "amplitudes_rad": (1e-3, 2e-2, 7e-3)}}
    plan = check_options(Options(rate_hz=500.0, duration_s=1.8, overrides=given))
    assert plan.experiment.amplitude_rad == 2e-2
    assert (plan.experiment.samples, plan.experiment.levels) == (1000, 1)
    assert plan.nodes == ("simulator", "controller", "excitation")
    external = check_options(Options(drive=EXTERNAL, hardware=False))
    assert external.nodes == ("controller", "excitation")
    assert not external.knows_the_plant


def test_more_than_was_asked_for_is_said():
    given = {"excitation": {**SHORT, "transient_periods": 1}}
    plan = check_options(Options(rate_hz=500.0, duration_s=0.5, overrides=given))
    assert plan.longer.startswith("1 s are played instead of 0.5 s: 1 discarded and 1 kept")
    for exact in (None, 1.0):
        plan = check_options(Options(rate_hz=500.0, duration_s=exact, overrides=given))
        assert plan.longer == ""


LIMITS = """
/rig/controller:
  ros__parameters: {torque_limit_nm: 20.0, torque_rate_limit_nm_s: 1.0e3,
    position_limit_rad: 0.5, velocity_limit_rad_s: 5.0}
"""


@pytest.mark.parametrize(
    ("given", "limits", "words"),
    [
        ({"hardware": True}, LIMITS, "--hardware is for --drive external"),
        ({"drive": EXTERNAL}, LIMITS, "say --hardware, or --no-hardware"),
        ({"drive": EXTERNAL, "hardware": True}, None, "hardware run needs a limits file"),
        ({"drive": EXTERNAL, "hardware": True}, LIMITS, "confirm that with confirm"),
        (
            {"drive": EXTERNAL, "hardware": True, "confirm": "joint"},
            LIMITS.replace("torque_limit_nm: 20.0, ", ""),
            "hardware needs finite limits; give torque_limit_nm",
        ),
        ({"drive": EXTERNAL, "hardware": False, "fault": "nan"}, None, "in the simulated drive"),
        ({"fault": "earthquake"}, None, "There is no fault 'earthquake'"),
        ({}, "/rig/controller: {ros__parameters: {speed: 1.0}}", "no parameter 'speed'"),
    ],
)
def test_a_bad_request_is_refused_before_anything_starts(tmp_path, given, limits, words):
    if limits is not None:
        given = {**given, "limits": tmp_path / "limits.yaml"}
        given["limits"].write_text(limits)
    out = tmp_path / "out"
    with pytest.raises(InputError, match=words):
        check_options(Options(out=out, **given))
    assert not out.exists()


def test_a_confirmed_hardware_run_tells_the_controller(tmp_path):
    file = tmp_path / "limits.yaml"
    file.write_text(LIMITS)
    plan = check_options(Options(drive=EXTERNAL, hardware=True, confirm="joint", limits=file))
    told = plan.roles["controller"]
    assert told["hardware"] is True and told["confirm"] == "joint"
    assert told["position_limit_rad"] == 0.5
    assert plan.torque_limit_nm == 20.0
    assert "simulator" not in plan.roles


def test_a_folder_in_use_is_refused(tmp_path, start_cli):
    (tmp_path / "thing").write_text("")
    result = start_cli("rehearse", "--out", str(tmp_path))
    assert result.exit_code == 2
    assert "is not empty; name another --out folder" in result.output
    assert NO_GO not in (0, 1, 2, 130)


@pytest.fixture
def start_cli():
    from typer.testing import CliRunner

    from fjr_cli.app import app

    return lambda *arguments: CliRunner().invoke(app, list(arguments))
