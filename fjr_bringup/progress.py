"""What is shown on stderr while something takes long: a line of its own, and a campaign's."""

from __future__ import annotations

from collections.abc import Sequence
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

from .campaign import Campaign

_Line = TypeVar("_Line", bound="ProgressLine")


class ProgressLine:
    """A context manager that shows one line on stderr, or nothing of it without a terminal."""

    def __init__(
        self,
        *columns: ProgressColumn,
        console: Console | None = None,
        transient: bool = False,
        **fields: Any,
    ) -> None:
        """Prepare the line.

        Args:
            columns: what stands in it.
            console: where to show it; None for stderr.
            transient: whether it goes away at the end.
            fields: total and own fields of the columns, at the start.
        """
        self._console = console or Console(stderr=True)
        self._bar = Progress(
            *columns,
            console=self._console,
            transient=transient,
            disable=not self._console.is_terminal,
        )
        self._task = self._bar.add_task("starting", **fields)

    def __enter__(self: _Line) -> _Line:
        """Start drawing."""
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop drawing."""
        self._bar.stop()

    def say(self, sentence: str) -> None:
        """Print a sentence above the line."""
        self._console.print(sentence, highlight=False, markup=False)


class CampaignProgress(ProgressLine):
    """Shows simulated seconds against those to come, the speed and the time left.

    Without a terminal it prints one line for each finished realization instead.
    """

    def __init__(self, console: Console | None = None, done: str = "simulated") -> None:
        """Show on a console, stderr by default; `done` says what happens to the seconds."""
        super().__init__(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn(f"{{task.completed:.0f}}/{{task.fields[expected]:.0f}} s {done}"),
            TextColumn("{task.fields[speed]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            total=None,
            expected=0.0,
            speed="",
        )
        self._before_s = 0.0

    def expect(self, campaign: Campaign, pending: Sequence[tuple[int, int]]) -> None:
        """Take the sum of the pending realizations for the whole; say what is there already."""
        experiment = campaign.experiment(0, 0)
        self.expect_s(len(pending) * experiment.samples / experiment.sample_rate_hz)
        total, there = len(campaign.runs), len(campaign.runs) - len(pending)
        if there:
            self.say(f"{there} of {total} bags are there already.")

    def expect_s(self, seconds: float) -> None:
        """Take so many simulated seconds for the whole."""
        self._bar.update(self._task, total=seconds, expected=seconds)

    def describe(self, text: str) -> None:
        """Say what is being done."""
        self._bar.update(self._task, description=text)

    def update(self, simulated_s: float) -> None:
        """Show the simulated time of the realization under way."""
        self._bar.update(
            self._task, completed=self._before_s + simulated_s, speed=self._speed_text()
        )

    def finish_run(self, text: str, simulated_s: float) -> None:
        """Count a finished realization."""
        self._before_s += simulated_s
        self.update(0.0)
        if not self._console.is_terminal:
            self._console.print(f"{text} {self._speed_text()}".rstrip(), highlight=False)

    def _speed_text(self) -> str:
        speed = self._bar.tasks[self._task].speed
        return f"{speed:.1f} x real time" if speed else ""
