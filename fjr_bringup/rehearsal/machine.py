"""The machine during a rehearsal: its load, and the scheduling of the nodes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from fjr_kit.result_types import Number, ResultModel

_POLICIES = {
    os.SCHED_OTHER: "SCHED_OTHER",
    os.SCHED_BATCH: "SCHED_BATCH",
    os.SCHED_IDLE: "SCHED_IDLE",
    os.SCHED_FIFO: "SCHED_FIFO",
    os.SCHED_RR: "SCHED_RR",
}
_REAL_TIME = ("SCHED_FIFO", "SCHED_RR")


class Scheduling(ResultModel):
    """How a process is scheduled.

    Attributes:
        policy: SCHED_OTHER, SCHED_FIFO, ...
        priority: real-time priority, 0 without one.
        nice: niceness.
        cores: how many cores it may use.
    """

    policy: str
    priority: int
    nice: int
    cores: int

    @property
    def real_time(self) -> bool:
        """Whether the process goes before all that have no real-time priority."""
        return self.policy in _REAL_TIME


class Machine(ResultModel):
    """What the machine did during a run.

    Attributes:
        cores: cores of the machine.
        real_time_kernel: whether the kernel is fully preemptible (PREEMPT_RT).
        load_before, load_after: processes that ran or wanted to, mean of the minute before.
        busy: share of all cores' time that was used, by whatever process; NaN if not known.
        nodes: scheduling of each process by name, `recorder` included.
    """

    cores: int
    real_time_kernel: bool
    load_before: Number
    load_after: Number
    busy: Number
    nodes: Mapping[str, Scheduling]

    @property
    def sentence(self) -> str:
        """The load and the kernel in one sentence."""
        kernel = "a real-time" if self.real_time_kernel else "no real-time"
        used = f"{100.0 * self.busy:.0f} % busy" if self.busy == self.busy else "of unknown use"
        return (
            f"The {self.cores} cores were {used} during the run (load {self.load_before:.1f} "
            f"before, {self.load_after:.1f} after), under {kernel} kernel."
        )


class MachineWatch:
    """Watches the machine from its creation until `ended`."""

    def __init__(self, pids: Mapping[str, int]) -> None:
        """Begin.

        Args:
            pids: processes of the loop by name; one that has ended is left out.
        """
        self._nodes = _scheduling({**pids, "recorder": os.getpid()})
        self._load = os.getloadavg()[0]
        self._used, self._whole = _times()

    def ended(self) -> Machine:
        """Return what was seen since the beginning."""
        used, whole = _times()
        passed = whole - self._whole
        return Machine(
            cores=os.cpu_count() or 1,
            real_time_kernel="PREEMPT_RT" in os.uname().version,
            load_before=self._load,
            load_after=os.getloadavg()[0],
            busy=(used - self._used) / passed if passed > 0 else float("nan"),
            nodes=self._nodes,
        )


def _scheduling(pids: Mapping[str, int]) -> dict[str, Scheduling]:
    found = {}
    for name, pid in pids.items():
        try:
            policy = os.sched_getscheduler(pid) & ~os.SCHED_RESET_ON_FORK
            found[name] = Scheduling(
                policy=_POLICIES.get(policy, f"policy {policy}"),
                priority=os.sched_getparam(pid).sched_priority,
                nice=os.getpriority(os.PRIO_PROCESS, pid),
                cores=len(os.sched_getaffinity(pid)),
            )
        except ProcessLookupError:
            continue
    return found


def _times() -> tuple[int, int]:
    """Return (used, whole) processor time since the start of the machine, in ticks."""
    try:
        line = Path("/proc/stat").read_text(encoding="ascii").splitlines()[0]
    except OSError:
        return 0, 0
    user, nice, system, idle, wait, *others = map(int, line.split()[1:9])
    used = user + nice + system + sum(others)
    return used, used + idle + wait
