"""Writes the files of a comparison into a folder, all of them or none."""

from __future__ import annotations

from pathlib import Path

from fjr_kit.atomic import result_folder
from fjr_kit.invocation import provenance

from .result import Comparison

RESULT_FILE, REPORT_FILE = "compare.json", "compare.html"


def write_comparison(
    found: Comparison,
    out: Path | str,
    *,
    report: bool = True,
    command: str | None = None,
    date: str | None = None,
) -> Path:
    """Write compare.json and compare.html into `out`; other files there stay.

    Args:
        found: the comparison.
        out: the folder; made if it is absent.
        report: whether to write the page, beside the data.
        command: the command line, for the page.
        date: the date, for the page.

    Returns:
        The path of compare.html, or of compare.json without it.

    Raises:
        InputError: `out` cannot be written.
    """
    with result_folder(Path(out), (RESULT_FILE, REPORT_FILE)) as folder:
        (folder / RESULT_FILE).write_text(found.to_json(), encoding="utf-8")
        if report:
            from .compare_page import render

            text = render(found, provenance(command, date))
            (folder / REPORT_FILE).write_text(text, encoding="utf-8")
    return Path(out) / (REPORT_FILE if report else RESULT_FILE)
