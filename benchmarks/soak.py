"""Long runs with faults: nothing lost, no growth of memory, no process left behind.

    python benchmarks/soak.py [minutes [realizations]]

In real time, one graph plays the experiment again and again for so many minutes, every second time
with a fault, each in its turn: without a fault nothing may be lost, with one the safe state must be
reached. In lockstep, a campaign of so many realizations is recorded while its nodes and `fjr run`
itself are killed at random; it is started again each time, and at its end every bag must have the
bytes of the batch simulation. The memory of each process is sampled; what grows steadily shows as
the growth from the second quarter of its samples to the last, in processes that lived long enough
to have been started for most of that time.
"""

from __future__ import annotations

import dataclasses
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from fault_matrix import plan_in, running, with_onset
from machine import describe

from fjr_bringup.campaign.batch_run import simulate_campaign
from fjr_bringup.campaign.plan import CAMPAIGN_FILE, Campaign
from fjr_bringup.campaign.progress import CampaignProgress
from fjr_bringup.rehearsal.rehearse import judged
from fjr_sim_node.drive.faults import CATALOGUE

MARK = f"FJR_SOAK={uuid.uuid4().hex}"
MOST_GROWTH_MB = 8.0
SEED = 1
_MOST_FAILURES = 20
RUN = (
    "--set", "excitation.base_frequency_hz=1.0", "--set", "excitation.f_min_hz=1.0",
    "--set", "simulator.noise_std_rad=1e-5", "--periods", "2",
)  # fmt: skip


class Memory:
    """Resident memory of processes, sampled by name and process number."""

    def __init__(self, fewest: int) -> None:
        """Start without samples; processes with fewer than `fewest` tell nothing."""
        self._fewest = fewest
        self.samples: dict[tuple[str, int], list[float]] = {}

    def sample(self, pids: dict[str, int]) -> None:
        """Sample the processes of these numbers."""
        for name, pid in pids.items():
            if (size := resident_mb(pid)) is not None:
                self.samples.setdefault((name, pid), []).append(size)

    def rows(self) -> Iterator[tuple[str, int, float, float, float]]:
        """Yield (name, samples, first, greatest, growth in MB) of processes that lived long."""
        for (name, _), sizes in self.samples.items():
            if len(sizes) >= self._fewest:
                quarters = np.array_split(np.array(sizes), 4)
                growth = float(np.median(quarters[3]) - np.median(quarters[1]))
                yield name, len(sizes), sizes[0], max(sizes), growth

    def print(self) -> bool:
        """Print a table; return whether nothing grows."""
        print("\n| process | samples | first (MB) | greatest (MB) | growth (MB) |")
        print("|---|---|---|---|---|")
        rows = sorted(self.rows())
        for name, count, first, greatest, growth in rows:
            print(f"| {name} | {count} | {first:.1f} | {greatest:.1f} | {growth:+.1f} |")
        return all(growth <= MOST_GROWTH_MB for *_, growth in rows)


def resident_mb(pid: int) -> float | None:
    """Return the resident memory of a process, None if it has ended."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def marked() -> dict[str, int]:
    """Return the processes that this script started, at whatever remove, by what they run."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = (folder / "environ").read_bytes().split(b"\0")
            words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if MARK.encode() in environment and int(folder.name) != os.getpid() and "-m" in words:
            found[words[words.index("-m") + 1]] = int(folder.name)
    return found


def orphans() -> int:
    """Return how many processes are left after a moment."""
    until = time.monotonic() + 10.0
    while (left := marked()) and time.monotonic() < until:
        time.sleep(0.1)
    return len(left)


def real_time(minutes: float) -> bool:
    """Rehearse again and again; print what came of it; return whether all is well."""
    memory, until = Memory(fewest=12), time.monotonic() + 60.0 * minutes
    plays = lost = samples = faults = safe = 0
    folder = Path(tempfile.mkdtemp())
    plan = plan_in(folder / "soak")
    with running(plan) as (graph, interruption):
        while time.monotonic() < until:
            plays += 1
            fault = CATALOGUE[plays // 2 % len(CATALOGUE)] if plays % 2 == 0 else None
            what = fault and with_onset(fault, plays)
            played = graph.play(what, plays, f"{plays}")
            found = judged(dataclasses.replace(plan, fault=what), played, 0)
            shutil.rmtree(plan.folder / f"{plays}")
            checks = {check.name: check for check in found.checks}
            if fault is None:
                samples += found.timing.position.messages
                lost += int(sum(checks[name].value for name in ("lost", "unanswered")))
                lost += found.bag is None
            else:
                faults += 1
                safe += checks["safe_state"].passed
                if not checks["safe_state"].passed:
                    print(f"  {checks['safe_state'].sentence}")
            memory.sample({**graph.pids, "conductor and recorder": os.getpid()})
            interruption.raise_if_asked()
    shutil.rmtree(folder)
    left = orphans()
    print(f"\nreal time: {plays} runs; {samples} samples without fault, {lost} lost; ", end="")
    print(f"{safe} of {faults} faults ended in their safe state; {left} processes left behind")
    return memory.print() and lost == left == 0 and safe == faults


def lockstep(realizations: int) -> bool:
    """Record a campaign that is sabotaged; print what came of it; return whether all is well."""
    memory, chance = Memory(fewest=60), random.Random(SEED)
    folder = Path(tempfile.mkdtemp())
    command = [sys.executable, "-m", "fjr_cli", "run", "--out", str(folder / "graph"), *RUN]
    command += ["--realizations", str(realizations)]
    kills = left = 0
    for _ in range(realizations + _MOST_FAILURES):
        with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as run:
            try:
                kills += sabotage(run, memory, time.monotonic() + chance.uniform(5.0, 30.0), chance)
            finally:
                run.kill()
        left += orphans()
        if run.returncode == 0:
            break
    whole, same = compare(folder, realizations)
    shutil.rmtree(folder)
    print(f"\nlockstep: {whole} of {realizations} bags whole after {kills} kills, {same} ", end="")
    print(f"with the bytes of the batch simulation; {left} processes left behind")
    return memory.print() and whole == same == realizations and left == 0


def sabotage(run: subprocess.Popen, memory: Memory, at: float, chance: random.Random) -> int:
    """Watch a campaign until it ends; return how often one of its processes was killed: 0 or 1."""
    kills = 0
    while run.poll() is None:
        time.sleep(0.25)
        pids = marked()
        memory.sample(pids)
        if not kills and time.monotonic() > at and len(pids) > 1:
            kills = 1
            os.kill(chance.choice(sorted(pids.values())), signal.SIGKILL)
    return kills


def compare(folder: Path, realizations: int) -> tuple[int, int]:
    """Return how many bags there are, and how many equal those of the batch simulation."""
    campaign = Campaign.create(folder / "graph" / CAMPAIGN_FILE)
    with CampaignProgress() as progress:
        simulate_campaign(campaign, folder / "batch", progress=progress)
    bags = sorted((folder / "graph").glob("level_*"))
    same = sum(
        all(file.read_bytes() == (folder / "batch" / bag.name / file.name).read_bytes()
            for file in bag.iterdir())
        for bag in bags
    )  # fmt: skip
    return len(bags), same


def main(minutes: float = 30.0, realizations: float = 100) -> bool:
    """Print the tables; return whether all is well."""
    name, _, value = MARK.partition("=")
    os.environ[name] = value
    print(describe() + "\n", flush=True)
    good = real_time(minutes)
    good = lockstep(int(realizations)) and good
    print("\nall is well" if good else "\nNOT all is well")
    return good


if __name__ == "__main__":
    sys.exit(not main(*map(float, sys.argv[1:3])))
