"""How surely does the diagnosis see a drift between the periods of its bags?

Run `python benchmarks/stationarity.py`. 300 records without any gap, each of another rig (its
parameters off by up to 8 %), grid, phases and noise: 6 bags of 12 s, two kept periods each. Then 20
records of each of two drifts of all friction. Printed are quantiles of the score that the gate
'stationary over periods' holds against its limit.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from machine import describe

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

import gap_cases

from gap_diagnosis.gates.stationarity import PERIOD_Z_LIMIT, period_drift

STEADY, DRIFTING = 300, 20
DRIFTS_PER_S = (3e-5, 1e-4)


def scores(count: int, effects: dict[str, float]) -> np.ndarray:
    """Return the score of each of so many records."""
    found = []
    for seed in range(count):
        drift = period_drift(gap_cases.simulate_case(effects, seed=seed).recorded)
        assert drift is not None
        found.append(drift.z)
    return np.array(found)


def main() -> None:
    """Measure and print."""
    print(describe() + "\n")
    print(f"Scores between periods; the gate's limit is {PERIOD_Z_LIMIT}\n")
    print(f"{'':34}{'records':>8}{'least':>8}{'median':>8}{'99 %':>8}{'most':>8}{'beyond':>8}")
    cases = [("no gap", STEADY, {})]
    cases += [
        (
            f"friction drifts by {rate:g} per second",
            DRIFTING,
            {"nonstationary.friction_per_s": rate},
        )
        for rate in DRIFTS_PER_S
    ]
    for name, count, effects in cases:
        z = scores(count, effects)
        least, median, high, most = np.quantile(z, [0.0, 0.5, 0.99, 1.0])
        beyond = int(np.sum(z > PERIOD_Z_LIMIT))
        figures = "".join(f"{value:8.2f}" for value in (least, median, high, most))
        print(f"{name:34}{count:8d}{figures}{beyond:8d}", flush=True)


if __name__ == "__main__":
    main()
