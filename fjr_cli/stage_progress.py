"""The stage under way of a long command, on stderr."""

from __future__ import annotations

from fjr_kit.progress import ProgressLine


class StageProgress(ProgressLine):
    """Shows the stage under way, as lines without a terminal."""

    def describe(self, text: str) -> None:
        """Say what is being done."""
        super().describe(text)
        self.log(text)
