"""What `fjr paper` does: the tasks in two stages, then the parts of the report."""

from __future__ import annotations

import json
import math
import os
import platform
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bla_analyzer.figure_style import save
from fjr_interface.errors import InputError
from fjr_interface.installed import product_version

from ..invocation import call_date, command_line
from ..tasks import Arrays, Task, run_tasks
from . import (
    certificate,
    certificate_report,
    drawing,
    fig4,
    fig5,
    fig6,
    figs789,
    leakage,
    page,
    planner_check,
    prediction,
    records,
    search_check,
    shift_map,
)
from .part import Part
from .settings import FULL, QUICK, Settings

CACHE = "cache"


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
    results, amplitude_rad = compute(settings, out / CACHE, scheduler=scheduler, workers=workers)
    parts = build(settings, results, amplitude_rad)
    provenance = _provenance(time.monotonic() - began)
    return write(out, settings, parts, provenance)


def compute(
    settings: Settings,
    cache: Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    console: Console | None = None,
) -> tuple[dict[str, Arrays], float]:
    """Run all tasks; return their results and the best amplitude that Fig. 4 gave (rad)."""
    console = console or Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        disable=not console.is_terminal,
    ) as bar:

        def stage(tasks: Sequence[Task], title: str) -> dict[str, Arrays]:
            line = bar.add_task(title, total=len(tasks))

            def report(done: int, total: int, name: str) -> None:
                bar.update(line, completed=done, description=f"{title}: {name}")
                if not console.is_terminal:
                    console.print(f"{title} {done}/{total}: {name}", highlight=False)

            return run_tasks(tasks, cache, workers=workers, scheduler=scheduler, report=report)

        results = stage(fig4.tasks(settings), "amplitude sweep")
        amplitude_rad = fig4.optimum_amplitude(results, settings)
        further: list[Task] = []
        for module in (
            fig5,
            fig6,
            figs789,
            certificate,
            search_check,
            planner_check,
            records,
            leakage,
        ):
            further += module.tasks(settings, amplitude_rad)
        results |= stage(further, "experiments")
        results |= stage(fig5.second_tasks(settings, amplitude_rad, results), "shaped experiments")
    return results, amplitude_rad


def build(settings: Settings, results: dict[str, Arrays], amplitude_rad: float) -> list[Part]:
    """Return all sections of the report."""
    with rc_context(drawing.STYLE):
        parts = [fig4.part(results, settings)]
        for module in (
            search_check,
            fig5,
            fig6,
            figs789,
            shift_map,
            prediction,
            certificate_report,
            planner_check,
            records,
            leakage,
        ):
            parts.append(module.part(results, settings, amplitude_rad))
    return parts


def write(out: Path, settings: Settings, parts: Sequence[Part], provenance: dict[str, str]) -> Path:
    """Write report.html, results.json and figures/; return the path of the report."""
    figures = out / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{figures} cannot be made: {error.strerror}.") from None
    with rc_context(drawing.STYLE):
        for part in parts:
            for name, figure in part.figures.items():
                save(figure, figures / name)
    size = "small version" if settings is QUICK else "full version"
    lead = (
        f"Every experiment of Boukhebouz et al., hal-03083268, run again in batch ({size}), with "
        "what the paper says beside what this run measured."
    )
    title = "Identification of a flexible-joint robot: the paper run again"
    text = page.render(title, lead, parts, provenance)
    numbers = {part.title: part.numbers for part in parts if part.numbers}
    rows = [vars(statement) for part in parts for statement in part.statements]
    content = {"provenance": provenance, "statements": rows, "numbers": numbers}
    _replace(out / "results.json", json.dumps(_without_nan(content), indent=1))
    _replace(out / "report.html", text)
    return out / "report.html"


def _without_nan(value: Any) -> Any:
    """Return the value with None for what JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_without_nan(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _replace(file: Path, text: str) -> None:
    temporary = file.with_name(f".{file.name}.{os.getpid()}.tmp")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(file)


def _provenance(seconds: float) -> dict[str, str]:
    return {
        "command": command_line(),
        "date": call_date(),
        "computed in": f"{seconds:.0f} s on {len(os.sched_getaffinity(0))} cores (less what was "
        "taken up from before)",
        "versions": f"Python {platform.python_version()}, fjr-rig {product_version()}, "
        f"numpy {version('numpy')}, scipy {version('scipy')}, numba {version('numba')}",
    }
