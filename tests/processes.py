"""Processes that tests start, and waits that follow what these do instead of the clock."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from nursery import MARK, Forked, Nursery

IDLE_S = 90.0
"""How long a test waits for processes that neither compute nor wait for a processor."""

COMPUTING_S = 300.0
"""How much processor time they may use meanwhile. Both bounds only end a test that hangs."""

INTERRUPTED = (130, -signal.SIGINT)
"""A shell shows 130 for both: `python -m` ends by the signal itself if it came within an exec()."""


def marked_processes(mark: str) -> list[int]:
    """Return the processes, other than this one, that were started with FJR_TEST=mark."""
    entry = f"{MARK}={mark}".encode()
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes().split(b"\0")
            dead = (folder / "stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            continue
        if entry in environment and not dead and int(folder.name) != os.getpid():
            found.append(int(folder.name))
    return found


def node_pid(mark: str, module: str) -> int | None:
    """Return the process of this test that runs `python -m module`."""
    for pid in marked_processes(mark):
        try:
            if module.encode() in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                return pid
        except OSError:
            continue
    return None


def schedule(process: int | str) -> dict[str, tuple[float, float]]:
    """Return for each thread how long it has computed and waited for a processor, in s."""
    found = {}
    for file in Path(f"/proc/{process}/task").glob("*/schedstat"):
        try:
            computed, waited, _ = map(int, file.read_text().split())
        except (OSError, ValueError):  # it has ended, or the kernel doesn't count
            continue
        found[file.parent.name] = (computed * 1e-9, waited * 1e-9)
    return found


class Patience:
    """Counts what a wait has cost: time in which nothing was under way, and processor time.

    Time in which this process or those of the test want a processor and get none belongs to
    whatever else the machine does, and costs nothing.

    Attributes:
        idle_s: time without anything under way.
        computed_s: processor time of the test's processes.
    """

    def __init__(self) -> None:
        self.idle_s = self.computed_s = 0.0
        self._own, self._others = schedule("self"), self._schedules()
        self._looked = time.monotonic()

    def look(self) -> None:
        """Count what has passed since the last look."""
        passed = time.monotonic() - self._looked
        if passed < 1.0:
            return
        own, others = schedule("self"), self._schedules()
        waited = _sum(own, self._own)[1]
        computed, starved = _sum(others, self._others)
        self.idle_s += max(0.0, passed - waited - computed - starved)
        self.computed_s += computed
        self._own, self._others, self._looked = own, others, self._looked + passed

    @property
    def at_end(self) -> bool:
        """Whether the wait is in vain."""
        return self.idle_s > IDLE_S or self.computed_s > COMPUTING_S

    @staticmethod
    def _schedules() -> dict[str, tuple[float, float]]:
        found: dict[str, tuple[float, float]] = {}
        for pid in marked_processes(os.environ[MARK]):
            found |= schedule(pid)
        return found


def _sum(now: Mapping[str, Any], before: Mapping[str, Any]) -> tuple[float, float]:
    """Return how long the threads have computed and waited in sum since a look before."""
    pairs = [(times, before.get(thread, (0.0, 0.0))) for thread, times in now.items()]
    return sum(a[0] - b[0] for a, b in pairs), sum(a[1] - b[1] for a, b in pairs)


def wait_for(true: Callable[[], Any], what: str, pause_s: float = 0.02) -> Any:
    """Wait until a call returns something true and return that; fail with `what` otherwise."""
    patience = Patience()
    while not patience.at_end:
        if result := true():
            return result
        time.sleep(pause_s)
        patience.look()
    raise AssertionError(f"waited in vain for {what}")


def exit_status(process: subprocess.Popen[Any] | Forked) -> int:
    """Wait for the end of a process; return its status."""
    wait_for(lambda: process.poll() is not None, f"the end of {process.args}")
    return process.returncode


def completed(*command: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; return its status and what it printed."""
    with TemporaryFile() as out, TemporaryFile() as error:
        streams = {"stdin": subprocess.DEVNULL, "stdout": out, "stderr": error}
        with subprocess.Popen(command, **streams, **options) as process:
            try:
                status = exit_status(process)
            finally:
                process.kill()
        said = []
        for file in (out, error):
            file.seek(0)
            said.append(file.read().decode(errors="replace"))
    return subprocess.CompletedProcess(command, status, *said)


class Started:
    """A process of a test in a session of its own, with its output in a file."""

    def __init__(
        self,
        nursery: Nursery,
        folder: Path,
        *command: str,
        cwd: Path | None = None,
        errors_apart: bool = False,
    ) -> None:
        number = len(list(folder.glob("*.out")))
        self._out = folder / f"{number}.out"
        self._errors = folder / f"{number}.errors"
        self._out.touch()
        self._errors.touch()
        errors_to = self._errors if errors_apart else self._out
        start = nursery.fork if nursery.fits() else _begin
        self.process = start(*command, cwd=cwd, out=self._out, errors=errors_to)

    @property
    def output(self) -> str:
        """What it printed, together with its errors unless these are apart."""
        return self._out.read_text(errors="replace")

    @property
    def errors(self) -> str:
        """What it printed as errors, where these are apart."""
        return self._errors.read_text(errors="replace")

    def wait_for(self, true: Callable[[], Any], what: str) -> None:
        """Wait until a call returns something true; fail if the process ends without it."""
        ended = object()
        seen = wait_for(
            lambda: true() or (ended if self.process.poll() is not None else None), what
        )
        if seen is ended:
            assert true(), f"it ended without {what}: {self.output}{self.errors}"

    def wait_for_text(self, text: str) -> None:
        self.wait_for(lambda: text in self.output + self.errors, repr(text))

    def exit_status(self) -> int:
        """Wait for the end; no process ends with a traceback."""
        status = exit_status(self.process)
        assert "Traceback" not in self.output + self.errors, self.output + self.errors
        return status

    def interrupt(self, number: int = signal.SIGINT) -> int:
        """Send a signal to this process alone, Ctrl-C unless told; return the exit status."""
        self.process.send_signal(number)
        return self.exit_status()

    def press_ctrl_c(self) -> int:
        """Press Ctrl-C, which reaches its children too; return the exit status."""
        os.killpg(self.process.pid, signal.SIGINT)
        return self.exit_status()


def _begin(*command: str, cwd: Path | None, out: Path, errors: Path) -> subprocess.Popen[bytes]:
    with out.open("ab") as file, errors.open("ab") as other:
        return subprocess.Popen(
            [sys.executable, "-m", *command],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=other,
            cwd=cwd,
            start_new_session=True,
        )


class Starter:
    """Starts programs as a person does, and ends what is left of them."""

    def __init__(self, nursery: Nursery, folder: Path) -> None:
        self._nursery, self._folder = nursery, folder
        self._started: list[Started] = []

    def __call__(self, module: str, *arguments: str, **options: Any) -> Started:
        """Run `python -m module arguments`."""
        self._started.append(Started(self._nursery, self._folder, module, *arguments, **options))
        return self._started[-1]

    def node(self, module: str, *, namespace: str | None = None, **parameters: Any) -> Started:
        """Run a node with `-p name:=value`, in a namespace if one is given."""
        arguments: list[str] = ["--ros-args", *(["-r", f"__ns:={namespace}"] if namespace else [])]
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={value}"]
        return self(module, *arguments)

    def end(self) -> None:
        for started in self._started:
            if started.process.poll() is None:
                started.process.kill()
            started.process.wait()
