"""A person's wait: `fjr --help`, and `fjr analyze` of the demo's bags on its first call and warm.

The peer of each is the bare interpreter, started in the same run.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import describe

FJR = [sys.executable, "-m", "fjr_cli"]


def seconds(command: list[str], **environment: str) -> float:
    """Return the wall time of a command that must succeed."""
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, **environment})
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    print(describe() + "\n")
    with tempfile.TemporaryDirectory() as folder:
        bags = Path(folder) / "bags"
        campaign = [*FJR, "simulate", "--out", str(bags), "--realizations", "7", "--periods", "2"]
        subprocess.run(campaign, check=True, capture_output=True)
        analyze = [*FJR, "analyze", str(bags), "--out", str(Path(folder) / "result")]
        caches = {name: folder for name in ("XDG_CACHE_HOME", "MPLCONFIGDIR", "NUMBA_CACHE_DIR")}
        rows = {
            "python -c pass": [seconds([sys.executable, "-c", "pass"]) for _ in range(5)],
            "fjr --help": [seconds([*FJR, "--help"]) for _ in range(5)],
            "fjr analyze, empty caches": [seconds(analyze, **caches)],
            "fjr analyze, warm": [seconds(analyze) for _ in range(5)],
        }
    bare = statistics.median(rows["python -c pass"])
    print("| what | median s | max s | times a bare interpreter |\n|---|---|---|---|")
    for name, times in rows.items():
        median = statistics.median(times)
        print(f"| {name} | {median:.2f} | {max(times):.2f} | {median / bare:.0f} |")


if __name__ == "__main__":
    main()
