"""A process from which tests fork programs: what these import of others is there already.

Most of the processor time of a node's start goes into numpy and numba. The nursery has imported
them, and nothing of this project, nor rclpy, which begins threads; a program that it forks is
otherwise as one that `python -m` starts: in a session of its own, with its own arguments, folder,
environment, streams and exit status. Where the environment differs in more than what programs read
when they run, as in PYTHONPATH, `python -m` it is. Nodes that a campaign or a launch file starts
always are.

This file is also the program of the nursery itself; the end of its tests ends it.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import os
import re
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

MARK = "FJR_TEST"
"""Environment variable that tells the processes of a test from all others."""

_NOBODY = "0" * 32  # as long as each mark
_READ_AT_RUN_TIME = re.compile(
    r"(FJR|ROS|FASTDDS|FASTRTPS|PYTEST)_\w+|XDG_\w+_HOME|COLUMNS|TMPDIR|_"
)
_ALONE = {"OPENBLAS_NUM_THREADS": "1"}
"""Environment in which no library here begins threads: a fork would have none of them, and could
wait for ever for a lock that one of them held."""
_OF_OTHERS = (
    *("scipy.linalg", "scipy.signal"),  # numba imports the former for its first kernel
    *("typer", "rich.progress", "pydantic", "yaml", "rosbags.rosbag2"),
)


class Forked:
    """A program that the nursery forked, seen as a subprocess.Popen.

    Attributes:
        args: its command line.
        pid: its process.
        returncode: its exit status, None as long as it is not known.
    """

    def __init__(self, nursery: Nursery, pid: int, *command: str) -> None:
        self._nursery = nursery
        self.args, self.pid = list(command), pid
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return its exit status, None while it runs."""
        if self.returncode is None:
            self.returncode = self._nursery.ask("poll", self.pid)
        return self.returncode

    def wait(self) -> int:
        """Wait for its end; return its exit status."""
        while (status := self.poll()) is None:
            time.sleep(0.01)
        return status

    def send_signal(self, number: int) -> None:
        """Send it a signal unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)


class Nursery:
    """Starts the process that forks, and asks it for programs and their exit status."""

    def __init__(self) -> None:
        ours, theirs = socket.socketpair()
        self._environment = {**os.environ, MARK: _NOBODY}
        self._lock = threading.Lock()
        self._process = subprocess.Popen(
            [sys.executable, __file__, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env={**self._environment, **_ALONE},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )
        theirs.close()
        self._connection = Connection(ours.detach())

    def ask(self, *question: Any) -> Any:
        """Return the answer of the nursery's process."""
        with self._lock:
            self._connection.send(question)
            return self._connection.recv()

    def fits(self) -> bool:
        """Return whether the environment is one that a program finds in the nursery, too."""
        differing = {item[0] for item in os.environ.items() ^ self._environment.items()}
        return all(_READ_AT_RUN_TIME.fullmatch(name) for name in differing)

    def fork(self, module: str, *arguments: str, cwd: Path | None, out: Path, errors: Path) -> Any:
        """Run `python -m module arguments` with its streams in files; return the process."""
        folder = str(cwd or Path.cwd())
        what = (module, arguments, folder, dict(os.environ), str(out), str(errors))
        return Forked(self, self.ask("fork", what), module, *arguments)

    def end(self) -> None:
        """End the nursery's process."""
        self._connection.close()
        self._process.wait()


def _load() -> None:
    """Import what programs of this project import of others."""
    for module in _OF_OTHERS:
        with contextlib.suppress(ImportError):  # a program that needs it says so itself
            importlib.import_module(module)
    from numba.core.registry import cpu_target

    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()
    assert len(list(Path("/proc/self/task").iterdir())) == 1, (
        "a process of several threads must not fork"
    )
    gc.collect()
    gc.freeze()  # a collection in a fork would copy the pages of all that is here


def _serve(connection: Connection) -> Any:
    """Answer the tests; return in each fork what it is to run, and None at the end of the tests.

    What runs then still, of tests that were killed, is ended.
    """
    running = set()
    while True:
        try:
            verb, what = connection.recv()
        except EOFError:
            for pid in running:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(pid, signal.SIGKILL)
            return None
        if verb == "poll":
            pid, status = os.waitpid(what, os.WNOHANG)
            running.discard(pid)
            connection.send(os.waitstatus_to_exitcode(status) if pid else None)
        elif pid := os.fork():
            running.add(pid)
        else:
            return what


def _become(
    module: str, arguments: list[str], cwd: str, environment: dict[str, str], out: str, errors: str
) -> None:
    """Make this process the one that `python -m` would start."""
    os.setsid()
    os.chdir(cwd)
    for path, stream in ((out, 1), (errors, 2)):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
        os.dup2(file, stream)
        os.close(file)
    os.environ.clear()
    os.environ.update(environment)
    _show(environment[MARK])
    sys.path[0] = cwd
    sys.argv = [module, *arguments]


def _show(mark: str) -> None:
    """Write the mark of the test where /proc shows with what environment a process began."""
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    start, end = int(fields[47]), int(fields[48])
    at = ctypes.string_at(start, end - start).index(f"{MARK}={_NOBODY}".encode())
    ctypes.memmove(start + at + len(MARK) + 1, mark.encode(), len(_NOBODY))


if __name__ == "__main__":
    _load()
    with Connection(int(sys.argv[1])) as tests:
        if program := _serve(tests):
            try:
                _become(*program)
            finally:
                tests.send(os.getpid())
    if program:
        runpy.run_module(program[0], run_name="__main__", alter_sys=True)
