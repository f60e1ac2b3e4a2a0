"""One command at a time writes a folder, and what ends a command early leaves nothing half-made."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from processes import wait_for

from fjr_kit.errors import InputError
from fjr_kit.folder_lock import locked_folder

HOLD = """
import sys
from pathlib import Path
from fjr_kit.folder_lock import locked_folder
with locked_folder(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""
FJR = [sys.executable, "-m", "fjr_cli"]
PIPES = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}


@pytest.fixture
def held(tmp_path):
    """A folder that another process holds, and that process."""
    folder = tmp_path / "deep" / "held"
    command = [sys.executable, "-c", HOLD, str(folder)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, **PIPES) as process:
        assert process.stdout.readline() == "held\n"
        yield folder, process


def test_second_process_is_told_who_writes_the_folder(held):
    folder, process = held
    with (
        pytest.raises(InputError, match=rf"held: is being written by process {process.pid} \("),
        locked_folder(folder),
    ):
        raise AssertionError("two processes hold one folder")
    process.kill()
    process.wait()
    with locked_folder(folder):
        pass


def test_folders_made_for_nothing_go_again(tmp_path):
    with locked_folder(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b").is_dir()
    assert not list(tmp_path.iterdir())
    with locked_folder(tmp_path / "a" / "b"):
        (tmp_path / "a" / "b" / "result").touch()
    assert (tmp_path / "a" / "b" / "result").exists()


def test_folder_that_cannot_be_written_is_refused_first(tmp_path):
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "below", Path("/proc/fjr")):
        with (
            pytest.raises(InputError, match=f"^{folder}: .*name a.* folder"),
            locked_folder(folder),
        ):
            raise AssertionError("nothing can be written there")


@pytest.mark.parametrize(
    "command",
    [
        ["simulate", "--out", "{}"],
        ["analyze", "{bags}", "--out", "{}"],
        ["diagnose", "{bags}", "--nominal", "paper", "--out", "{}"],
        ["paper", "--quick", "--out", "{}"],
        ["blind", "run", "--cases", "1", "--out", "{}"],
        ["shape", "--out", "{}"],
    ],
    ids=lambda words: words[0],
)
def test_command_waits_for_nobody_before_its_work(held, command, run, tmp_path):
    bags = tmp_path / "bags"
    short = ["--realizations", "1", "--periods", "1", "--set", "excitation.base_frequency_hz=1.0"]
    done = run("simulate", "--out", bags, *short, "--set", "excitation.f_min_hz=1.0")
    assert done.exit_code == 0, done.output
    refused = run(*(word.format(held[0], bags=bags) for word in command))
    assert refused.exit_code == 2
    assert f"is being written by process {held[1].pid}" in refused.output
    assert not list(held[0].iterdir())


def record(path: Path, seconds: float = 400.0) -> Path:
    """Write a long record, whose import takes a while."""
    t = np.arange(round(seconds * 500)) % 500
    r = np.cos(2 * np.pi * t / 500) + np.cos(6 * np.pi * t / 500)
    np.savez(path, r=r, u=r, y=0.9 * r)
    return path


def growing(folder: Path) -> bool:
    """Tell whether the hidden bag of an import holds a chunk of samples already."""
    return any(bag.stat().st_size > 100_000 for bag in folder.glob(".out.partial/**/*.mcap"))


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGTERM, signal.SIGINT])
def test_import_that_is_ended_leaves_nothing(tmp_path, number):
    file = record(tmp_path / "record.npz")
    out = tmp_path / "out"
    words = ["import", str(file), "--out", str(out), "--map", "reference=r,torque=u,position=y"]
    words += ["--sample-rate-hz", "500"]
    with subprocess.Popen([*FJR, *words], **PIPES) as process:
        wait_for(lambda: growing(tmp_path), "the first samples")
        process.send_signal(number)
        _, said = process.communicate()
    assert (process.returncode, said) == (130, "Interrupted: nothing was written.\n")
    assert [path.name for path in tmp_path.iterdir()] == ["record.npz"]


def test_nohup_outlives_its_terminal(tmp_path):
    file = record(tmp_path / "record.npz", 100.0)
    words = ["import", str(file), "--out", "out", "--map", "reference=r,torque=u,position=y"]
    words += ["--sample-rate-hz", "500"]
    ignoring = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)}
    with subprocess.Popen([*FJR, *words], cwd=tmp_path, **ignoring, **PIPES) as process:
        wait_for(lambda: growing(tmp_path), "the first samples")
        process.send_signal(signal.SIGHUP)
        process.communicate()
    assert process.returncode == 0 and (tmp_path / "out").is_dir()


def test_what_a_killed_import_left_is_cleared_away(tmp_path, run):
    file = record(tmp_path / "record.npz", 10.0)
    (tmp_path / ".out.partial").mkdir()
    (tmp_path / ".out.partial" / "junk").touch()
    mapped = ("--map", "reference=r,torque=u,position=y", "--sample-rate-hz", "500")
    done = run("import", file, "--out", tmp_path / "out", *mapped)
    assert done.exit_code == 0, done.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "record.npz"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["level_0_realization_000"]


@pytest.mark.parametrize("closed", ["stdout", "stderr"])
def test_output_that_nobody_reads_does_not_fail_a_command(tmp_path, closed):
    file = record(tmp_path / "record.npz", 10.0)
    words = ["import", str(file), "--out", "out", "--map", "reference=r,torque=u,position=y"]
    read, write = os.pipe()
    os.close(read)
    streams = {**PIPES, closed: write}
    with subprocess.Popen(
        [*FJR, *words, "--sample-rate-hz", "500"], cwd=tmp_path, **streams
    ) as process:
        os.close(write)
        _, error = process.communicate()
    assert process.returncode == 0, error
    assert (tmp_path / "out").is_dir() and not (error if closed == "stdout" else None)
