"""State of a node in the terms of diagnostic_msgs, without ROS."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

OK, WARN, ERROR = 0, 1, 2


@dataclass(frozen=True)
class Health:
    """One look at a node.

    Attributes:
        level: OK, WARN or ERROR.
        summary: one phrase.
        values: figures by name, with the unit in the name.
    """

    level: int = OK
    summary: str = "idle"
    values: Mapping[str, float | int | str | None] = field(default_factory=dict)

    def texts(self) -> Iterator[tuple[str, str]]:
        """Yield names and values as texts; a value that is None is left out."""
        for name, value in self.values.items():
            if value is not None:
                yield name, f"{value:.6g}" if isinstance(value, float) else str(value)


class Speed:
    """Samples per time against the sample rate, between two looks."""

    def __init__(self) -> None:
        """Begin to count now."""
        self._samples, self._at = 0, time.monotonic()

    def look(self, samples: int, sample_rate_hz: float) -> float:
        """Return how many times real time it went since the last look.

        Args:
            samples: samples so far; fewer than before if a new run has begun.
            sample_rate_hz: of the samples.
        """
        now = time.monotonic()
        passed = samples - self._samples if samples >= self._samples else samples
        speed = passed / sample_rate_hz / max(now - self._at, 1e-9)
        self._samples, self._at = samples, now
        return speed
