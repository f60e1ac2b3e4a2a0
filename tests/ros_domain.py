"""For tests of the ROS graph: a domain of their own, node processes, a node that joins."""

from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PATIENCE_S = 90.0
"""How long a test waits before it fails; nothing is concluded from how long something took."""

DOMAINS = range(1, 77)
"""Below the domains that campaigns choose themselves."""


@contextmanager
def own_domain() -> Iterator[int]:
    """Hold a ROS domain that no other test of this machine uses, also not one of another job."""
    for domain in random.sample(DOMAINS, len(DOMAINS)):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock:
            try:
                lock.bind(f"\0fjr-rig-tests/ros-domain-{domain}")
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError("every ROS domain is taken by other tests")


def wait_for(true: Callable[[], Any], what: str, pause_s: float = 0.02) -> Any:
    """Wait until a call returns something true and return that; fail with `what` otherwise."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        if result := true():
            return result
        time.sleep(pause_s)
    raise AssertionError(f"waited in vain for {what}")


def marked_processes(mark: str) -> list[int]:
    """Return the processes, other than this one, that were started with FJR_TEST=mark."""
    entry = f"FJR_TEST={mark}".encode()
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


class Started:
    """A process of a test, with its output in a file."""

    def __init__(self, folder: Path, *command: str, cwd: Path | None = None) -> None:
        number = len(list(folder.glob("*.out")))
        self._out = folder / f"{number}.out"
        with self._out.open("wb") as out:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *command],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                cwd=cwd,
            )

    @property
    def output(self) -> str:
        return self._out.read_text(errors="replace")

    def wait_for_text(self, text: str) -> None:
        wait_for(lambda: text in self.output, f"{text!r} in {self.output}")

    def exit_status(self) -> int:
        """Wait for the end; no process ends with a traceback."""
        status = self.process.wait(PATIENCE_S)
        assert "Traceback" not in self.output, self.output
        return status

    def interrupt(self) -> int:
        """Press Ctrl-C; return the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.exit_status()


class Starter:
    """Starts nodes as a person does, and ends what is left of them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._started: list[Started] = []

    def __call__(self, module: str, *arguments: str, cwd: Path | None = None) -> Started:
        """Run `python -m module arguments`."""
        self._started.append(Started(self._folder, module, *arguments, cwd=cwd))
        return self._started[-1]

    def node(self, module: str, **parameters: Any) -> Started:
        """Run a node with `-p name:=value`."""
        arguments: list[str] = ["--ros-args"]
        for name, value in parameters.items():
            arguments += ["-p", f"{name}:={value}"]
        return self(module, *arguments)

    def end(self) -> None:
        for started in self._started:
            if started.process.poll() is None:
                started.process.kill()
            started.process.wait(PATIENCE_S)


class Peer:
    """A node in the test's own process that stands for other programs in the graph."""

    def __init__(self, domain: int) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        import fjr_interface.ros  # noqa: F401 keeps discovery on this machine

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("peer", namespace="/rig", context=self.context)
        self._heard: list[tuple[Any, list[Any]]] = []
        self.after_each_look: Callable[[], None] = lambda: None
        self._clients = rclpy.create_node("peer_clients", namespace="/rig", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self._clients)

    def listen(self, message_type: type, topic: str, qos: Any) -> list[Any]:
        """Return the list into which all messages of a topic will go."""
        heard: list[Any] = []
        subscription = self.node.create_subscription(message_type, topic, heard.append, qos)
        self._heard.append((subscription, heard))
        return heard

    def spin_until(self, true: Callable[[], Any], what: str) -> Any:
        """Take part in the graph until a call returns something true; return that."""
        from fjr_interface.ros import take_all

        def spin() -> Any:
            self._executor.spin_once(timeout_sec=0.01)
            for subscription, heard in self._heard:
                heard.extend(take_all(subscription))  # an executor would lag behind the lockstep
            self.after_each_look()
            return true()

        return wait_for(spin, what, pause_s=0.0)

    def call(self, service_type: type, name: str, request: Any) -> Any:
        """Call a service and return its answer; ask again where discovery lost the answer."""
        client = self._clients.create_client(service_type, name)
        self.spin_until(client.service_is_ready, f"the service {name}")
        asked: list[tuple[float, Any]] = []

        def answer() -> Any:
            if not asked or time.monotonic() > asked[-1][0] + 5.0:
                asked.append((time.monotonic(), client.call_async(request)))
            return next((future for _, future in asked if future.done()), None)

        return self.spin_until(answer, f"an answer of {name}").result()

    def leave(self) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        self._clients.destroy_node()
        self.context.try_shutdown()
