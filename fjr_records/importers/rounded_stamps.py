"""Even stamps that were rounded: to their last digit, or to the ticks of a coarse clock.

A stamp that was cut to a tick says that its sample was taken within this tick. Of even samples all
these statements leave a range of sample rates, which is narrow where stamps change: 9 changes of
whole seconds tell 1000 Hz to 0.01 %, while a straight line through the stamps is off by more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_LOOSE = 1.5
"""Samples may be uneven by half a tick more than the rounding explains."""
_PRINTED = 0.1
"""Greatest deviation of a step from whole ticks, in ticks: the tick was rounded when written."""
_OFTEN = 0.05
"""Least part of steps that are no single tick, of stamps that come in ticks."""
_HALVINGS = 40


@dataclass(frozen=True)
class Rounded:
    """Even samples behind rounded stamps.

    Attributes:
        tick_s: to which the stamps were rounded.
        rate_hz: sample rate, the roundest number that the stamps allow.
        least_hz: least rate that they allow.
        most_hz: greatest rate that they allow; infinite where they change too seldom.
    """

    tick_s: float
    rate_hz: float
    least_hz: float
    most_hz: float


def rounded(time: np.ndarray, *, copies: bool = False) -> Rounded | None:
    """Return what stamps say that are even but for their rounding; None if they are not.

    Args:
        time: stamps in s, never falling, float64 (samples,).
        copies: whether samples that repeat a stamp are copies of the sample before, so that no
            clock is too coarse for them.
    """
    time = time - time[0]
    ticks = (_digit(time), None if copies else _tick(time))
    found = (_even(time, tick) for tick in ticks if tick is not None)
    return next((each for each in found if each is not None), None)


def _digit(time: np.ndarray) -> float | None:
    """Return the last digit of stamps (s), a power of ten; None if there are more than nine."""
    counts = ((float(digit), time / digit) for digit in 10.0 ** -np.arange(0, 10))
    return next((d for d, count in counts if (np.abs(count - np.rint(count)) < 1e-4).all()), None)


def _tick(time: np.ndarray) -> float | None:
    """Return the tick (s) of which all steps are whole multiples; None if there is no such tick."""
    steps = np.diff(time)
    rises = steps[steps > 0]
    numbers = np.rint(steps / rises.min())
    tick = float(rises.sum() / numbers.sum())
    if (np.abs(steps - numbers * tick) > _PRINTED * tick).any():
        return None
    return tick if np.mean(numbers != 1) >= _OFTEN else None


def _even(time: np.ndarray, tick: float) -> Rounded | None:
    """Return the rates of even samples whose stamps were rounded to a tick (s); None if of none."""
    new = np.flatnonzero(np.diff(time) > 0) + 1
    first, last = np.concatenate([[0], new]), np.concatenate([new - 1, [time.size - 1]])
    stamps = time[first]

    def width(step: float) -> tuple[float, int]:
        """Return how far stamps scatter about samples with this step, and whither it narrows."""
        late, early = stamps - first * step, stamps - last * step
        return float(late.max() - early.min()), int(first[late.argmax()] - last[early.argmin()])

    middle, reach = float(time[-1]) / (time.size - 1), 2.0 * _LOOSE * tick / (time.size - 1)
    ends = max(middle - reach, 0.0), middle + reach
    best = _where(lambda step: width(step)[1] <= 0, *ends)
    narrowest = width(best)[0]
    if narrowest > _LOOSE * tick:
        return None
    allowed = (tick if narrowest <= tick else _LOOSE * tick) + 1e-9 * tick
    longest = _where(lambda step: width(step)[0] > allowed, best, ends[1])
    shortest = -_where(lambda step: width(-step)[0] > allowed, -best, -ends[0])
    most = 1.0 / shortest if shortest > 1e-9 * middle else np.inf
    return Rounded(tick, _roundest(1.0 / longest, most, 1.0 / best), 1.0 / longest, most)


def _where(passed: Callable[[float], bool], low: float, high: float) -> float:
    """Return where something begins to hold between two numbers, the upper one if nowhere."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if passed(middle) else (middle, high)
    return high


def _roundest(least: float, most: float, rate: float) -> float:
    """Return the number of fewest digits near a rate that lies within bounds; else the rate."""
    near = (float(f"{rate:.{digits}g}") for digits in range(1, 10))
    return next((one for one in near if least <= one <= most), rate)
