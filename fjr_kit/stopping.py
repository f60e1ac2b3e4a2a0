"""Ctrl-C, SIGTERM and SIGHUP, noticed where the work says so and never in the middle of a step.

An exception that a signal raises between any two instructions can leave a folder, a process or a
lock that nobody knows of; a flag that the loops look at cannot.
"""

from __future__ import annotations

import signal
from types import FrameType
from typing import Any, TypeVar

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_Flag = TypeVar("_Flag", bound="StopFlag")


class StopFlag:
    """A context manager in which these signals only ask: `asked` says whether one came.

    A SIGHUP that is ignored, as under nohup, stays ignored.
    """

    def __init__(self) -> None:
        """Take over nothing yet."""
        self.asked = False
        self._before: dict[int, Any] = {}

    def __enter__(self: _Flag) -> _Flag:
        """Take the signals over; only the main thread may."""
        for number in _SIGNALS:
            if number == signal.SIGHUP and signal.getsignal(number) == signal.SIG_IGN:
                continue
            self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True


class Interruption(StopFlag):
    """The flag of a command: `raise_if_asked` says where it may stop.

    A second signal doesn't wait for that: it raises KeyboardInterrupt at once.
    """

    def raise_if_asked(self) -> None:
        """Raise KeyboardInterrupt if a signal came since this was entered."""
        if self.asked:
            raise KeyboardInterrupt

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.raise_if_asked()
        self.asked = True


class NodeInterruption(StopFlag):
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
