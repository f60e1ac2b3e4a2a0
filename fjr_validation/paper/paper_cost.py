"""What `fjr paper` will take: `--dry-run`, from pieces of its amplitude sweep that are computed."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from fjr_kit.tasks import Task, run_tasks

from . import fig4
from .reproduction import further_tasks
from .settings import CASES, QUICK, Settings

OTHERS, OTHERS_QUICK = 3.6, 7.0
"""Processor time of all other experiments over that of the sweep: 190 s beside 52 s in a full run,
70 s beside 10 s in a quick one."""

_BYTES, _BYTES_QUICK = 40e6, 15e6
"""Report, figures and kept results; 8 MB of a quick run are results, which grow with repeats."""


@dataclass(frozen=True)
class Estimate:
    """What is still to do.

    Attributes:
        sweep: levels of the amplitude sweep, in all and to do.
        others: tasks of the other experiments, in all and to do; None while the sweep, which says
            at which amplitude they are, is unfinished.
        processor_s: time of one processor.
        disk_bytes: size of the whole folder.
    """

    sweep: tuple[int, int]
    others: tuple[int, int] | None
    processor_s: float
    disk_bytes: float


def estimate(settings: Settings, cache: Path) -> Estimate:
    """Compute one level of each case of the sweep; return what is still to do of a run.

    Args:
        settings: its size.
        cache: folder of the results that are kept.
    """
    sweep = fig4.tasks(settings)
    pending = _absent(sweep, cache)
    sweep_s = _time_of(sweep, settings)
    quick = settings is QUICK
    others_s, others = (OTHERS_QUICK if quick else OTHERS) * sweep_s, None
    if not pending:
        amplitude_rad = fig4.optimum_amplitude(run_tasks(sweep, cache), settings)
        further = further_tasks(settings, amplitude_rad)
        others = (len(further), len(_absent(further, cache)))
        others_s *= others[1] / others[0]
    return Estimate(
        (len(sweep), len(pending)),
        others,
        sweep_s * len(pending) / len(sweep) + others_s,
        _BYTES_QUICK if quick else _BYTES,
    )


def _absent(tasks: Sequence[Task], cache: Path) -> list[Task]:
    return [task for task in tasks if not task.file(cache).exists()]


def _time_of(sweep: Sequence[Task], settings: Settings) -> float:
    """Return the processor time of the sweep (s), from the middle level of each of its cases."""
    levels = settings.amplitudes.size
    named = {task.name: task for task in sweep}
    middle = [named[fig4.task_name(case, levels // 2)] for case in CASES]
    middle[0].function(**middle[0].parameters)  # compiles
    begun = time.process_time()
    for task in middle:
        task.function(**task.parameters)
    return (time.process_time() - begun) * levels
