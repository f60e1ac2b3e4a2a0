"""Files and folders that are written as a whole or not at all.

What is being written lies in a hidden folder `.NAME.partial` beside its place and is renamed to its
place when it is complete. Its writer holds a lock of the kernel's on that folder, which is free
again when its process has ended, however that happened: so two processes never write the same place
at once, and what a killed one left behind is cleared away by the next that writes there.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputError


class Partial:
    """The hidden folder of one place: empty when it is claimed, gone when it is cleared away.

    Attributes:
        place: where the file or folder will lie.
        path: where it is to be written meanwhile; nothing is there yet.
    """

    def __init__(self, place: Path, within: Path | None = None, *, wait: bool = False) -> None:
        """Claim the hidden folder.

        Args:
            place: where the file or folder will lie.
            within: the folder in which to hide; that of `place` if not given.
            wait: whether to wait for another writer of this place instead of refusing.

        Raises:
            InputError: another process writes there.
            OSError: the hidden folder cannot be made or cleared.
        """
        name = place.resolve().name
        self.place = place
        self._hidden = (within or place.parent) / f".{name}.partial"
        self.path = self._hidden / name
        self._lock = self._claim(fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _claim(self, kind: int) -> int:
        """Return the file descriptor that holds the lock of the hidden folder, made and emptied."""
        while True:
            with suppress(FileExistsError):
                self._hidden.mkdir()
            try:
                lock = os.open(self._hidden, os.O_RDONLY | os.O_DIRECTORY)
            except FileNotFoundError:  # the writer before us has just cleared it away
                continue
            try:
                fcntl.flock(lock, kind)
                if self._holds(lock):
                    self._empty()
                    return lock
            except BlockingIOError:
                os.close(lock)
                raise InputError(
                    f"{self.place}: is being written by another process; wait for it or choose "
                    "another folder."
                ) from None
            except BaseException:
                os.close(lock)
                raise
            os.close(lock)

    def _holds(self, lock: int) -> bool:
        try:
            return os.fstat(lock).st_ino == self._hidden.stat().st_ino
        except FileNotFoundError:
            return False

    def _empty(self) -> None:
        for leftover in self._hidden.iterdir():
            if leftover.is_dir() and not leftover.is_symlink():
                shutil.rmtree(leftover)
            else:
                leftover.unlink()

    def publish(self) -> None:
        """Move what was written to its place."""
        self.path.replace(self.place)

    def clear_away(self) -> None:
        """Remove the hidden folder with what is left in it, also if Ctrl-C comes meanwhile."""
        try:
            shutil.rmtree(self._hidden, ignore_errors=True)
        except BaseException:
            shutil.rmtree(self._hidden, ignore_errors=True)
            raise
        finally:
            os.close(self._lock)


@contextmanager
def whole_file(place: Path) -> Iterator[Path]:
    """Yield where to write a file that comes to `place`, or replaces it, if the body succeeds.

    Raises:
        InputError: it cannot be written.
    """
    try:
        partial = Partial(place, wait=True)
        try:
            yield partial.path
            partial.publish()
        finally:
            partial.clear_away()
    except OSError as error:
        raise InputError(f"{place}: cannot be written: {error.strerror or error}.") from None


def write_whole(place: Path, content: str | bytes) -> None:
    """Write a file, text in UTF-8, as a whole or not at all.

    Raises:
        InputError: it cannot be written.
    """
    with whole_file(place) as path:
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def refuse_existing(place: Path) -> None:
    """Raise InputError if a place where something new is to come is taken."""
    if place.exists() or place.is_symlink():
        raise InputError(f"{place}: exists already; choose another folder or remove it.")


def new_partial(place: Path) -> Partial:
    """Claim a place, whose parents are made, for a folder that must not exist yet.

    Raises:
        InputError: it exists, is being written, or cannot be made.
    """
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        partial = Partial(place)
    except OSError as error:
        raise InputError(
            f"{place}: cannot be made ({error.strerror}); choose a folder that can be written."
        ) from None
    try:
        refuse_existing(place)
    except InputError:
        partial.clear_away()
        raise
    return partial


@contextmanager
def new_folder(place: Path) -> Iterator[Path]:
    """Yield an empty folder that comes to `place` if the body succeeds.

    Raises:
        InputError: the place exists, is being written, or cannot be written.
    """
    partial = new_partial(place)
    try:
        partial.path.mkdir()
        yield partial.path
        partial.publish()
    except OSError as error:
        raise InputError(f"{place}: cannot be written ({error.strerror or error}).") from None
    finally:
        partial.clear_away()


@contextmanager
def result_folder(out: Path, own: Iterable[str]) -> Iterator[Path]:
    """Yield an empty folder whose files come into `out` if the body succeeds.

    It hides beside `out`, or within it where that exists: `out` may be a file system of its own.
    Other files in `out` stay.

    Args:
        out: folder of the results; made if it is absent.
        own: patterns of what an earlier run may have left in `out`, which goes.

    Raises:
        InputError: `out` is a file, is being written, or cannot be written.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file; name a folder for the results.")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        partial = Partial(out, within=out if out.exists() else None)
        try:
            partial.path.mkdir()
            yield partial.path
            _move(partial, own)
        finally:
            partial.clear_away()
    except OSError as error:
        raise InputError(
            f"{out}: cannot be written ({error.strerror or error}); name another folder for the "
            "results or make room."
        ) from None


def _move(partial: Partial, own: Iterable[str]) -> None:
    """Move all files into their place, replacing those of an earlier run."""
    folder, out = partial.path, partial.place
    if not out.exists():
        partial.publish()
        return
    new = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    stale = {path.relative_to(out) for pattern in own for path in out.glob(pattern)}
    for path in stale - set(new):
        (out / path).unlink()
    for path in new:
        (out / path).parent.mkdir(exist_ok=True)
        (folder / path).replace(out / path)
