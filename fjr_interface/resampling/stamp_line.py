"""Numbers the samples of a jittered clock: which are lost, how large the jitter is, which the rate.

Stamps are followed by a straight line from stretch to stretch, as a phase-locked loop would do it:
a jitter of less than half a period, lost samples and a slow drift of the rate then leave no doubt
about which stamp is which sample.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

STRETCH = 256
_TRIED = 1.0 + np.linspace(-0.05, 0.05, 2001)
"""Periods that are tried at the start, relative to the median step."""


class StampLine:
    """Follows the stamps of one topic, given in consecutive pieces.

    Attributes:
        samples: stamps so far.
        lost: samples that are missing between them.
        gaps: how many gaps there are of each number of consecutive lost samples.
        longest_ns: the stamp after which the longest gap begins; 0 without any.
        first_ns: first stamp.
        last_ns: last stamp.
    """

    def __init__(self) -> None:
        """Start with no stamps."""
        self.samples = self.lost = 0
        self.gaps: Counter[int] = Counter()
        self.longest_ns = self.first_ns = self.last_ns = 0
        self._squares = 0.0
        self._nominal = self._period = 0.0
        self._phase = 0.0  # of sample `_number` on the line, ns from first_ns
        self._number = 0
        self._moments = np.zeros(
            4
        )  # sums of k, k^2, d and k d, d the time beyond k nominal periods

    def add(self, stamps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Follow the next stamps, at least two in all.

        Args:
            stamps: int64 nanoseconds of shape (samples,).

        Returns:
            (numbers, line): int64, the number of each sample counted from 0 with the lost ones, and
            float64, the instant in ns (from `first_ns`) that it has on the straight line.

        Raises:
            StampError: stamps do not rise, or the jitter leaves doubt about their number.
        """
        if not self.samples:
            self.first_ns = int(stamps[0])
        before = stamps[0] - 1 if not self.samples else self.last_ns
        falling = np.flatnonzero(np.diff(stamps, prepend=before) <= 0)
        if falling.size:
            raise StampError(int(stamps[falling[0]]), "does not come after the one before it")
        if not self.samples:
            self._begin((stamps[:STRETCH] - self.first_ns).astype(float))
        parts = [self._follow(stamps[at : at + STRETCH]) for at in range(0, len(stamps), STRETCH)]
        numbers, line = (np.concatenate(part) for part in zip(*parts, strict=True))
        return numbers, line

    def _begin(self, times: np.ndarray) -> None:
        """Find period and phase: those of the comb that the first stamps lie on best."""
        periods = _TRIED * np.median(np.diff(times))
        combs = np.exp(2j * np.pi * times / periods[:, None]).sum(axis=1)
        best = int(np.abs(combs).argmax())
        self._nominal = self._period = float(periods[best])
        self._phase = float(np.angle(combs[best])) / (2.0 * np.pi) * self._period

    def _follow(self, stamps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        times = (stamps - self.first_ns).astype(float)
        ahead = np.rint((times - self._phase) / self._period).astype(np.int64)
        numbers = self._number + ahead
        steps = np.diff(numbers, prepend=self._number if self.samples else -1)
        doubtful = np.flatnonzero(steps < 1)
        if doubtful.size:
            raise StampError(int(stamps[doubtful[0]]), "is nearer to its neighbour's instant")
        slope, at_mean = self._fit(numbers, times)
        line = at_mean + slope * (numbers - numbers.mean())
        self._count(stamps, steps)
        self._squares += float(np.sum((times - line) ** 2))
        self.samples += len(stamps)
        self.last_ns = int(stamps[-1])
        self._number, self._phase = int(numbers[-1]), float(line[-1])
        k, late = numbers.astype(float), times - numbers * self._nominal
        self._moments += [k.sum(), k @ k, late.sum(), k @ late]
        if self._number >= STRETCH // 2:
            self._period = self.period_ns
        return numbers, line

    def _fit(self, numbers: np.ndarray, times: np.ndarray) -> tuple[float, float]:
        """Return slope and value at the mean number of the least-squares line."""
        centred = numbers - numbers.mean()
        if len(numbers) < STRETCH // 4:
            return self._period, float(times.mean())
        return float(centred @ times / (centred @ centred)), float(times.mean())

    def _count(self, stamps: np.ndarray, steps: np.ndarray) -> None:
        for at in np.flatnonzero(steps > 1):
            lost = int(steps[at]) - 1
            if lost > max(self.gaps, default=0):
                self.longest_ns = int(stamps[at - 1]) if at else self.last_ns
            self.gaps[lost] += 1
            self.lost += lost

    @property
    def period_ns(self) -> float:
        """Mean sample period: the slope of the least-squares line through all stamps."""
        k, squares, late, products = self._moments / max(self.samples, 1)
        spread = squares - k**2
        return self._nominal + (float((products - k * late) / spread) if spread > 0.0 else 0.0)

    @property
    def rate_hz(self) -> float:
        """Mean sample rate; the whole number that it cannot be told from, if there is one."""
        rate = 1e9 / self.period_ns
        doubt = 4.0 * self.jitter * np.sqrt(12.0) / max(self.samples, 1) ** 1.5 + 1e-6
        return float(round(rate)) if abs(rate - round(rate)) <= doubt * rate else rate

    @property
    def jitter(self) -> float:
        """Rms distance of the stamps from the line, as a part of the period."""
        return float(np.sqrt(self._squares / max(self.samples, 1))) / self._period


class StampError(ValueError):
    """The stamps cannot be numbered.

    Attributes:
        stamp_ns: where.
        what: what is wrong with it, to follow the stamp in a sentence.
    """

    def __init__(self, stamp_ns: int, what: str) -> None:
        """Keep both."""
        super().__init__(what)
        self.stamp_ns, self.what = stamp_ns, what
