"""`fjr example`: the lines of the documents that read foreign files run on its files as written."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from paths import ROOT

from fjr_cli.example import TO_TRY
from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader

DOCUMENTS = (
    "README.md",
    *(f"docs/{name}.md" for name in ("import", "ros2_control", "motor_bench")),
)
READS = ("analyze", "import", "check")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from fjr_bringup.campaign.example_files import write_example

    folder = tmp_path_factory.mktemp("files") / "example"
    write_example(folder)
    return folder


def commands(document: str) -> list[str]:
    """Return the commands of a document's code blocks, each on one line."""
    text = (ROOT / document).read_text(encoding="utf-8").replace("\\\n", " ")
    lines = (line.strip() for line in text.splitlines() if line.startswith("    fjr "))
    return [" ".join(re.sub(r"\s#\s.*", "", line).split()) for line in lines]


def lines_for(folder: Path) -> list[tuple[str, str]]:
    """Return (document, command) of those commands with --map whose files the example has."""
    found = []
    for document in DOCUMENTS:
        for line in commands(document):
            _, command, *words = shlex.split(line)
            given = [word for word in words[: _options_from(words)] if word]
            there = all(list(folder.glob(word)) for word in given)
            if command in READS and "--map" in words and given and there:
                found.append((document, line))
    return found


def _options_from(words: list[str]) -> int:
    return next((at for at, word in enumerate(words) if word.startswith("--")), len(words))


def called(run, line: str):
    """Run a command as a shell would, patterns of file names included."""
    words: list[str] = []
    for word in shlex.split(line)[1:]:
        words += sorted(map(str, Path().glob(word))) if "*" in word else [word]
    if words[0] == "analyze":
        words.append("--no-report")  # the figures are the same for every bag
    return run(*words)


def test_every_line_of_the_documents_runs_on_the_example(run, files: Path, monkeypatch):
    monkeypatch.chdir(files)
    lines = lines_for(files)
    assert {document for document, _ in lines} == set(DOCUMENTS)
    assert len(lines) >= 6
    for number, (document, line) in enumerate(lines):
        line = line.replace("--out rig", f"--out rig{number}")
        line = line.replace("--out my_rig", f"--out rig{number}")
        done = called(run, line)
        assert done.exit_code == 0, (document, line, done.output)
        for surprise in ("Taken as records", "without a reference", "does not repeat"):
            assert surprise not in done.output, (document, line, done.output)


def test_the_printed_commands_run_on_the_example(run, files: Path, monkeypatch, tmp_path: Path):
    monkeypatch.chdir(files)
    for line in TO_TRY:
        line = line.replace("--out ", f"--out {tmp_path}/").replace(
            "--record chirp", "--record chirp --realizations 1 --duration 2"
        )
        done = called(run, line)
        assert done.exit_code == 0, (line, done.output)
    assert len(find_bags(tmp_path / "rig")) == 2
    assert BagReader(find_bags(tmp_path / "imported")[0]).sample_rate_hz == 2500.0


def test_a_folder_that_exists_is_refused(run, tmp_path: Path):
    done = run("example", tmp_path)
    assert done.exit_code == 2 and f"{tmp_path}: exists already" in done.stderr
