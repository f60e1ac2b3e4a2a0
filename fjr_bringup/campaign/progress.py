"""Progress of a campaign, of a replay and of a bag that is played: simulated time and speed."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from fjr_kit.progress import ProgressLine

from .plan import Campaign


class CampaignProgress(ProgressLine):
    """Shows simulated seconds against those to come, the speed and the time left.

    Without a terminal it prints one line for each finished realization instead.
    """

    def __init__(self, console: Console | None = None, done: str = "simulated") -> None:
        """Show on a console, stderr by default; `done` says what happens to the seconds."""
        super().__init__(console)
        self._done = done
        self._expected_s = 0.0
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
        self._expected_s = seconds
        self._update(total=seconds)

    def update(self, simulated_s: float) -> None:
        """Show the simulated time of the realization under way."""
        passed_s = self._before_s + simulated_s
        amount = f"{passed_s:.0f}/{self._expected_s:.0f} s {self._done} {self._speed_text()}"
        self._update(completed=passed_s, amount=amount)

    def finish_run(self, text: str, simulated_s: float) -> None:
        """Count a finished realization."""
        self._before_s += simulated_s
        self.update(0.0)
        self.log(f"{text} {self._speed_text()}".rstrip())

    def _speed_text(self) -> str:
        speed = self._bar.tasks[self._task].speed
        return f"{speed:.1f} x real time" if speed else ""
