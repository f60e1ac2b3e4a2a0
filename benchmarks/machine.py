"""The machine and the versions that a benchmark ran with; every benchmark prints them first."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path

PACKAGES = ("numpy", "scipy", "numba", "rosbags", "mcap", "mujoco", "ros-jazzy-rclpy")


def processor() -> str:
    """Return the CPU model as the kernel names it."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()


def versions() -> str:
    """Return Python and the installed packages that the benchmarks use, with versions."""
    found = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:
            found.append(f"no {package}")
    return ", ".join(found)


def describe() -> str:
    """Return two lines: processor, cores and system; versions."""
    usable = len(os.sched_getaffinity(0))
    busy = os.getloadavg()[0]
    return (
        f"{processor()}, {usable} cores usable, load {busy:.1f}, {platform.system()} "
        f"{platform.machine()}\n{versions()}"
    )


if __name__ == "__main__":
    print(describe())
