"""Write an analysis to a folder, whole or not at all."""

from __future__ import annotations

import platform
import shutil
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

from fjr_interface.errors import InputError
from fjr_interface.installed import product_version

from .result import Result
from .result_json import load_result, to_json
from .tables import frf_csv, frf_mat, frf_npz, to_frd

PACKAGES = ("numpy", "scipy", "matplotlib", "plotly")
OWN_FILES = ("report.html", "frf.csv", "frf.npz", "frf.mat", "result.json", "figures/*.p[nd][gf]")
"""What an earlier analysis may have left in a folder, as patterns."""

Progress = Callable[[str], None]


def write_result(
    result: Result,
    out: Path,
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
    with atomic_folder(Path(out)) as folder:
        _write_data(result, folder, say)
        if figures:
            from .figures import write_figures

            (folder / "figures").mkdir()
            write_figures(result, folder / "figures", say)
        if report:
            from .report import render_report

            say("report.html")
            text = render_report(result, provenance(command, date))
            (folder / "report.html").write_text(text, encoding="utf-8")
    return Path(out) / ("report.html" if report else "result.json")


def _write_data(result: Result, folder: Path, say: Progress) -> None:
    """Write the numbers of the result, one file at a time."""
    files: tuple[tuple[str, Callable[[Result], str | bytes]], ...] = (
        ("result.json", to_json),
        ("frf.csv", frf_csv),
        ("frf.npz", frf_npz),
        ("frf.mat", frf_mat),
    )
    for name, make in files:
        say(name)
        content = make(result)
        data = content.encode() if isinstance(content, str) else content
        (folder / name).write_bytes(data)


def provenance(command: str | None, date: str | None) -> dict[str, str]:
    """Return what made a report, by name: command line, date and versions."""
    given = {"command": command, "date": date}
    versions = [f"Python {platform.python_version()}", f"fjr-rig {product_version()}"]
    versions += [f"{name} {version(name)}" for name in PACKAGES]
    named = {name: text for name, text in given.items() if text is not None}
    return named | {"versions": ", ".join(versions)}


@contextmanager
def atomic_folder(out: Path, own: Iterable[str] = OWN_FILES) -> Iterator[Path]:
    """Yield a temporary folder; its files move into `out` when the block succeeds.

    It lies beside `out`, or within it where that exists: `out` may be a file system of its own.
    What an earlier run has left, as the patterns `own` name it, goes.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file; name a folder for the results.")
    name = f".{uuid.uuid4().hex[:12]}.part"
    temporary = (out if out.exists() else out.parent) / name
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        temporary.mkdir()
        yield temporary
        _move(temporary, out, own)
    except OSError as error:
        raise InputError(
            f"{out}: cannot be written ({error.strerror or error}); name another folder for the "
            "results or make room."
        ) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _move(folder: Path, out: Path, own: Iterable[str]) -> None:
    """Move all files of `folder` into `out`, replacing those of an earlier analysis."""
    if not out.exists():
        folder.rename(out)
        return
    new = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    stale = {path.relative_to(out) for pattern in own for path in out.glob(pattern)}
    for path in stale - set(new):
        (out / path).unlink()
    for path in new:
        (out / path).parent.mkdir(exist_ok=True)
        (folder / path).replace(out / path)


__all__ = ["load_result", "to_frd", "write_result"]
