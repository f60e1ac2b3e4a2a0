"""How long does `fjr diagnose` take on random rigs, on all cores of this machine?

Run `python benchmarks/diagnosis_time.py --cases 12 --seed 900`: cases of the three worlds of the
blind check, drawn by that seed, diagnosed one after the other from bags to verdict. The measure
is the time that each world allows a case on two cores (8 s closed, 20 s open and records); the
processor time beside it is what `fjr blind run` states, where a case works in one thread.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe

from fjr_validation.blind.answers import WORLDS
from fjr_validation.blind.worlds import make_case
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose

ALLOWED_S = {"closed": 8.0, "open": 20.0, "records": 20.0}


def timed(folder: Path) -> tuple[float, float]:
    """Return the time and the processor time of the diagnosis of a case (s)."""
    wall, processor = time.perf_counter(), time.process_time()
    diagnose(folder, read_nominal(folder / "nominal.yaml"))
    return time.perf_counter() - wall, time.process_time() - processor


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Time diagnoses of random rigs.")
    parser.add_argument("--cases", type=int, default=12, help="of each world")
    parser.add_argument("--seed", type=int, default=900)
    parser.add_argument("--worlds", nargs="+", choices=WORLDS, default=WORLDS)
    given = parser.parse_args()
    print(describe() + "\n")
    print("| world | cases | median s | quartiles | times the allowed | processor, median s |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for world in given.worlds:
            times = []
            for number in range(given.cases + 1):
                case = Path(folder) / f"{world}_{number}"
                make_case(given.seed, number, world, case)
                times.append(timed(case))
            wall, processor = np.array(times[1:]).T  # the first one loads and compiles
            low, median, high = np.percentile(wall, [25, 50, 75])
            print(
                f"| {world} | {given.cases} | {median:.1f} | {low:.1f} to {high:.1f} | "
                f"{median / ALLOWED_S[world]:.2f} | {np.median(processor):.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
