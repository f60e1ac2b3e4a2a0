"""The blind check from end to end: real processes, real seals, real bags."""

import json
import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fjr_cli.app import app
from fjr_kit.errors import InputError
from fjr_validation.blind import check as blind_check
from fjr_validation.blind.check import BlindCheck, split
from fjr_validation.blind.frozen import FROZEN, frozen_digest
from fjr_validation.blind.json_lines import JsonLines
from fjr_validation.blind.methods import METHODS, verdict
from fjr_validation.blind.report import score_check, score_together
from fjr_validation.blind.score import Scores
from fjr_validation.blind.seal import Secret, decrypt, encrypt, opened_line, sealed_line

SEED, CASES = 523, {"closed": 2}
"""A seed whose first cases are short records at low rates, so that they are soon made."""


@pytest.fixture(scope="module")
def state(tmp_path_factory):
    before = os.environ.get("XDG_STATE_HOME")
    folder = tmp_path_factory.mktemp("state")
    os.environ["XDG_STATE_HOME"] = str(folder)
    yield folder
    if before is None:
        del os.environ["XDG_STATE_HOME"]
    else:
        os.environ["XDG_STATE_HOME"] = before


def begun(tmp_path: Path, cases: dict[str, int] | None = None) -> BlindCheck:
    return BlindCheck.begin(tmp_path / "blind", cases or CASES, SEED, ["refit"])


def fill(check: BlindCheck, names: list[str], methods: Sequence[str] = ("refit",)) -> None:
    """Write sealed answers and verdicts of cases as a run would, without any simulation."""
    key = Secret.load(check.manifest.check).key
    truth = {
        "kind": "none", "causes": [], "weak": [], "laws": [], "plant": {"k0": "inf"},
        "nominal": {}, "settings": {}, "noise_rad": 0.0, "scatter": 0.0, "remainder": 0.0,
        "excitation": "multisine", "controller_known": True, "facts": {},
    }  # fmt: skip
    for name in names:
        answer = {**truth, "world": name.split("_")[0]}
        JsonLines(check.folder / "sealed.jsonl").append(sealed_line(name, answer, key))
        diagnosis = {"verdict": "parameters_only", "effects": [], "confidence": 0.9}
        line = {"case": name, "seconds": 1.0, "diagnosis": diagnosis}
        lines = [{**line, "method": method} for method in methods]
        JsonLines(check.folder / "verdicts.jsonl").append(*lines)


def test_lines_survive_a_kill_in_the_middle_of_one(tmp_path):
    lines = JsonLines(tmp_path / "raw.jsonl")
    assert lines.read() == []
    lines.append({"case": 1}, {"case": 2})
    with lines.path.open("ab") as file:
        file.write(b'{"case": 3, "verd')
    assert lines.read() == [{"case": 1}, {"case": 2}]
    lines.append({"case": 4})
    assert lines.read() == [{"case": 1}, {"case": 2}, {"case": 4}]
    assert lines.path.read_bytes().count(b"\n") == 3


def test_a_damaged_line_is_named(tmp_path):
    (tmp_path / "raw.jsonl").write_text('{"case": 1}\nnonsense\n{"case": 2}\n')
    with pytest.raises(InputError, match="line 2"):
        JsonLines(tmp_path / "raw.jsonl").read()


def test_cases_are_split_among_worlds_and_mixed(state, tmp_path):
    assert split(10, ["closed", "open", "records"]) == {"closed": 4, "open": 3, "records": 3}
    check = begun(tmp_path, split(30, ["closed", "open", "records"]))
    assert len({case.name for case in check.cases}) == 30
    assert {case.world for case in check.cases[:3]} == {"closed", "open", "records"}


def test_sealing_is_undone_by_the_key_only():
    secret = Secret.draw(None)
    sealed = encrypt(b"backlash", secret.key)
    assert b"backlash" not in sealed
    assert decrypt(sealed, secret.key, "a seal") == b"backlash"
    with pytest.raises(InputError, match="a seal does not open"):
        decrypt(sealed, Secret.draw(None).key, "a seal")
    line = sealed_line("open_0001", {"kind": "none"}, secret.key)
    assert opened_line(line, secret.key) == {"case": "open_0001", "kind": "none"}
    assert line["sha256"] != sealed_line("open_0001", {"kind": "none"}, secret.key)["sha256"]
    with pytest.raises(InputError, match="open_0001 is not what was committed to"):
        opened_line({**line, "sha256": "0" * 64}, secret.key)


def test_the_key_is_kept_outside_and_for_its_owner(state, tmp_path):
    check = begun(tmp_path)
    file = state / "fjr_rig" / "blind" / f"{check.manifest.check}.json"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert "seed" not in json.loads((check.folder / "blind.json").read_text())


def test_only_cases_without_a_verdict_are_left_to_do(state, tmp_path):
    check = begun(tmp_path)
    fill(check, ["closed_0001"])
    assert [case.name for case in check.missing()] == ["closed_0000"]
    with pytest.raises(InputError, match="lacks the verdicts on 1 of 2 cases"):
        check.unseal()
    assert not check.unsealed


def test_a_finished_check_is_scored_from_its_raw_file_and_again(state, tmp_path):
    check = begun(tmp_path)
    fill(check, ["closed_0000", "closed_0001"])
    report = score_check(check)
    text = report.read_text()
    assert f"Seed {SEED}: 2 cases" in text and frozen_digest()[:16] in text
    for name in ("named", "present"):
        assert (report.parent / f"{name}.png").stat().st_size > 3000 and f"({name}.png)" in text
    scores = Scores.read(report.parent / "scores.json")
    assert scores.methods["refit"]["closed"]["nothing_named"].value == 1.0
    report.unlink()
    assert score_check(BlindCheck.open(check.folder)).read_text() == text


def test_an_unfinished_check_can_be_ended_and_says_so(state, tmp_path):
    check = begun(tmp_path)
    fill(check, ["closed_0000"])
    text = score_check(check, unfinished=True).read_text()
    assert "ended after 1 of 2 cases" in text
    with pytest.raises(InputError, match="answers are unsealed"):
        check.run()


def test_several_checks_make_one_report(state, tmp_path):
    checks = []
    for seed, names in ((203, ["closed_0000", "closed_0001"]), (204, ["closed_0000"])):
        check = BlindCheck.begin(tmp_path / str(seed), CASES, seed, ["refit"])
        fill(check, names)
        checks.append(check)
    with pytest.raises(InputError, match="203 is still sealed"):
        score_together(checks, tmp_path / "both")
    for check in checks:
        score_check(check, unfinished=True)
    folders = [str(check.folder) for check in checks]
    ran = CliRunner().invoke(app, ["blind", "score", *folders, "--out", str(tmp_path / "both")])
    assert ran.exit_code == 0, ran.output
    for wrong in (folders, [folders[0], "--out", str(tmp_path)], [*folders, "--unfinished"]):
        refused = CliRunner().invoke(app, ["blind", "score", *wrong])
        assert refused.exit_code == 2 and "--" in refused.output
    text = (tmp_path / "both" / "report.md").read_text()
    assert "3 cases of 2 checks" in text and "Seed 203: 2 cases" in text
    assert "Seed 204: 1 case," in text and "ended after 1 of 2 cases" in text
    scores = Scores.read(tmp_path / "both" / "scores.json")
    assert scores.methods["refit"]["closed"]["nothing_named"].cases == 3
    with pytest.raises(InputError, match="the same check twice"):
        score_together([checks[0], checks[0]], tmp_path / "both")


def test_checks_of_other_methods_are_scored_by_those_that_they_share(state, tmp_path):
    orders = {205: ["refit", "bic"], 206: ["fjr", "refit"], 207: ["sparse"]}
    for seed, methods in orders.items():
        check = BlindCheck.begin(tmp_path / str(seed), CASES, seed, methods)
        fill(check, ["closed_0000"], methods)
        score_check(check, unfinished=True)
    checks = {seed: BlindCheck.open(tmp_path / str(seed)) for seed in orders}
    score_together([checks[205], checks[206]], tmp_path / "both")
    scores = Scores.read(tmp_path / "both" / "scores.json")
    assert list(scores.methods) == ["refit"]
    assert scores.methods["refit"]["closed"]["nothing_named"].cases == 2
    with pytest.raises(InputError, match=r"No method is .*205 refit, bic and .*207 sparse\."):
        score_together([checks[205], checks[207]], tmp_path / "none")


def test_a_changed_verdict_is_found(state, tmp_path):
    check = begun(tmp_path)
    fill(check, ["closed_0000", "closed_0001"])
    check.unseal()
    file = check.folder / "verdicts.jsonl"
    file.write_bytes(file.read_bytes().replace(b"0.9", b"0.8"))
    with pytest.raises(InputError, match="some verdicts were changed"):
        check.unseal()


def test_another_order_and_changed_sources_are_refused(state, tmp_path, monkeypatch):
    check = begun(tmp_path)
    with pytest.raises(InputError, match="other cases or methods"):
        begun(tmp_path, {"closed": 3})
    with pytest.raises(InputError, match="another seed"):
        BlindCheck.begin(check.folder, CASES, SEED + 1, ["refit"])
    monkeypatch.setattr(blind_check, "frozen_digest", lambda: "0" * 64)
    with pytest.raises(InputError, match="has changed since this check began"):
        begun(tmp_path)


def test_what_is_frozen_exists():
    folder = Path(blind_check.__file__).parent
    assert all((folder / f"{name}.py").is_file() for name in FROZEN)


def test_a_method_that_fails_says_so(tmp_path):
    (tmp_path / "bags").mkdir()
    for method in METHODS:
        said = verdict("open_0007", tmp_path / "bags", method)
        assert said["error"].startswith("InputError") and said["case"] == "open_0007"
        assert "diagnosis" not in said


def test_a_key_that_is_lost_is_said_before_any_diagnosis(state, tmp_path):
    check = begun(tmp_path)
    (state / "fjr_rig" / "blind" / f"{check.manifest.check}.json").unlink()
    result = CliRunner().invoke(app, order(check.folder, cases=2))
    assert result.exit_code == 2 and "the key of this blind check" in result.output


def test_what_would_stop_the_report_is_said_before_any_case_is_made(state, tmp_path):
    check = begun(tmp_path)
    (check.folder / "report").write_text("in the way")
    result = CliRunner().invoke(app, order(check.folder, cases=2))
    assert result.exit_code == 2 and "where the report will go" in result.output
    assert not (check.folder / "sealed.jsonl").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["score", "{folder}"], "holds no blind check"),
        (["run", "--out", "{folder}", "--method", "guess"], "There is no method 'guess'"),
        (["run", "--out", "{full}"], "holds something else"),
    ],
)
def test_bad_input_is_one_sentence(state, tmp_path, arguments, words):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    places = {"folder": tmp_path / "none", "full": tmp_path / "full"}
    result = CliRunner().invoke(app, ["blind", *(a.format(**places) for a in arguments)])
    assert result.exit_code == 2
    assert words in result.output
    assert "Traceback" not in result.output


def order(out: Path, cases: int) -> list[str]:
    return ["blind", "run", "--out", str(out), "--cases", str(cases), "--world", "closed",
            "--seed", str(SEED), "--method", "refit"]  # fmt: skip


@pytest.mark.slow
def test_a_run_that_is_killed_goes_on_where_it_was(state, tmp_path):
    out = tmp_path / "blind"
    command = [sys.executable, "-m", "fjr_cli", *order(out, cases=2), "--workers", "1"]
    verdicts = out / "verdicts.jsonl"
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        while not verdicts.exists() and process.poll() is None:
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        process.communicate()
    before = verdicts.read_bytes()
    assert before.count(b"\n") == 1
    with verdicts.open("ab") as file:
        file.write(b'{"case": "closed_00')
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip().splitlines()[-1]) == out / "report" / "report.md"
    after = verdicts.read_bytes()
    assert after.startswith(before) and after.count(b"\n") == 2
    seen = {json.loads(line)["case"] for line in after.splitlines()}
    assert seen == {"closed_0000", "closed_0001"}
    assert not list((out / "cases").iterdir())
    answers = JsonLines(out / "answers.jsonl").read()
    assert {line["case"] for line in answers} == seen
