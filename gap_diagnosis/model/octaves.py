"""Bands of the lines of a window: line 0 alone (mean and slow motion), then an octave or less."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fjr_records.record_noise import RecordNoise, band_lines
from fjr_records.records import RecordSet

from .lapped import lapped


@dataclass(frozen=True)
class Octaves:
    """Bands of the lines that hold a signal.

    Attributes:
        hop: half the length of a window, samples.
        edges: (bands + 1,), first line of each band.
    """

    hop: int
    edges: np.ndarray

    @classmethod
    def of(cls, hop: int, lines: int) -> Octaves:
        """Return the bands of so many lines."""
        edges = [0, 1]
        while edges[-1] < lines:
            edges.append(min(edges[-1] + max(edges[-1], 4), lines))
        return cls(hop, np.array(edges))

    def __len__(self) -> int:
        """Return the number of bands."""
        return len(self.edges) - 1

    @property
    def lines(self) -> int:
        """Number of lines."""
        return int(self.edges[-1])

    @property
    def of_line(self) -> np.ndarray:
        """The band of each line, int (lines,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.edges))

    def means(self, of_lines: np.ndarray) -> np.ndarray:
        """Return the means over bands, (..., bands), of numbers of lines, (..., lines)."""
        return np.add.reduceat(of_lines, self.edges[:-1], axis=-1) / np.diff(self.edges)

    def of_noise(self, noise: RecordNoise) -> np.ndarray:
        """Return the variance of a noise in each band, (bands,), rad2."""
        return self.means(noise.power(_cycles(self.hop)[: self.lines]))

    def of_scatter(self, scatter: Sequence[np.ndarray]) -> np.ndarray | None:
        """Return the variance in each band by how errors differ between periods, (bands,), rad2.

        In a loop noise is not white: the controller answers that of the encoder. None for one
        period, or where periods are equal.
        """
        rows = np.concatenate([lapped(row, self.hop).reshape(-1, self.hop) for row in scatter])
        return self.means(np.mean(rows[:, : self.lines] ** 2, axis=0)) if rows.any() else None


def lines_with_signal(
    records: RecordSet, noise: RecordNoise, measured: Sequence[np.ndarray], hop: int
) -> int:
    """Return how many lines from line 0 on hold more than noise.

    Noise that walks lies below what windows let through to the highest lines of a motion of
    many turns, so they are looked for in the differences of the samples. White noise lies above
    most of that, and an observer that crosses over as high as the rest says holds better.

    Args:
        records: the runs.
        noise: of their positions.
        measured: lines of their positions, (windows, hop) each, rad.
        hop: half the length of a window, samples.
    """
    cycles = _cycles(hop)
    if not noise.walks:
        power = np.mean(np.concatenate(measured) ** 2, axis=0)
        return band_lines(power, noise.power(cycles))
    steps = [lapped(np.diff(r.position), hop) for r in records.records]
    power = np.mean(np.concatenate(steps) ** 2, axis=0)
    return band_lines(power / (2.0 * np.sin(np.pi * cycles)) ** 2, noise.power(cycles))


def _cycles(hop: int) -> np.ndarray:
    """Return the frequency of each line in cycles a sample, (hop,)."""
    return 0.5 * (np.arange(hop) + 0.5) / hop
