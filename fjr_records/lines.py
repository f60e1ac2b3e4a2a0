"""Which lines are excited, and which of the others show odd or even distortion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fjr_interface.experiment import Experiment


@dataclass(frozen=True)
class Lines:
    """The lines of a grid as ascending harmonics of f0, int arrays.

    Attributes:
        excited: (F,).
        odd, even: (K,) odd and even harmonics of the band that are not excited.
    """

    excited: np.ndarray
    odd: np.ndarray
    even: np.ndarray

    @property
    def first(self) -> int:
        """The lowest harmonic of the band."""
        return int(min(part[0] for part in (self.excited, self.odd, self.even) if part.size))

    @property
    def last(self) -> int:
        """The highest harmonic of the band."""
        return int(max(part[-1] for part in (self.excited, self.odd, self.even) if part.size))


@dataclass(frozen=True)
class Grid:
    """What all bags of an experiment share.

    Attributes:
        sample_rate_hz: rate of the samples.
        samples_per_period: N.
        transient_periods: periods to discard.
        periods: P to keep after them.
        lines: excited and detection lines.
    """

    sample_rate_hz: float
    samples_per_period: int
    transient_periods: int
    periods: int
    lines: Lines

    @classmethod
    def of(cls, experiment: Experiment) -> Grid:
        """Return the grid that a description fixes."""
        return cls(
            experiment.sample_rate_hz,
            experiment.samples_per_period,
            experiment.transient_periods,
            experiment.periods,
            classify(experiment.excited_harmonics, experiment.detection_harmonics),
        )


def classify(excited: Sequence[int], detection: Sequence[int] = ()) -> Lines:
    """Sort the lines of the band from the lowest to the highest excited or detection line.

    An odd random grid leaves out its odd detection lines and all even lines, so whatever is not
    excited is a detection line.
    """
    lines = np.unique(np.asarray(excited, int))
    named = np.concatenate([lines, np.asarray(detection, int)])
    silent = np.setdiff1d(np.arange(named.min(), named.max() + 1), lines)
    return Lines(lines, silent[silent % 2 == 1], silent[silent % 2 == 0])


def interpolate_frf(lines: np.ndarray, known_lines: np.ndarray, g: np.ndarray) -> np.ndarray:
    """Interpolate an FRF between excited lines, geometrically.

    G(k) = G_a (G_b / G_a)^w with w linear in log k between the neighbours a and b: exact for powers
    of s, which an FRF with integrators is at low lines, where linear interpolation fails (by 80 %
    half way between harmonics 1 and 5 of 1/s). Beyond the outermost lines G is held.

    Args:
        lines: (L,), harmonics >= 1 asked for.
        known_lines: (F,), ascending harmonics where G is known.
        g: complex (F,), G there.

    Returns:
        Complex (L,).
    """
    if known_lines.size == 1:
        return np.full(lines.shape, g[0])
    right = np.clip(np.searchsorted(known_lines, lines), 1, known_lines.size - 1)
    start, end = np.log(known_lines[right - 1]), np.log(known_lines[right])
    weight = np.clip((np.log(lines) - start) / (end - start), 0.0, 1.0)
    return g[right - 1] * (g[right] / g[right - 1]) ** weight


def nearest(lines: np.ndarray, candidates: np.ndarray, count: int) -> np.ndarray:
    """Return for each line the indices of the `count` nearest candidates, int (L, count).

    Args:
        lines: (L,), harmonics.
        candidates: (C,), ascending harmonics, C >= count.
        count: number of neighbours.
    """
    distance = np.abs(lines[:, None] - candidates[None, :])
    return np.argsort(distance, axis=1, kind="stable")[:, :count]


def local_mean(values: np.ndarray, width: int) -> np.ndarray:
    """Return the mean of each line and its neighbours: what is found from few numbers is rough.

    Args:
        values: (lines,).
        width: how many lines are averaged, odd; at the ends those that there are.

    Returns:
        (lines,).
    """
    ahead, window = width // 2, np.ones(width)
    sums = (np.convolve(each, window) for each in (values, np.ones(values.size)))
    total, count = (each[ahead : ahead + values.size] for each in sums)
    return total / count
