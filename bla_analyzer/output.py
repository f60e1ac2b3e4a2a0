"""Writes the files of an analysis into a folder, all of them or none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fjr_kit.atomic import result_folder
from fjr_kit.invocation import provenance
from fjr_kit.telling import Progress

from .results.result import Result
from .results.tables import frf_csv, frf_mat, frf_npz

OWN_FILES = ("report.html", "frf.csv", "frf.npz", "frf.mat", "result.json", "figures/*.p[nd][gf]")
"""What an earlier analysis may have left in a folder, as patterns."""


def write_result(
    result: Result,
    out: Path | str,
    *,
    figures: bool = True,
    report: bool = True,
    progress: Progress | None = None,
    command: str | None = None,
    date: str | None = None,
) -> Path:
    """Write result.json, frf.csv, frf.npz, frf.mat, figures/ and report.html into `out`.

    Everything is written to a temporary folder first and moved when whole; files of an earlier
    analysis are replaced, other files in `out` stay. The same result, versions, command and date
    give the same bytes.

    Args:
        result: the analysis.
        out: the folder; made if it is absent.
        figures: whether to draw the PNG and PDF figures.
        report: whether to write report.html.
        progress: called with what is being written.
        command: the command line, for the report.
        date: the date, for the report.

    Returns:
        The path of report.html (of result.json without a report).

    Raises:
        InputError: `out` cannot be written.
    """
    say = progress or (lambda _: None)
    with result_folder(Path(out), OWN_FILES) as folder:
        _write_data(result, folder, say)
        if figures:
            from .report.figures import write_figures

            (folder / "figures").mkdir()
            write_figures(result, folder / "figures", say)
        if report:
            from .report.report_page import render_report

            say("report.html")
            text = render_report(result, provenance(command, date))
            (folder / "report.html").write_text(text, encoding="utf-8")
    return Path(out) / ("report.html" if report else "result.json")


def _write_data(result: Result, folder: Path, say: Progress) -> None:
    """Write the numbers of the result, one file at a time."""
    files: tuple[tuple[str, Callable[[Result], str | bytes]], ...] = (
        ("result.json", Result.to_json),
        ("frf.csv", frf_csv),
        ("frf.npz", frf_npz),
        ("frf.mat", frf_mat),
    )
    for name, make in files:
        say(name)
        content = make(result)
        data = content.encode() if isinstance(content, str) else content
        (folder / name).write_bytes(data)
