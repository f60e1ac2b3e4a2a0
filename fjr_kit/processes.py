"""Node processes: started with sys.executable, watched, and always ended."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from types import TracebackType

from .errors import InputError

_PR_SET_PDEATHSIG = 1
_GRACE_S = 2.0
_LAST_LINES = 5


_LIBC = ctypes.CDLL(None)


def die_with(parent: int) -> None:
    """Ask the kernel to end this process if its parent is killed, so that no orphan is left."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it was killed before the kernel was asked
        os._exit(1)


class NodeProcess:
    """One child process with a log file of its own."""

    def __init__(self, name: str, module: str, ros_arguments: Sequence[str], log: Path) -> None:
        """Start `python -m module --ros-args ...`, its output going to `log`."""
        self.name = name
        self.log = log
        environment = {
            **os.environ,
            "PYTHONUNBUFFERED": "1",
            "RCUTILS_COLORIZED_OUTPUT": "0",
            "RCUTILS_LOGGING_USE_STDOUT": "0",
            "ROS_LOG_DIR": str(log.parent / "ros"),
        }
        with log.open("wb") as output:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, "--ros-args", *ros_arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,  # Ctrl-C in the terminal is for the parent to handle
                preexec_fn=partial(die_with, os.getpid()),
            )
        self.pid = self._process.pid

    @property
    def dead(self) -> bool:
        """Whether the process has ended."""
        return self._process.poll() is not None

    def obituary(self) -> str:
        """Return how a process that has ended did so, with its last log lines."""
        status = self._process.returncode
        cause = f"signal {signal.Signals(-status).name}" if status < 0 else f"status {status}"
        return f"The {self.name} node ended with {cause}{self.last_words()}"

    def last_words(self) -> str:
        """Return the last log lines, ready to follow a sentence, with the log's name."""
        text = self.log.read_text(errors="replace").strip()
        lines = text.splitlines()[-_LAST_LINES:]
        said = "; its last lines:\n  " + "\n  ".join(lines) if lines else " and said nothing"
        return f"{said}\n  (log: {self.log})"

    def send(self, signal_number: int) -> None:
        """Send a signal if the process still runs."""
        if self._process.poll() is None:
            self._process.send_signal(signal_number)

    def wait(self, until: float) -> bool:
        """Wait until a time.monotonic() instant; return whether the process has ended."""
        try:
            self._process.wait(max(0.0, until - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
        return True


class ProcessGroup:
    """The node processes of one graph; a context manager that ends them all on leaving."""

    def __init__(self) -> None:
        """Start with none."""
        self.processes: list[NodeProcess] = []

    def __enter__(self) -> ProcessGroup:
        """Return itself."""
        return self

    def start(self, name: str, module: str, ros_arguments: Sequence[str], log: Path) -> None:
        """Start one more node process."""
        self.processes.append(NodeProcess(name, module, ros_arguments, log))

    def dead(self) -> NodeProcess | None:
        """Return a process that has ended by itself, None if there is none."""
        return next((process for process in self.processes if process.dead), None)

    def raise_if_dead(self) -> None:
        """Raise InputError naming a node that has ended."""
        if (process := self.dead()) is not None:
            raise InputError(process.obituary())

    def kill(self, name: str) -> None:
        """Kill the named node's process, as a crash would; it no longer counts as dead."""
        process = self.named(name)
        process.send(signal.SIGKILL)
        process.wait(time.monotonic() + _GRACE_S)
        self.processes.remove(process)

    def named(self, name: str) -> NodeProcess:
        """Return the process in which the named node runs."""
        for process in self.processes:
            if name in process.name:
                return process
        raise KeyError(name)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Ask all to end; kill those that don't."""
        for signal_number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            for process in self.processes:
                process.send(signal_number)
            until = time.monotonic() + _GRACE_S
            if all([process.wait(until) for process in self.processes]):
                return
