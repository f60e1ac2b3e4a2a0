"""Progress of a rehearsal: elapsed time, and the present timing of the loop."""

from __future__ import annotations

import time

from rich.console import Console

from fjr_kit.progress import ProgressLine

from .timing import LoopTiming

_LINE_EVERY_S = 10.0


class RehearsalProgress(ProgressLine):
    """Shows time against the whole, and how the last samples did.

    Without a terminal it prints a line every 10 s instead.
    """

    def __init__(self, console: Console | None = None) -> None:
        """Show on a console, stderr by default."""
        super().__init__(console, total=1.0)
        self._total_s = 0.0
        self._printed = time.monotonic()

    def expect(self, total_s: float) -> None:
        """Say how long it will take."""
        self._total_s = total_s
        self._update(total=total_s)

    def show(self, passed_s: float, recent: LoopTiming) -> None:
        """Show how the last samples did."""
        text = describe(recent)
        amount = f"{passed_s:.0f}/{self._total_s:.0f} s"
        self._update(completed=passed_s, amount=amount, description=text)
        if time.monotonic() - self._printed > _LINE_EVERY_S:
            self._printed = time.monotonic()
            self.log(f"{passed_s:.0f} of {self._total_s:.0f} s: {text}")


def describe(recent: LoopTiming) -> str:
    """Return in a few words how the last samples did."""
    if not recent.latency.count:
        return "no torque answers"
    lost = recent.position.lost + recent.torque.lost
    return (
        f"latency {recent.latency.p50 * 1e3:.2f} ms, 99 % {recent.latency.p99 * 1e3:.2f}, worst "
        f"{recent.latency.worst * 1e3:.2f}; {recent.late} late, {lost} lost"
    )
