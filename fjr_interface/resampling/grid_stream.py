"""One unevenly sampled signal on its way onto an even grid, piece by piece."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from .accuracy import Surveyed
from .band_limited import MARGIN, WINDOW, interpolate
from .hold_equivalent import REACH, hold_equivalent
from .stamp_line import StampLine


@dataclass(frozen=True)
class Grid:
    """Instants origin_ns + k / rate_hz, k = first..last.

    Attributes:
        origin_ns: a whole second at or before all samples.
        rate_hz: samples/s.
        first: first k.
        last: last k.
        lead: how often the value of the first one is given in advance.
    """

    origin_ns: int
    rate_hz: float
    first: int
    last: int
    lead: int = 0


class GridStream:
    """One signal on its way onto the grid, piece by piece with an overlap."""

    def __init__(self, found: Surveyed, grid: Grid) -> None:
        """Start with no samples; `ready` says how many values of the grid can be taken."""
        self._found, self._grid = found, grid
        self._period_ns = 1e9 / grid.rate_hz
        self._next, self._lead = grid.first, grid.lead
        self._line = StampLine()
        self._overlap = max(WINDOW, math.ceil((REACH + 4) * found.rate_hz / grid.rate_hz))
        self._times = self._values = np.empty(0)
        self._numbers = np.empty(0, np.int64)
        self._parts: deque[np.ndarray] = deque()
        self.ready = 0

    def add(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Take the next piece; put on the grid what has all its neighbours."""
        numbers, _ = self._line.add(stamps)
        self._times = np.append(self._times, (stamps - self._grid.origin_ns).astype(float))
        self._values = np.append(self._values, values)
        self._numbers = np.append(self._numbers, numbers)
        settled = len(self._times) - self._overlap
        if settled > 2 * self._overlap:
            self._put(self._times[settled])
            kept = slice(settled - self._overlap, None)
            self._times, self._values = self._times[kept], self._values[kept]
            self._numbers = self._numbers[kept]

    def finish(self) -> None:
        """Put the rest on the grid."""
        self._put(math.inf)

    def take(self, samples: int) -> np.ndarray:
        """Return the next values of the grid."""
        self.ready -= samples
        joined = np.concatenate(self._parts)
        self._parts = deque([joined[samples:]])
        return joined[:samples]

    def _put(self, until_ns: float) -> None:
        end = self._grid.last + 1
        if until_ns < math.inf:
            end = min(end, math.ceil(until_ns / self._period_ns))
        if end <= self._next:
            return
        points = np.arange(self._next, end)
        if self._found.name == "torque":
            values = self._held(points)
        else:
            values = self._interpolated(points * self._period_ns)
        if self._lead:
            values = np.concatenate([np.full(self._lead, values[0]), values])
            self._lead = 0
        self._next = end
        self._parts.append(values)
        self.ready += len(values)

    def _interpolated(self, instants_ns: np.ndarray) -> np.ndarray:
        period, spectrum = self._found.period_ns, self._found.spectrum
        return interpolate(self._times / period, self._values, instants_ns / period, spectrum)

    def _held(self, points: np.ndarray) -> np.ndarray:
        """Return the equivalent of the held commands; lost ones are interpolated."""
        absent = np.sort(np.concatenate([self._lost_ns(), self._beyond_ns()]))
        commands = np.concatenate([self._values, self._interpolated(absent)])
        times = np.concatenate([self._times, absent])
        order = np.argsort(times)
        return hold_equivalent(times[order] / self._period_ns, commands[order], points)

    def _beyond_ns(self) -> np.ndarray:
        """Return the instants of some commands before the first and after the last one."""
        steps = self._found.period_ns * np.arange(1, MARGIN + 1)
        return np.concatenate([self._times[0] - steps, self._times[-1] + steps])

    def _lost_ns(self) -> np.ndarray:
        """Return the instants of the commands that are lost."""
        steps = np.diff(self._numbers)
        times = [np.empty(0)]
        for at in np.flatnonzero(steps > 1):
            between = np.linspace(self._times[at], self._times[at + 1], int(steps[at]) + 1)
            times.append(between[1:-1])
        return np.concatenate(times)
