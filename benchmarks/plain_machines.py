"""Does a diagnosis find what plain machines have, where their datasheet is an inertia alone?

Run `python benchmarks/plain_machines.py --kind swing --cases 12 --seed 0`, and so for the other
kinds. The machines are those of `plain_machine_kinds`, drawn at random.

Counted are what is missed, what is named but is not there, the ratio of each size to the truth
(of a swing, both over their inertia), and how many of the intervals hold it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe
from plain_machine_kinds import KINDS, SIZES, Machine

from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

ALSO = {"presliding_friction", "encoder_quantization"}  # in all of them
FALLS, BRISTLES = "stribeck_friction_motor", "lugre_friction"  # one law of both


def row(number: int, machine: Machine, found: Diagnosis, spent_s: float) -> str:
    """Return a line of the table."""
    there = {name.split(".")[0] for name, size in SIZES.items() if size in machine.truth}
    named = {e for cause in found.causes for e in (cause.effect, *cause.others)}
    if BRISTLES in named and FALLS in there:
        there.add(BRISTLES)
        named.add(FALLS)
    wrong = [c.effect for c in found.causes if not {c.effect, *c.others} & (there | ALSO)]
    unit = machine.truth["inertia"] / found.parameters["jm"].value if machine.swings else 1.0
    ratios, inside = [], []
    for name, size in {"jm": "inertia", **SIZES}.items():
        true, size_found = machine.truth.get(size), found.parameters.get(name)
        if true is None or size_found is None:
            ratios.append("-")
            continue
        ratios.append(f"{unit * size_found.value / true:.2f}")
        if not (machine.swings and name == "jm"):
            inside.append(size_found.low * unit <= true <= size_found.high * unit)
    return (
        f"| {number} | {len(machine.runs)} x {machine.runs[0].shape[1] / machine.rate_hz:.0f} s, "
        f"{machine.rate_hz:.0f} Hz | {', '.join(sorted(there - named)) or '-'} | "
        f"{', '.join(wrong) or '-'} | {' | '.join(ratios)} | {sum(inside)} of {len(inside)} | "
        f"{spent_s:.0f} |"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Plain machines beside a datasheet of inertia.")
    parser.add_argument("--kind", choices=sorted(KINDS), required=True)
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print(describe() + "\n")
    print(f"| {given.kind} | log | missed | wrong | inertia | {' | '.join(SIZES.values())} | "
          "in 95 % | CPU s |")  # fmt: skip
    print("|---" * (6 + len(SIZES) + 1) + "|", flush=True)
    for number in range(given.cases):
        rng = np.random.default_rng([given.seed, number])
        machine = KINDS[given.kind](rng)
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "machine"
            machine.recorded(case, machine.truth["inertia"] * float(rng.choice([0.9, 1.1])))
            begun = time.process_time()
            found = diagnose(case / "bags", read_nominal(case / "nominal.yaml"))
            spent = time.process_time() - begun
        print(row(number, machine, found, spent), flush=True)


if __name__ == "__main__":
    main()
