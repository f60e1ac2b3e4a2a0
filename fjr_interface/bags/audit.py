"""Checks that a signal has every sample exactly once, and says by topic, sample and time if not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from fjr_kit.errors import InputError

from .blocks import MEND

REGULARITY = 0.01
"""Greatest deviation of a step between stamps from Ts, as a part of Ts, without a description."""
LARGEST = 1e100
"""Greatest magnitude of a sample: beyond it squares overflow, and nothing measured comes near."""


@dataclass(frozen=True)
class Grid:
    """The stamps that samples must have.

    Attributes:
        sample_rate_hz: 1/Ts.
        samples: number of samples; None if nothing describes them: then the stamps need not be
            k Ts but only Ts apart, within `REGULARITY`.
    """

    sample_rate_hz: float
    samples: int | None

    def stamps_ns(self, first: int, count: int) -> np.ndarray:
        """Return the stamps of samples first..first+count-1 (from 1), int64 of shape (count,)."""
        stamps = np.arange(first, first + count) * 1e9 / self.sample_rate_hz
        return np.rint(np.minimum(stamps, 2.0**62)).astype(np.int64)


def regular_rate_hz(stamps: np.ndarray) -> float:
    """Return the sample rate of the first stamps of a bag: from their mean step.

    A rate that is a whole number within the rounding of the stamps to ns is given as such.

    Args:
        stamps: int64 nanoseconds of shape (samples,), at least two.

    Raises:
        ValueError: the median step is not positive.
    """
    steps = np.diff(stamps)
    median = float(np.median(steps))
    if median <= 0:
        raise ValueError("stamps do not rise")
    regular = steps[np.abs(steps - median) <= REGULARITY * median]
    rate = 1e9 / float(regular.mean()) if len(regular) else 1e9 / median
    whole = round(rate)
    rounding = 2.0 / (median * max(len(regular), 1))
    return float(whole) if abs(rate - whole) <= rounding * rate else rate


class SignalAudit:
    """Follows one signal through the bag."""

    def __init__(self, bag: str, topic: str, grid: Grid) -> None:
        """Expect sample 1 of `topic` next."""
        self.samples = 0
        self._where = f"{bag}: {topic}"
        self._grid = grid
        self._last: int | None = None

    def check(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Check the next samples: int64 ns and float64, both of shape (samples,).

        Raises:
            InputError: a sample is missing, repeated, out of order, off the grid, NaN, infinite or
                beyond `LARGEST`, or there are more than described.
        """
        if not len(stamps):
            return
        bad = self._off_grid(stamps)
        good = values if bad is None else values[:bad]
        if not (np.abs(good) <= LARGEST).all():
            at = int(np.flatnonzero(~(np.abs(good) <= LARGEST))[0])
            self._refuse(at, stamps[at], f"is {good[at]}, not a number that can be used")
        if bad is not None:
            self._explain(bad, stamps)
        self.samples += len(stamps)
        self._last = int(stamps[-1])

    def _off_grid(self, stamps: np.ndarray) -> int | None:
        """Return the index of the first stamp that is not as expected."""
        grid = self._grid
        if grid.samples is not None:
            wrong = stamps != grid.stamps_ns(self.samples + 1, len(stamps))
            wrong[max(0, grid.samples - self.samples) :] = True
        else:
            before = stamps[0] - round(1e9 / grid.sample_rate_hz)
            steps = np.diff(stamps, prepend=before if self._last is None else self._last)
            period = 1e9 / grid.sample_rate_hz
            wrong = np.abs(steps - period) > REGULARITY * period
            wrong[0] &= self._last is not None
        bad = np.flatnonzero(wrong)
        return int(bad[0]) if len(bad) else None

    def _explain(self, at: int, stamps: np.ndarray) -> NoReturn:
        stamp, expected = int(stamps[at]), self._expected(at, stamps)
        last = int(stamps[at - 1]) if at else self._last
        if last is not None and stamp == last:
            self._refuse(at - 1, stamp, "is there twice")
        if last is not None and stamp < last:
            self._refuse(at, stamp, f"comes after {_seconds(last)}, which is out of order")
        if self._grid.samples is not None and self.samples + at >= self._grid.samples:
            self._refuse(at, stamp, f"is more than the {self._grid.samples} described")
        if expected in stamps[at:]:
            self._refuse(at, expected, f"comes after {_seconds(stamp)}, which is out of order")
        gap = (stamp - expected) * self._grid.sample_rate_hz / 1e9
        if gap > 0.5 and abs(gap - round(gap)) <= REGULARITY:
            also = f" and so are the {round(gap) - 1} after it" if round(gap) > 1 else ""
            self._refuse(at, expected, f"is missing{also}")
        self._refuse(
            at,
            stamp,
            f"is off the regular grid: it should be at {_seconds(expected)} ("
            f"{self._grid.sample_rate_hz:g} samples/s), which --resample auto may mend",
        )

    def _expected(self, at: int, stamps: np.ndarray) -> int:
        """Return the stamp in ns that the sample at this index should have."""
        if self._grid.samples is not None:
            return int(self._grid.stamps_ns(self.samples + at + 1, 1)[0])
        last = int(stamps[at - 1]) if at else self._last or 0
        return round(last + 1e9 / self._grid.sample_rate_hz)

    def finish(self) -> None:
        """Check that all samples have come; raise InputError if not."""
        if not self.samples:
            raise InputError(f"{self._where}: holds no sample; {MEND}.")
        if self._grid.samples is not None and self.samples < self._grid.samples:
            number = self.samples + 1
            stamp = self._grid.stamps_ns(number, 1)[0]
            self._refuse(0, stamp, f"and all later ones of the {self._grid.samples} are missing")

    def _refuse(self, at: int, stamp: int, what: str) -> NoReturn:
        number = self.samples + at + 1
        raise InputError(f"{self._where}: sample {number} at {_seconds(stamp)} {what}; {MEND}.")


def refuse_different_stamps(
    bag: str, topics: tuple[str, str], stamps: tuple[np.ndarray, np.ndarray], first: int
) -> None:
    """Raise InputError if two signals differ in the stamps of samples from `first` on."""
    different = np.flatnonzero(stamps[0] != stamps[1])
    if len(different):
        at = different[0]
        raise InputError(
            f"{bag}: sample {first + at} of {topics[0]} is at {_seconds(stamps[0][at])} but of "
            f"{topics[1]} at {_seconds(stamps[1][at])}; record them with the same stamps, or use "
            "--resample auto."
        )


def _seconds(stamp: int) -> str:
    """Return a stamp in ns as exact seconds, such as '1.25 s'."""
    whole, rest = divmod(int(stamp), 1_000_000_000)
    return f"{whole}.{rest:09d}".rstrip("0").rstrip(".") + " s"
