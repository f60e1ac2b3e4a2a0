"""Every fault to rehearse, many seeds: does it end in its safe state in time, and is it found?

    python benchmarks/fault_matrix.py [seeds [fault ...]]

One graph in real time at 500 Hz plays the experiment once for each fault and seed; the seed also
shifts the onset. A row counts the runs in which the safe state was reached within its stated time,
and those in which the check that should find the fault turned the verdict to NO-GO.
"""

from __future__ import annotations

import dataclasses
import shutil
import statistics
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from machine import describe

from fjr_bringup.graph.domain import claimed_domain
from fjr_bringup.rehearsal.loop_progress import RehearsalProgress
from fjr_bringup.rehearsal.rehearse import Graph, judged
from fjr_bringup.rehearsal.request import Options, Plan, check_options
from fjr_kit.stopping import Interruption
from fjr_sim_node.drive.faults import CATALOGUE, CONTINUES, Fault, FaultPlan

EXPERIMENT = {"base_frequency_hz": 1.0, "f_min_hz": 1.0}
RATE_HZ, DURATION_S = 500.0, 4.0


def plan_in(folder: Path) -> Plan:
    """Return a rehearsal of a short experiment, in a folder that is made."""
    overrides = {"excitation": EXPERIMENT}
    plan = check_options(
        Options(out=folder, rate_hz=RATE_HZ, duration_s=DURATION_S, overrides=overrides)
    )
    plan.campaign.open_folder(plan.folder)
    return plan


@contextmanager
def running(plan: Plan) -> Iterator[tuple[Graph, Interruption]]:
    """Yield the running graph of a rehearsal, and what tells of Ctrl-C."""
    with RehearsalProgress() as progress, Interruption() as interruption, claimed_domain():
        graph = Graph(plan, progress, interruption)
        with graph:
            yield graph, interruption


def with_onset(fault: Fault, seed: int) -> FaultPlan:
    """Return a fault that begins between 1.0 and 1.5 s, by its seed."""
    return FaultPlan.parse(f"{fault.identifier}:after_s={1.0 + 0.1 * (seed % 6):.1f}")


def rehearse(graph: Graph, plan: Plan, fault: Fault, seed: int) -> tuple[bool, float, bool]:
    """Return whether the safe state was reached, its time in s, and whether the fault was found."""
    what = with_onset(fault, seed)
    name = f"{fault.identifier}_{seed}"
    played = graph.play(what, seed, name)
    found = judged(dataclasses.replace(plan, fault=what), played, 0)
    shutil.rmtree(plan.folder / name)
    checks = {check.name: check for check in found.checks}
    safe = checks["safe_state"]
    return safe.passed, safe.value, not checks[fault.finding].passed


def row(fault: Fault, runs: list[tuple[bool, float, bool]]) -> str:
    """Return one row of the table."""
    reached, times, found = zip(*runs, strict=True)
    what = "longest pause" if fault.safe_state == CONTINUES else "last torque"
    return (
        f"| {fault.identifier} | {fault.safe_state} | {sum(reached)} of {len(runs)} | {what} "
        f"{1e3 * statistics.median(times):.0f} | {1e3 * max(times):.0f} | "
        f"{1e3 * fault.within_s:.0f} | {fault.finding} | {sum(found)} of {len(runs)} |"
    )


def main(seeds: int = 20, *only: str) -> bool:
    """Print the table; return whether every run reached its safe state and was found."""
    faults = [fault for fault in CATALOGUE if not only or fault.identifier in only]
    print(describe() + "\n")
    print(f"{len(faults)} faults, {seeds} seeds each, {RATE_HZ:g} Hz; times in ms\n")
    print("| fault | safe state | reached | median | worst | within | found by | found |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    good = True
    with tempfile.TemporaryDirectory() as folder:
        plan = plan_in(Path(folder) / "matrix")
        with running(plan) as (graph, _):
            for fault in faults:
                runs = [rehearse(graph, plan, fault, seed) for seed in range(1, seeds + 1)]
                print(row(fault, runs), flush=True)
                good &= all(reached and found for reached, _, found in runs)
    return good


if __name__ == "__main__":
    sys.exit(not main(*map(int, sys.argv[1:2]), *sys.argv[2:]))
