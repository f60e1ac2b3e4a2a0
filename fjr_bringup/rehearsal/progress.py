"""Progress of a rehearsal: time, and how the loop does at present."""

from __future__ import annotations

import time

from rich.console import Console
from rich.progress import BarColumn, TextColumn

from ..progress import ProgressLine
from .timing import LoopTiming

_LINE_EVERY_S = 10.0


class RehearsalProgress(ProgressLine):
    """Shows time against the whole, and how the last samples did.

    Without a terminal it prints a line every 10 s instead.
    """

    def __init__(self, console: Console | None = None) -> None:
        """Show on a console, stderr by default."""
        super().__init__(
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f} s"),
            TextColumn("{task.description}"),
            console=console,
            total=1.0,
        )
        self._total_s = 0.0
        self._printed = time.monotonic()

    def expect(self, total_s: float) -> None:
        """Say how long it will take."""
        self._total_s = total_s
        self._bar.update(self._task, total=total_s)

    def show(self, passed_s: float, recent: LoopTiming) -> None:
        """Show how the last samples did."""
        text = describe(recent)
        self._bar.update(self._task, completed=passed_s, description=text)
        if not self._console.is_terminal and time.monotonic() - self._printed > _LINE_EVERY_S:
            self._printed = time.monotonic()
            self.say(f"{passed_s:.0f} of {self._total_s:.0f} s: {text}")


def describe(recent: LoopTiming) -> str:
    """Return in a few words how the last samples did."""
    if not recent.latency.count:
        return "no torque answers"
    lost = recent.position.lost + recent.torque.lost
    return (
        f"latency {recent.latency.p50 * 1e3:.2f} ms, 99 % {recent.latency.p99 * 1e3:.2f}, worst "
        f"{recent.latency.worst * 1e3:.2f}; {recent.late} late, {lost} lost"
    )
