"""The blind check from end to end: real processes, real seals, real bags."""

import json
import os
import stat
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fjr_cli.app import app
from fjr_kit.errors import InputError
from fjr_validation.blind.check import BlindCheck
from fjr_validation.blind.files import sealed_file, verdict_file
from fjr_validation.blind.methods import verdict
from fjr_validation.blind.report import score_check
from fjr_validation.blind.score import Scores
from fjr_validation.blind.seal import Secret, decrypt, digest, encrypt, salted

pytestmark = pytest.mark.slow

CASES, SEED = 2, 11


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


@pytest.fixture(scope="module")
def sealed(state, tmp_path_factory) -> BlindCheck:
    """A check whose cases are made and diagnosed, still sealed."""
    folder = tmp_path_factory.mktemp("check") / "blind"
    check = BlindCheck.begin(folder, CASES, SEED, ["refit"])
    said: list[str] = []
    check.make_cases(lambda done, total, what: said.append(f"{done}/{total} {what}"))
    assert sorted(line.split()[1] for line in said) == ["case_000", "case_001"]
    check.diagnose(workers=1)
    return check


@pytest.fixture(scope="module")
def unsealed(sealed) -> BlindCheck:
    before_unsealing(sealed)
    score_check(sealed)
    return sealed


def before_unsealing(check: BlindCheck) -> None:
    """What must hold while answers are sealed; called before any test unseals them."""
    secret = Secret.load(check.check)
    for file in check.folder.rglob("*"):
        if file.is_file() and file.suffix != ".mcap":
            data = file.read_bytes()
            assert b'"kind": "' not in data or b"pd_filtered" in data, file
            assert secret.key.hex().encode() not in data, file
    manifest = json.loads((check.folder / "blind.json").read_text())
    assert "seed" not in manifest
    assert not (check.folder / "answers.json").exists()


def test_sealing_is_undone_by_the_key_only():
    secret = Secret.draw(None)
    sealed = encrypt(b"backlash", secret.key)
    assert b"backlash" not in sealed
    assert decrypt(sealed, secret.key, "a seal") == b"backlash"
    with pytest.raises(InputError, match="a seal does not open"):
        decrypt(sealed, Secret.draw(None).key, "a seal")
    with pytest.raises(InputError, match="changed"):
        decrypt(sealed[:-1] + bytes([sealed[-1] ^ 1]), secret.key, "a seal")


def test_equal_answers_have_different_digests():
    assert digest(salted({"kind": "none"})) != digest(salted({"kind": "none"}))


def test_the_key_is_kept_outside_and_for_its_owner(state, sealed):
    file = state / "fjr_rig" / "blind" / f"{sealed.check}.json"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_seed_nobody_gave_is_drawn():
    assert Secret.draw(None).seed != Secret.draw(None).seed


def test_answers_are_what_was_committed_to(unsealed):
    committed = json.loads((unsealed.folder / "commitments.json").read_text())
    opened = json.loads((unsealed.folder / "answers.json").read_text())
    assert opened["seed"] == SEED
    assert [digest(text.encode()) for text in opened["answers"]] == list(committed.values())
    assert len(unsealed.unseal()) == CASES


def test_verdicts_carry_diagnosis_and_time(unsealed):
    for values in unsealed.read_verdicts().values():
        assert values["diagnosis"]["schema"] == "fjr_rig/diagnosis/2"
        assert values["seconds"] > 0.0


def test_the_report_shows_scores_and_figures(unsealed):
    folder = unsealed.folder / "report"
    text = (folder / "report.md").read_text()
    assert f"{CASES} cases, seed {SEED}" in text
    for name in ("accuracy", "calibration", "confusion"):
        assert (folder / f"{name}.png").stat().st_size > 5000
        assert f"({name}.png)" in text
    scores = Scores.read(folder / "scores.json").methods["refit"].scores
    assert scores["verdict_right"].cases == CASES


def test_finished_verdicts_are_kept(unsealed):
    files = [verdict_file(unsealed.folder, "refit", index) for index in range(CASES)]
    before = [file.stat().st_mtime_ns for file in files]
    again = BlindCheck.begin(unsealed.folder, CASES, SEED, ["refit"])
    again.make_cases()
    again.diagnose()
    assert [file.stat().st_mtime_ns for file in files] == before


def test_another_order_is_refused(unsealed):
    with pytest.raises(InputError, match="holds a check of 2 cases"):
        BlindCheck.begin(unsealed.folder, 3, SEED, ["refit"])


def test_a_changed_verdict_is_found(unsealed):
    file = verdict_file(unsealed.folder, "refit", 0)
    before = file.read_bytes()
    try:
        file.write_bytes(before.replace(b'"case_000"', b'"case_000" '))
        with pytest.raises(InputError, match="some were changed"):
            unsealed.unseal()
    finally:
        file.write_bytes(before)


def test_no_verdict_is_made_after_unsealing(unsealed):
    file = verdict_file(unsealed.folder, "refit", 1)
    hidden = file.rename(file.with_suffix(".away"))
    try:
        with pytest.raises(InputError, match="answers are unsealed"):
            unsealed.diagnose()
    finally:
        hidden.rename(file)


def test_a_changed_seal_is_found(unsealed, tmp_path):
    file = sealed_file(unsealed.folder, 0)
    data = bytearray(file.read_bytes())
    data[60] ^= 1
    with pytest.raises(InputError, match="case_000"):
        decrypt(bytes(data), Secret.load(unsealed.check).key, str(file))


def test_answers_stay_sealed_without_all_verdicts(state, tmp_path):
    check = BlindCheck.begin(tmp_path / "blind", 1, 3, ["refit"])
    with pytest.raises(InputError, match="finish the check"):
        check.unseal()
    assert not check.unsealed


def test_another_seed_is_refused(state, tmp_path):
    BlindCheck.begin(tmp_path / "blind", 1, 3, ["refit"])
    with pytest.raises(InputError, match="another seed"):
        BlindCheck.begin(tmp_path / "blind", 1, 4, ["refit"])


def test_a_method_that_fails_says_so(tmp_path):
    (tmp_path / "case_007").mkdir()
    said = verdict("refit", tmp_path / "case_007")
    assert said["error"].startswith("InputError")
    assert "diagnosis" not in said


ONE_FAINT = 1  # seed of a check whose only case lies below its detection limit


def test_a_check_of_one_case_below_its_detection_limit_is_scored(state, tmp_path):
    out = tmp_path / "blind"
    options = ["--cases", "1", "--seed", str(ONE_FAINT), "--method", "refit", "--workers", "1"]
    result = CliRunner().invoke(app, ["blind", "run", "--out", str(out), *options])
    assert result.exit_code == 0, result.output
    answers = BlindCheck.open(out).unseal()
    assert [e.relative < 1.0 for answer in answers for e in answer.effects] == [True]
    report = out / "report"
    assert "1 case, seed 1" in (report / "report.md").read_text()
    for name in ("accuracy", "calibration", "confusion"):
        assert (report / f"{name}.png").exists() and (report / f"{name}.pdf").exists()
    assert not list(report.glob(".*"))


def test_what_would_stop_the_report_is_said_before_any_case_is_made(state, tmp_path):
    out = tmp_path / "blind"
    BlindCheck.begin(out, 1, SEED, ["refit"])
    (out / "report").write_text("in the way")
    options = ["--cases", "1", "--seed", str(SEED), "--method", "refit"]
    result = CliRunner().invoke(app, ["blind", "run", "--out", str(out), *options])
    assert result.exit_code == 2 and "where the report will go" in result.output
    assert sorted(path.name for path in out.iterdir()) == ["blind.json", "report"]


def test_a_key_that_is_lost_is_said_before_any_diagnosis(state, tmp_path):
    out = tmp_path / "blind"
    check = BlindCheck.begin(out, 1, None, ["refit"])
    (state / "fjr_rig" / "blind" / f"{check.check}.json").unlink()
    result = CliRunner().invoke(
        app, ["blind", "run", "--out", str(out), "--cases", "1", "--method", "refit"]
    )
    assert result.exit_code == 2 and "the key of this blind check" in result.output
    assert [path.name for path in out.iterdir()] == ["blind.json"]


def test_a_seal_that_was_changed_is_found_before_any_diagnosis(unsealed, tmp_path):
    out = tmp_path / "blind"
    for name in ("blind.json", "commitments.json"):
        out.mkdir(exist_ok=True)
        (out / name).write_bytes((unsealed.folder / name).read_bytes())
    for index in range(CASES):
        other = sealed_file(unsealed.folder, 1 - index)
        sealed_file(out, index).parent.mkdir(exist_ok=True)
        sealed_file(out, index).write_bytes(other.read_bytes())
    with pytest.raises(InputError, match="case_000 is not what was committed to"):
        BlindCheck.open(out).check_seals()


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
    assert not Path(places["folder"]).exists()
