"""What is written is there as a whole or not at all, whoever else writes and however it ends."""

from __future__ import annotations

import multiprocessing
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fjr_kit.atomic import new_folder, result_folder, whole_file, write_whole
from fjr_kit.errors import InputError

KILLED = """
import os, signal, sys
from pathlib import Path
from fjr_kit.atomic import {kind}
with {kind}(Path(sys.argv[1]){more}) as path:
    {write}
    os.kill(os.getpid(), signal.SIGKILL)
"""


def killed_while_writing(place: Path, kind: str, more: str = "") -> None:
    """Have a process killed in the middle of writing `place`."""
    write = 'path.write_text("half")' if kind == "whole_file" else '(path / "a").write_text("half")'
    text = KILLED.format(kind=kind, more=more, write=write)
    ended = subprocess.run([sys.executable, "-c", text, place], check=False)
    assert ended.returncode == -signal.SIGKILL


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_replaced_as_a_whole(tmp_path: Path):
    place = tmp_path / "file.txt"
    write_whole(place, "first")
    write_whole(place, "second \N{GREEK SMALL LETTER SIGMA}")
    assert place.read_text(encoding="utf-8").startswith("second")
    with pytest.raises(ZeroDivisionError), whole_file(place) as path:
        path.write_text("half")
        _ = 1 / 0
    assert place.read_text(encoding="utf-8").startswith("second")
    assert names(tmp_path) == ["file.txt"]


def test_what_a_killed_process_left_is_cleared_away_by_the_next(tmp_path: Path):
    place = tmp_path / "file.txt"
    place.write_text("before")
    killed_while_writing(place, "whole_file")
    assert place.read_text() == "before" and len(names(tmp_path)) == 2
    write_whole(place, b"after")
    assert place.read_bytes() == b"after" and names(tmp_path) == ["file.txt"]


@pytest.mark.parametrize("kind", ["new_folder", "result_folder"])
def test_a_folder_that_a_killed_process_began_is_begun_again(tmp_path: Path, kind: str):
    place = tmp_path / "below" / "out"
    killed_while_writing(place, kind, "" if kind == "new_folder" else ", ()")
    assert not place.exists()
    with new_folder(place) if kind == "new_folder" else result_folder(place, ()) as folder:
        assert not names(folder)
        (folder / "b").write_text("whole")
    assert names(place) == ["b"] and names(place.parent) == ["out"]


def test_results_replace_those_of_an_earlier_run_and_nothing_else(tmp_path: Path):
    out = tmp_path / "out"
    for name in ("figures/old.png", "report.html", "notes.txt"):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text("old")
    with result_folder(out, ("report.html", "figures/*.png")) as folder:
        (folder / "report.html").write_text("new")
        assert (out / "report.html").read_text() == "old"
    assert names(out) == ["figures", "notes.txt", "report.html"]
    assert (out / "report.html").read_text() == "new" and not names(out / "figures")


def test_a_new_folder_replaces_nothing_and_is_written_by_one_only(tmp_path: Path):
    place = tmp_path / "out"
    with (
        new_folder(place),
        pytest.raises(InputError, match="out: is being written by another process"),
        new_folder(place),
    ):
        pass
    with pytest.raises(InputError, match="out: exists already; choose another"), new_folder(place):
        pass
    assert names(tmp_path) == ["out"]


def test_a_place_that_cannot_be_written_is_one_sentence(tmp_path: Path):
    with pytest.raises(InputError, match=r"absent/file: cannot be written: No such file"):
        write_whole(tmp_path / "absent" / "file", "")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"out: cannot be made \(.*\); choose a folder"):
        new_folder(tmp_path / "file" / "out").__enter__()
    with (
        pytest.raises(InputError, match="file: is a file; name a folder"),
        result_folder(tmp_path / "file", ()),
    ):
        pass


def _write_often(place: Path, letter: str) -> None:
    for _ in range(50):
        write_whole(place, letter * 100_000)


def test_writers_of_one_file_wait_for_each_other(tmp_path: Path):
    """Two processes, and two threads of one of them, take turns: no file is a mixture."""
    place = tmp_path / "file"
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=_write_often, args=(place, "p"))
    threads = [threading.Thread(target=_write_often, args=(place, x)) for x in "ab"]
    process.start()
    for thread in threads:
        thread.start()
    seen = set()
    while process.is_alive() or any(thread.is_alive() for thread in threads):
        if place.exists():
            text = place.read_text()
            assert len(text) == 100_000
            seen |= set(text)
            assert len(set(text)) == 1
    process.join()
    assert process.exitcode == 0 and seen <= set("abp")
    assert names(tmp_path) == ["file"]


def test_ctrl_c_while_the_hidden_folder_is_cleared_away_leaves_none(tmp_path: Path, monkeypatch):
    place, rmtree = tmp_path / "result.npz", shutil.rmtree

    def pressed(folder: Path, **options: bool) -> None:
        monkeypatch.setattr(shutil, "rmtree", rmtree)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), whole_file(place) as path:
        path.write_bytes(b"all")
        monkeypatch.setattr(shutil, "rmtree", pressed)
    assert list(tmp_path.iterdir()) == [place] and place.read_bytes() == b"all"
