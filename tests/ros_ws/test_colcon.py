"""`ros_ws` built with colcon, as `make ws` does: what it installs runs; what is broken is told."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from processes import exit_status, wait_for
from workspace import EXPERIMENTS, PACKAGES, WORKSPACE

pytestmark = pytest.mark.slow  # most of it builds and compiles, beside the graphs of others

COLCON = Path(sys.executable).with_name("colcon")


class Workspace:
    """A build of the workspace in folders of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.install = folder / "install"

    def __call__(self, verb: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run colcon; a broken test is a status other than 0."""
        bases = ("--build-base", str(self.folder / "build"), "--install-base", str(self.install))
        command = (COLCON, "--log-base", self.folder / "log", verb, *bases, *arguments)
        # Only what is built and the environment's libraries, not this test's sources.
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        return subprocess.run(
            command, cwd=WORKSPACE, env=environment, capture_output=True, text=True
        )

    def test(self, package: str) -> subprocess.CompletedProcess[str]:
        """Run `colcon test` of one package."""
        return self("test", "--packages-select", package, "--return-code-on-test-failure")

    def start(self, package: str, log: Path, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a package's executable of the same name, as `ros2 run` would."""
        script = f'. {self.install}/setup.bash && exec {self.install}/{package}/lib/"$0" "$@"'
        with log.open("wb") as out:
            return subprocess.Popen(
                ["bash", "-c", script, f"{package}/{package}", "--ros-args", *arguments],
                stdout=out,
                stderr=subprocess.STDOUT,
                cwd=log.parent,
            )


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    workspace = Workspace(tmp_path_factory.mktemp("ws"))
    done = workspace("build")
    assert done.returncode == 0, done.stderr
    assert f"{len(PACKAGES)} packages finished" in done.stdout
    return workspace


def test_installed_nodes_play_an_experiment_of_the_paper(
    built: Workspace, domain: int, tmp_path: Path
) -> None:
    (optimum,) = (file for file in EXPERIMENTS if file.stem == "optimum")
    nodes = ("fjr_sim_node", "controller_node", "excitation_node")
    logs = {node: tmp_path / f"{node}.log" for node in nodes}
    started = [built.start(node, logs[node], "--params-file", str(optimum)) for node in nodes]
    try:
        wait_for(
            lambda: "realization 0: 0 of 50000 samples." in logs["fjr_sim_node"].read_text(),
            f"the first sample: {[log.read_text() for log in logs.values()]}",
        )
        for process in started:
            process.send_signal(signal.SIGINT)
        assert [exit_status(process) for process in started] == [0, 0, 0]
    finally:
        for process in started:
            process.kill()
            process.wait()


def test_a_whole_package_passes_and_a_broken_one_does_not(built: Workspace, domain: int) -> None:
    whole = built.test("excitation_node")
    assert whole.returncode == 0, whole.stdout + whole.stderr
    (module,) = (built.install / "fjr_interface").rglob("bags/audit.py")
    module.rename(module.with_suffix(".away"))
    broken = built.test("fjr_interface")
    module.with_suffix(".away").rename(module)
    assert broken.returncode != 0


def test_a_symlink_install_runs_from_the_sources(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    done = workspace("build", "--symlink-install", "--packages-up-to", "fjr_interface")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "build/fjr_interface/fjr_interface").samefile(
        WORKSPACE.parent / "fjr_interface"
    )
    done = workspace.test("fjr_interface")
    assert done.returncode == 0, done.stdout + done.stderr
