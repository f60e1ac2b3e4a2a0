"""Ctrl-C and SIGTERM in a node: they stop it where it can say its last word."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stopping:
    """A context manager in which the first signal raises KeyboardInterrupt, or later only asks."""

    def __init__(self) -> None:
        """Take over nothing yet."""
        self.asked = False
        self._raises = True
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Stopping:
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
        """Ignore what else comes: the process is ending."""
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    def only_asks(self) -> None:
        """Let a signal set `asked` from now on and interrupt nothing."""
        self._raises = False

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True
        if self._raises:
            self._raises = False
            raise KeyboardInterrupt
