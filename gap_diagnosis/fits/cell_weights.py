"""What the cells of the evidence weigh, where a remainder is: variances and independent numbers.

Noise is another number on every line. What a remainder leaves on the lines of one band need not
be: friction that is a little other in this run, or a motor that stops a little beside its place,
moves them all. Where one run fits and another selects, a band of a part counts for a few numbers
only, else the fine lines of the fitted run outweigh an offset of all runs. Where one run does both,
it counts for as many as its sums of squares say, which differ from part to part by sqrt(2/n) of
their mean if n numbers are in them.
"""

from __future__ import annotations

import numpy as np

from ..model.evidence import Evidence

LEAST_INDEPENDENT = 4.0
"""Independent numbers, at the least, that a remainder leaves in a band of a part."""


class CellWeights:
    """Weights and likelihoods of errors on the parts that fit, and on those that select.

    Attributes:
        fit_parts, select_parts: indices of parts.
        floor: (cells,), least variance of an error of the fit, rad2.
        runs: (errors,), the record of each error of the fit.
        counts: (parts, bands), lines of each part that selects.
        select_floor: (parts, bands), least variance of an error there, rad2.
        select_levels: (parts,), index of the level of each.
        unseen: bool (errors that select,) of each run that no fit sees.
    """

    def __init__(self, evidence: Evidence) -> None:
        """Count the lines of all cells."""
        self._evidence = evidence
        self.fit_parts = evidence.parts_for("fit")
        self.select_parts = evidence.parts_for("select") or self.fit_parts
        levels, of_level = evidence.records.levels, evidence.records.levels.index
        self._cell = evidence.cell_of(self.fit_parts)
        self._count = np.bincount(self._cell, minlength=evidence.cells)
        fitted = [of_level(evidence.parts[p].level) for p in self.fit_parts]
        self._fit_parts_of = np.bincount(fitted, minlength=len(levels))
        runs = [r.level for r in evidence.records.records]
        self._alone = np.array([runs.count(level) == 1 for level in levels])
        self._coherent = np.full((len(levels), evidence.bands), LEAST_INDEPENDENT)
        self._noise = evidence.noise_power
        self.floor = evidence.floor(self.fit_parts)
        of_part = np.array([part.record for part in evidence.parts])
        self.runs = of_part[evidence.part_of(self.fit_parts)]
        self._select_cell = evidence.cell_of(self.select_parts)
        parts = evidence.part_of(self.select_parts)
        place = {part: k for k, part in enumerate(self.select_parts)}
        self._select_bins = (
            np.array([place[p] for p in parts]) * evidence.bands
            + self._select_cell % evidence.bands
        )
        shape = len(self.select_parts), evidence.bands
        self.counts = np.bincount(self._select_bins, minlength=shape[0] * shape[1]).reshape(shape)
        self.select_levels = np.array(
            [of_level(evidence.parts[p].level) for p in self.select_parts]
        )
        self.select_floor = self.floor.reshape(-1, evidence.bands)[self.select_levels]
        unseen = np.setdiff1d(of_part[parts], self.runs)
        self.unseen = [of_part[parts] == run for run in unseen]

    def learn(self, errors: np.ndarray) -> bool:
        """Take from what a fit leaves how many numbers the only run of a level holds.

        Args:
            errors: on the fitted parts, (errors,), rad.

        Returns:
            Whether any level has an only run.
        """
        if self._alone.any():
            self._coherent = self.coherence(errors)
        return bool(self._alone.any())

    def coherence(self, errors: np.ndarray) -> np.ndarray:
        """Return how many independent numbers are left in each band of a part of each level.

        Args:
            errors: on the fitted parts, (errors,), rad.

        Returns:
            (levels, bands), at least `LEAST_INDEPENDENT`; that, where a level has several runs.
        """
        shape = self._coherent.shape
        part, band = self._evidence.part_of(self.fit_parts), self._cell % shape[1]
        bins = len(self._evidence.parts), shape[1]
        place = part * bins[1] + band
        squares = np.bincount(place, errors**2, bins[0] * bins[1]).reshape(bins)
        level = np.array(
            [self._evidence.records.levels.index(p.level) for p in self._evidence.parts]
        )
        found = np.full(shape, LEAST_INDEPENDENT)
        for k in range(shape[0]):
            own = squares[[p for p in self.fit_parts if level[p] == k]]
            if self._alone[k] and len(own) > 2:
                spread = own.var(axis=0, ddof=1)
                found[k] = 2.0 * own.mean(axis=0) ** 2 / np.maximum(spread, 1e-300)
        return np.maximum(found, LEAST_INDEPENDENT)

    def gained(self, after: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return the log-likelihood gained in each band of each part that selects, nats.

        Args:
            after: (parts, bands), mean squares that one fit leaves there, rad2.
            before: those of the other fit.
        """
        return 0.5 * self.compared(after, before) * np.log(before / after)

    def compared(self, after: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return how many independent numbers tell two fits apart, (parts, bands); see `gained`."""
        known = self._noise[: self._evidence.bands]
        noise = np.minimum(known / np.minimum(before, after), 1.0)
        coherent = np.minimum(self._coherent[self.select_levels], self.counts)
        return independent(noise, self.counts, coherent)

    def numbers(self, variance: np.ndarray) -> np.ndarray:
        """Return how many independent numbers each cell holds on the fitted parts, (cells,)."""
        noise = np.minimum(self._noise / variance, 1.0)
        coherent = (self._fit_parts_of[:, None] * self._coherent).ravel()
        return independent(noise, self._count, np.minimum(coherent, self._count))

    def weight(self, variance: np.ndarray) -> np.ndarray:
        """Return the weight of each error of the fit, (errors,), 1/rad.

        Args:
            variance: (cells,), of an error in each cell, rad2.
        """
        share = self.numbers(variance) / np.maximum(self._count, 1)
        return np.sqrt(share / variance)[self._cell]

    def select_weight(self, variance: np.ndarray) -> np.ndarray:
        """Return the weight of each error that selects, (errors,), 1/rad; see `weight`."""
        share = self.numbers(variance) / np.maximum(self._count, 1)
        return np.sqrt(share / variance)[self._select_cell]

    def mean_squares(self, values: np.ndarray) -> np.ndarray:
        """Return the mean square of numbers on the parts that select, (parts, bands)."""
        squares = np.bincount(self._select_bins, values**2, self.counts.size)
        return squares.reshape(self.counts.shape) / self.counts

    def costs(self, variance: np.ndarray, errors: np.ndarray) -> np.ndarray:
        """Return twice the negative log-likelihood of errors whose variances by cell are unknown.

        Zero for the fit whose variances are given, but where noise alone is left. An offset is one
        line of many: a sum of squares in these variances would hardly see that it is gone.

        Args:
            variance: (cells,), rad2.
            errors: (models, errors), times its `weight`.

        Returns:
            (models,).
        """
        cells, least = self._evidence.cells, self.floor / variance
        numbers = self.numbers(variance)
        squares = np.array([np.bincount(self._cell, row**2, cells) for row in errors])
        mean = np.maximum(squares / np.maximum(numbers, 1e-9), least)
        return np.log(mean) @ numbers

    def variance(self, errors: np.ndarray) -> np.ndarray:
        """Return the variance of an error in each cell that a fit leaves, (cells,), rad2."""
        found = self._evidence.mean_squares(errors, self.fit_parts)
        return np.maximum(found, self.floor)


def independent(noise: np.ndarray, lines: np.ndarray, coherent: np.ndarray) -> np.ndarray:
    """Return how many independent numbers a sum of squares holds (Satterthwaite 1946).

    Args:
        noise: share of noise in it, which is independent on every line; the rest is a remainder's.
        lines: number of lines.
        coherent: number of independent numbers of the remainder.
    """
    found = 1.0 / (noise**2 / np.maximum(lines, 1) + (1.0 - noise) ** 2 / np.maximum(coherent, 1))
    return np.where(lines > 0, found, 0.0)
