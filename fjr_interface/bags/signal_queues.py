"""Samples of each signal of a bag that wait for those of the others."""

from __future__ import annotations

from collections import deque

import numpy as np

from .audit import SignalAudit


class SignalQueue:
    """Samples of one signal that wait for those of the others.

    Attributes:
        audit: checks what is added.
        waiting: how many samples wait.
    """

    def __init__(self, audit: SignalAudit) -> None:
        """Begin without samples."""
        self.audit = audit
        self.waiting = 0
        self._parts: deque[tuple[np.ndarray, np.ndarray]] = deque()

    def add(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Check samples and let them wait: stamps int64 (ns), values float64 in the SI unit."""
        self.audit.check(stamps, values)
        self._parts.append((stamps, values))
        self.waiting += len(stamps)

    def take(self, samples: int) -> tuple[np.ndarray, np.ndarray]:
        """Return stamps and values of the samples that have waited longest, and let them go."""
        taken = []
        self.waiting -= samples
        while samples:
            stamps, values = self._parts.popleft()
            if len(stamps) > samples:
                self._parts.appendleft((stamps[samples:], values[samples:]))
                stamps, values = stamps[:samples], values[:samples]
            taken.append((stamps, values))
            samples -= len(stamps)
        stamps, values = zip(*taken, strict=True)
        return np.concatenate(stamps), np.concatenate(values)


def ready_and_lag(queues: dict[str, SignalQueue]) -> tuple[int, int]:
    """Return how many samples all signals have, and how many the last one is behind the first."""
    waiting = [queue.waiting for queue in queues.values()]
    return min(waiting), max(waiting) - min(waiting)
