"""Ctrl-C and SIGTERM in a command that runs others: it stops where that leaves nothing behind."""

from __future__ import annotations

from types import FrameType

from fjr_interface.stopping import StopFlag


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
