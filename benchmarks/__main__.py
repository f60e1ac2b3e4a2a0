"""`python -m benchmarks`: run every benchmark, one after the other, in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPTS = (
    "batch_simulation",
    "plant_accuracy",
    "periodicity",
    "stationarity",
    "bag_reading",
    "analysis",
    "parametric_fit",
    "diagnosis",
    "waiting",
    "ros_graph",
)


def main() -> int:
    """Run all; the exit status is the number of benchmarks that failed."""
    here = Path(__file__).parent
    failed = 0
    for name in SCRIPTS:
        print(f"\n## {name}\n", flush=True)
        command = [sys.executable, str(here / f"{name}.py"), *sys.argv[1:]]
        failed += subprocess.run(command).returncode != 0
    return failed


if __name__ == "__main__":
    sys.exit(main())
