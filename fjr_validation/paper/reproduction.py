"""The reproduction of the paper: the tasks stage by stage, then the parts of the report."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from matplotlib import rc_context
from pydantic import Field

from fjr_kit.atomic import result_folder
from fjr_kit.figure_style import save
from fjr_kit.folder_lock import locked_folder
from fjr_kit.invocation import call_date, command_line, provenance
from fjr_kit.progress import ProgressLine
from fjr_kit.result_types import Document, FreeForm
from fjr_kit.tasks import Arrays, Task, run_tasks

from . import (
    certificate,
    certificate_report,
    drawing,
    fig4,
    fig5,
    fig5_report,
    fig6,
    fig7_to_9,
    leakage,
    page,
    planner_check,
    prediction,
    search_check,
    shift_map,
    short_records,
)
from .part import Part, Statement
from .settings import FULL, QUICK, Settings

CACHE = "cache"
OWN_FILES = ("report.html", "results.json", "figures/*.p[nd][gf]")
"""What an earlier run may have left in a folder, as patterns."""


class PaperResults(Document):
    """What `results.json` holds.

    Attributes:
        provenance: what made it.
        statements: what the paper says beside what was measured.
        numbers: all numbers, by section of the report.
    """

    schema_name: Literal["fjr_rig/paper/1"] = Field("fjr_rig/paper/1", alias="schema")
    provenance: dict[str, str]
    statements: list[Statement]
    numbers: FreeForm


def run_paper(
    out: Path, *, quick: bool = False, scheduler: str | None = None, workers: int | None = None
) -> Path:
    """Run all experiments that the folder lacks and write the report.

    Args:
        out: folder of report, figures and results.
        quick: the small version.
        scheduler: address of a Dask scheduler; None for this machine.
        workers: processes; None for one on each core.

    Returns:
        The path of report.html.

    Raises:
        InputError: the folder cannot be written, or no scheduler answers.
    """
    began = time.monotonic()
    settings = QUICK if quick else FULL
    with locked_folder(out):
        cache = out / CACHE
        results, amplitude_rad = compute(settings, cache, scheduler=scheduler, workers=workers)
        parts = build(settings, results, amplitude_rad)
        provenance = _provenance(time.monotonic() - began)
        return write(out, settings, parts, provenance)


def compute(
    settings: Settings,
    cache: Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
) -> tuple[dict[str, Arrays], float]:
    """Run all tasks; return their results and the best amplitude that Fig. 4 gave (rad)."""

    def stage(tasks: Sequence[Task], title: str) -> dict[str, Arrays]:
        with ProgressLine(total=len(tasks)) as line:

            def report(done: int, total: int, name: str) -> None:
                line.report(done, total, f"{title}: {name}")

            return run_tasks(tasks, cache, workers=workers, scheduler=scheduler, report=report)

    results = stage(fig4.tasks(settings), "amplitude sweep")
    amplitude_rad = fig4.optimum_amplitude(results, settings)
    results |= stage(further_tasks(settings, amplitude_rad), "experiments")
    results |= stage(fig5.torque_tasks(settings, results), "shaped experiments")
    results |= stage(fig5.best_tasks(settings, results), "shaped, repeated")
    return results, amplitude_rad


def further_tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the tasks that need the best amplitude (rad) and nothing else."""
    further: list[Task] = []
    for module in (
        fig5,
        fig6,
        fig7_to_9,
        certificate,
        search_check,
        planner_check,
        short_records,
        leakage,
    ):
        further += module.tasks(settings, amplitude_rad)
    return further


def build(settings: Settings, results: dict[str, Arrays], amplitude_rad: float) -> list[Part]:
    """Return all sections of the report."""
    with rc_context(drawing.STYLE):
        parts = [fig4.part(results, settings)]
        for module in (
            search_check,
            fig5_report,
            fig6,
            fig7_to_9,
            shift_map,
            prediction,
            certificate_report,
            planner_check,
            short_records,
            leakage,
        ):
            parts.append(module.part(results, settings, amplitude_rad))
    return parts


def write(out: Path, settings: Settings, parts: Sequence[Part], provenance: dict[str, str]) -> Path:
    """Write report.html, results.json and figures/; return the path of the report."""
    size = "small version" if settings is QUICK else "full version"
    lead = (
        f"Every experiment of Boukhebouz et al., hal-03083268, run again in batch ({size}), with "
        "what the paper says beside what this run measured."
    )
    title = "Identification of a flexible-joint robot: the paper run again"
    text = page.render(title, lead, parts, provenance)
    numbers = {part.title: part.numbers for part in parts if part.numbers}
    statements = [statement for part in parts for statement in part.statements]
    results = PaperResults(provenance=provenance, statements=statements, numbers=numbers)
    with result_folder(out, OWN_FILES) as folder, rc_context(drawing.STYLE):
        (folder / "figures").mkdir()
        for part in parts:
            for name, figure in part.figures.items():
                save(figure, folder / "figures" / name)
        (folder / "results.json").write_text(results.to_json(), encoding="utf-8")
        (folder / "report.html").write_text(text, encoding="utf-8")
    return out / "report.html"


def _provenance(seconds: float) -> dict[str, str]:
    cores = len(os.sched_getaffinity(0))
    computed_in = f"{seconds:.0f} s on {cores} cores (less what was taken up from before)"
    return provenance(command_line(), call_date()) | {"computed in": computed_in}
