"""One command at a time writes a folder: a lock that is taken before the work begins."""

from __future__ import annotations

import fcntl
import os
import shlex
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Hold a folder, made if it is absent, as the only command that writes it.

    The lock is one of the kernel's on the folder itself: it leaves no file, and is free again when
    its process has ended, however that happened. Folders that were made for it and are empty at the
    end go again.

    Args:
        folder: where results are about to be written.

    Raises:
        InputError: another process holds it, or it cannot be made or written.
    """
    made: list[Path] = []
    lock = -1
    try:
        lock = _claim(folder, made)
        yield
    finally:
        for each in made:
            with suppress(OSError):
                each.rmdir()
        if lock >= 0:
            os.close(lock)


def _claim(folder: Path, made: list[Path]) -> int:
    """Return the file descriptor of the locked folder; add to `made` what had to be made."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name a folder for the results.")
    lock = -1
    try:
        absent = [each for each in (folder, *folder.parents) if not each.exists()]
        made += absent
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        with tempfile.TemporaryFile(dir=folder):
            pass
        if os.fstat(lock).st_ino == folder.stat().st_ino:
            return lock
        problem = "was replaced by another process; give the command again."
    except BlockingIOError:
        made.clear()
        problem = (
            f"is being written by {_holder(os.fstat(lock).st_ino)}; wait for it or name another "
            "folder."
        )
    except OSError as error:
        problem = f"cannot be written ({error.strerror}); name another folder."
    if lock >= 0:
        os.close(lock)
    raise InputError(f"{folder}: {problem}")


def _holder(inode: int) -> str:
    """Return in a few words which process holds the lock of a folder, as far as Linux tells."""
    with suppress(OSError):
        for lock in Path("/proc/locks").read_text().splitlines():
            fields = lock.split()  # 1: FLOCK ADVISORY WRITE 4711 08:01:1234 0 EOF
            if fields[1] == "FLOCK" and fields[5].rpartition(":")[2] == str(inode):
                line = Path(f"/proc/{fields[4]}/cmdline").read_bytes().decode(errors="replace")
                words = line.rstrip("\0").split("\0")
                start = next((i for i, word in enumerate(words) if Path(word).name == "fjr"), 0)
                return f"process {fields[4]} ({shlex.join(words[start:])[:200]})"
    return "another process"
