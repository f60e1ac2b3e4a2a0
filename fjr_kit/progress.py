"""What is shown on stderr while something takes long."""

from __future__ import annotations

from typing import Any, TypeVar

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

_Line = TypeVar("_Line", bound="ProgressLine")
_WIDE = 100
"""Columns of a terminal that hold bar and elapsed time beside the words."""


class ProgressLine:
    """A context manager that shows one line: a bar, the amount done, times, and the current task.

    Without a terminal there is no such line, only the sentences of `say`, `log` and `report`.
    """

    def __init__(
        self, console: Console | None = None, *, total: float | None = None, transient: bool = False
    ) -> None:
        """Prepare the line.

        Args:
            console: where to show it; None for stderr.
            total: what the bar counts to; None if that is not known.
            transient: whether the line goes away at the end.
        """
        self._console = console or Console(stderr=True)
        columns: list[ProgressColumn] = [
            TextColumn("{task.fields[amount]}"),
            TimeRemainingColumn(),
            TextColumn("{task.description}", markup=False),
        ]
        if self._console.width >= _WIDE:
            columns.insert(0, BarColumn())
            columns.insert(2, TimeElapsedColumn())
        self._bar = Progress(
            *columns,
            console=self._console,
            transient=transient,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task("starting", total=total, amount="")

    def __enter__(self: _Line) -> _Line:
        """Start drawing."""
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop drawing."""
        self._bar.stop()

    def describe(self, text: str) -> None:
        """Show what is being done."""
        self._update(description=text)

    def count(self, done: int, total: int, what: str) -> None:
        """Show how many of all are done, and the last of them."""
        self._update(completed=done, total=total, amount=f"{done}/{total}", description=what)

    def report(self, done: int, total: int, what: str) -> None:
        """Count, and print a line where there is no terminal."""
        self.count(done, total, what)
        self.log(f"{done}/{total} {what}")

    def say(self, sentence: str) -> None:
        """Print a sentence above the line; one that is long stays one line in a log."""
        in_log = not self._console.is_terminal
        self._console.print(sentence, highlight=False, markup=False, soft_wrap=in_log)

    def log(self, sentence: str) -> None:
        """Print a sentence where there is no terminal that shows the line."""
        if not self._console.is_terminal:
            self.say(sentence)

    def _update(self, **fields: Any) -> None:
        self._bar.update(self._task, **fields)
