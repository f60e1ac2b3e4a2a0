"""Ctrl-C and SIGTERM, noticed where the work says so and never in the middle of a step.

An exception that a signal raises between any two instructions can leave a folder, a process or a
lock that nobody knows of; a flag that the loops look at cannot.
"""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """A context manager in which both signals only ask; `raise_if_asked` answers.

    A second signal doesn't wait for the answer: it raises KeyboardInterrupt at once.
    """

    def __init__(self) -> None:
        """Take over nothing yet."""
        self.asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        """Take the signals over; only the main thread may."""
        for number in _SIGNALS:
            self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def raise_if_asked(self) -> None:
        """Raise KeyboardInterrupt if a signal came since this was entered."""
        if self.asked:
            raise KeyboardInterrupt
