"""`fjr simulate --record` and `--controller`: bags of records, and of loops of any linear law."""

from __future__ import annotations

import numpy as np
import pytest

from controller_node.law import law_as_run, law_of
from fjr_records.records import read_records
from gap_diagnosis.model.controller_check import check_law
from gap_diagnosis.model.record_loop import explained

SHORT = ["--realizations", "2", "--workers", "1"]
CASCADE = (
    "kind: p_pi\nk_position: 12\nk_velocity: 40\nintegral_time_s: 0.4\ntorque_limit_nm: 20\n"
    "velocity_filter_rad_s: 900\nfeed_forward: {velocity: 1.5}\n"
)


@pytest.mark.parametrize("kind", ["chirp", "noise", "trapezoid", "steps"])
def test_records_of_each_kind_come_with_their_controller(tmp_path, run, kind):
    file = tmp_path / "law.yaml"
    file.write_text(CASCADE)
    done = run(
        "simulate", "--record", kind, "--duration", 3, "--controller", file, *SHORT,
        "--level", 0.02, "--level", 0.05, "--out", tmp_path / "bags",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    records = read_records(tmp_path / "bags").records
    assert len(records) == 4 and all(each.samples == 3000 for each in records)
    assert (tmp_path / "bags" / "rig.yaml").exists()
    for each in records:
        law = law_of(each.controller, 1000.0)
        signals = each.reference, each.position, each.torque
        assert not law.one_degree and check_law(law, *signals).passed
        # Whoever thinks that the law is one from r - y to u is told that it is not.
        one = {**each.controller["position"], "kind": "transfer_function"}
        other = law_of({**one, "torque_limit_nm": 20.0}, 1000.0)
        assert not check_law(other, *signals).passed


def test_a_law_that_runs_faster_than_its_record_is_played_as_it_runs(tmp_path, run):
    file = tmp_path / "law.yaml"
    file.write_text("{kind: pd, p: 2000, d: 60, derivative_on: measurement, rate_hz: 2000}")
    nodes = ("excitation", "controller", "simulator")
    slow = [text for node in nodes for text in ("--set", f"{node}.sample_rate_hz=200")]
    slow += ["--controller", str(file), *SHORT]
    done = run(
        "simulate", "--record", "chirp", "--duration", 5, *slow, "--out", tmp_path / "bags",
        "--set", "excitation.f_max_hz=10", "--level", 0.1,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (first, _) = read_records(tmp_path / "bags").records
    assert explained(law_as_run(first.controller, 200.0), first) > 0.99
    assert explained(law_of(first.controller, 200.0), first) < 0.9
    done = run("simulate", *slow, "--out", tmp_path / "multisine")
    assert done.exit_code == 2 and "controller.rate_hz is above the 200 Hz" in done.output
    assert not (tmp_path / "multisine").exists()


def test_a_multisine_with_a_cascade_and_a_reference_from_a_file(tmp_path, run):
    law, reference = tmp_path / "law.yaml", tmp_path / "r.txt"
    law.write_text(CASCADE)
    signal = 0.05 * np.sin(np.arange(1500) / 100.0)
    np.savetxt(reference, signal)
    done = run(
        "simulate", "--controller", law, *SHORT, "--periods", 1, "--out", tmp_path / "multisine",
        "--set", "excitation.base_frequency_hz=1", "--set", "excitation.f_min_hz=1",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (first, _) = read_records(tmp_path / "multisine").records
    assert first.description.kind == "multisine"
    assert first.controller["kind"] == "two_degrees_of_freedom"
    done = run("simulate", "--record", reference, *SHORT, "--out", tmp_path / "played")
    assert done.exit_code == 0, done.output
    played = read_records(tmp_path / "played").records
    assert [each.description.repeat_of for each in played] == [None, 0]
    assert np.array_equal(played[0].reference, signal)
    assert played[0].controller["kind"] == "pd_filtered"


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--record", "flute"], "no such file; kinds are chirp, noise"),
        (["--record", "chirp", "--periods", "2"], "A record has no periods"),
        (["--duration", "3"], "give --record too"),
        (["--record", "chirp", "--set", "record.f_max_hz=3"], "f_max_hz"),
        (["--record", "chirp", "--set", "record.sweep=wide"], "sweep must be one of"),
        (["--record", "chirp", "--duration", "-1"], "duration_s must lie in"),
        (["--controller", "unknown.yaml"], "p is unknown"),
        (["--controller", "unstable.yaml"], "pole of magnitude 2"),
    ],
)
def test_what_cannot_be_played_is_refused_and_nothing_is_written(tmp_path, run, options, says):
    (tmp_path / "unknown.yaml").write_text("kind: pd\np: unknown\n")
    unstable = "kind: transfer_function\nnumerator: [1]\ndenominator: [1, -2]\n"
    (tmp_path / "unstable.yaml").write_text(unstable)
    named = [tmp_path / each if each.endswith(".yaml") else each for each in options]
    done = run("simulate", *named, *SHORT, "--out", tmp_path / "bags")
    assert done.exit_code == 2 and says in " ".join(done.output.split()), done.output
    assert not (tmp_path / "bags").exists()
