"""Ctrl-C and SIGTERM, noticed where the work says so and never in the middle of a step.

An exception that a signal raises between any two instructions can leave a folder, a process or a
lock that nobody knows of; a flag that the loops look at cannot.
"""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any, TypeVar

_SIGNALS = (signal.SIGINT, signal.SIGTERM)

_Flag = TypeVar("_Flag", bound="StopFlag")


class StopFlag:
    """A context manager in which both signals only ask: `asked` says whether one came."""

    def __init__(self) -> None:
        """Take over nothing yet."""
        self.asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self: _Flag) -> _Flag:
        """Take the signals over; only the main thread may."""
        for number in _SIGNALS:
            self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True


class Stopping(StopFlag):
    """The flag of a node: until `only_asks` is called, the first signal raises KeyboardInterrupt.

    So a node that is still starting ends at once, and one that runs can say its last word.
    """

    def __init__(self) -> None:
        """Take over nothing yet."""
        super().__init__()
        self._raises = True

    def __exit__(self, *_: object) -> None:
        """Ignore what else comes: the process is ending."""
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    def only_asks(self) -> None:
        """Let a signal set `asked` from now on and interrupt nothing."""
        self._raises = False

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True
        if self._raises:
            self._raises = False
            raise KeyboardInterrupt
