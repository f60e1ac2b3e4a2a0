"""How long does `fjr diagnose` take, how many runs does it play, and in which stage?

Run `python benchmarks/diagnosis.py`: the paper's rig with a backlash, once as steady periods and
once as records from start to end, by default settings. The measure of each is one play of all its
runs by the nominal model: what a fit needs at the least for one step of one parameter.
"""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from machine import describe

import gap_diagnosis.model.record_rig as record_rig
from fjr_bringup import Campaign, simulate_campaign
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import investigate, read_any
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.steady_runs import steady_runs

RIG = {
    "excitation": {"amplitudes_rad": [2e-3, 7e-3], "realizations": 4, "periods": 2, "seed": 3},
    "simulator": {"noise_std_rad": 1e-5, "backlash.half_gap_rad": 1e-3, "k0": 1570.0},
}
STAGES = {
    "screened": r"screened|^refit|windows|gates",
    "effects fitted": r"\(\d+ of \d+\)|further",
    "tests": r"^tests|scatter|stand in",
    "judgement": r"judgement",
}


class Meter:
    """Time and played runs of each stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = dict.fromkeys(STAGES, 0.0)
        self.played: dict[str, int] = dict.fromkeys(STAGES, 0)
        self.stage, self._since = next(iter(STAGES)), time.perf_counter()

    def begin(self, what: str) -> None:
        """Take what a diagnosis says of its progress."""
        now = time.perf_counter()
        self.seconds[self.stage] += now - self._since
        self._since = now
        found = (name for name, words in STAGES.items() if re.search(words, what))
        self.stage = next(found, self.stage)

    def counted(self, run: Callable[..., list[np.ndarray]]) -> Callable[..., list[np.ndarray]]:
        """Return what plays jobs, counting them."""

        def play(job: Callable[[Any], np.ndarray], jobs: Sequence[Any]) -> list[np.ndarray]:
            self.played[self.stage] += len(jobs)
            return run(job, jobs)

        return play


def one_play(recorded: Any, nominal: Any) -> float:
    """Return the time of one play of all runs by the nominal model, the best of three."""
    model = Model.nominal(nominal)
    runs = steady_runs(recorded) if hasattr(recorded, "realizations") else recorded
    evidence, every = Evidence(runs, nominal), range(len(runs.records))
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        evidence.simulator.run([model], list(every))
        times.append(time.perf_counter() - begin)
    return min(times)


def main() -> None:
    """Measure and print."""
    print(describe() + "\n")
    run = record_rig.run_parallel
    with tempfile.TemporaryDirectory() as folder:
        bags = Path(folder) / "bags"
        simulate_campaign(Campaign.create(overrides=RIG), bags, workers=1)
        nominal = read_nominal("paper")
        for as_record in (False, True):
            recorded = read_any(bags, as_record=as_record)
            once = one_play(recorded, nominal)
            meter = Meter()
            record_rig.run_parallel = meter.counted(run)
            diagnosis = investigate(recorded, nominal, progress=meter.begin).diagnosis
            record_rig.run_parallel = run
            meter.begin("")
            said = "; ".join(" or ".join(names) for names in diagnosis.equivalent) or "nothing"
            whole = sum(meter.seconds.values())
            print(f"{'records' if as_record else 'steady periods'}: {diagnosis.verdict}, {said}")
            print("| stage | s | runs played | times one play of all runs |\n|---|---|---|---|")
            for name, seconds in [*meter.seconds.items(), ("whole", whole)]:
                played = meter.played.get(name, sum(meter.played.values()))
                print(f"| {name} | {seconds:.1f} | {played} | {seconds / once:.0f} |")
            print()


if __name__ == "__main__":
    main()
