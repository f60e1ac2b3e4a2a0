"""The best amplitude of a rig, from measured distortion and noise alone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.compare.bootstrap import interval, resampled
from bla_analyzer.compare.optimum import (
    Criterion,
    extrapolation_values,
    is_bracketed,
    least,
    relative_distortion,
)
from bla_analyzer.results.result import BlaEstimate
from fjr_kit.errors import InputError
from fjr_kit.telling import Progress

from ..campaign.plan import Campaign
from .bench import Bench, altered
from .measured import MeasuredLevel, read_levels

STEP = 1.6
"""Ratio of two amplitudes of the coarse search."""
RISE = 1.5
"""The criterion has surely passed its least value when it is this much above it."""
EXTRA = 5
"""Most amplitudes beside the coarse ones: one just below a limit, four around the least value."""
BOOTSTRAPS = 200


@dataclass(frozen=True)
class Limits:
    """What the rig may not exceed, as peaks."""

    torque_nm: float = math.inf
    position_rad: float = math.inf

    def allow(self, level: MeasuredLevel) -> bool:
        """Return whether a measured level keeps them."""
        return bool(level.peak[1] <= self.torque_nm and level.peak[2] <= self.position_rad)


@dataclass(frozen=True)
class Search:
    """What a search found.

    Attributes:
        amplitudes_rad: (L,), ascending, of the levels that allow a BLA (rms over lines).
        values: (L,) of the criterion at each of them.
        best_rad: the amplitude where it is least; a limit if that comes first.
        interval_rad: 95 % interval by bootstrap over realizations.
        others_rad: the amplitudes by the other criteria; NaN where there is none.
        bracketed: whether the criterion rises on both sides.
        ended_by: why no higher amplitude was measured.
    """

    amplitudes_rad: np.ndarray
    values: np.ndarray
    best_rad: float
    interval_rad: tuple[float, float]
    others_rad: dict[str, float]
    bracketed: bool
    ended_by: str


def search(
    campaign: Campaign,
    bench: Bench,
    *,
    lowest_rad: float = 1e-3,
    highest_rad: float = 1e-1,
    limits: Limits | None = None,
    say: Progress = lambda _: None,
) -> Search:
    """Measure upward until distortion rises again or a limit is near, then around the least value.

    Args:
        campaign: rig and experiment; its amplitudes are replaced.
        bench: where to measure.
        lowest_rad: first amplitude of each line.
        highest_rad: last one.
        limits: peaks that the rig may not exceed; a level is not played if the one below it
            predicts more.
        say: told about each level.

    Raises:
        InputError: even the lowest amplitude allows no BLA or exceeds a limit.
    """
    _refuse_range(lowest_rad, highest_rad)
    rig = _Levels(campaign, bench, limits or Limits(), say)
    amplitude, ended_by = lowest_rad, ""
    while not ended_by:
        ended_by = rig.measure(amplitude) or rig.passed_least()
        amplitude *= STEP
        if not ended_by and amplitude > highest_rad * (1.0 + 1e-9):
            ended_by = f"the highest amplitude asked for, {highest_rad:g} rad"
    if not rig.levels:
        raise InputError(f"Even {lowest_rad:g} rad is too much: {ended_by}; start lower.")
    rig.reach_limits()
    rig.refine()
    return evaluate(sorted(rig.levels.items()), ended_by)


def most_levels(lowest_rad: float, highest_rad: float) -> int:
    """Return how many amplitudes `search` measures at the most.

    Raises:
        InputError: no range.
    """
    _refuse_range(lowest_rad, highest_rad)
    steps = int(math.log(highest_rad / lowest_rad) / math.log(STEP) + 1e-9)
    return steps + 1 + EXTRA


def _refuse_range(lowest_rad: float, highest_rad: float) -> None:
    if not 0 < lowest_rad < highest_rad:
        raise InputError("The lowest amplitude must be above zero and below the highest one.")


class _Levels:
    """The levels measured so far."""

    def __init__(self, campaign: Campaign, bench: Bench, limits: Limits, say: Progress) -> None:
        self.levels: dict[float, MeasuredLevel] = {}
        self._campaign, self._bench, self._limits, self._say = campaign, bench, limits, say

    def measure(self, amplitude: float) -> str:
        """Measure one amplitude; return why it cannot be used, or an empty text."""
        reason = self._forbidden(amplitude)
        if reason:
            return reason
        campaign = altered(self._campaign, amplitudes_rad=(amplitude,))
        level = self._bench(campaign, f"amplitude_{1e3 * amplitude:.4f}_mrad")
        torque, position = float(level.peak[1]), float(level.peak[2])
        self._say(
            f"{1e3 * amplitude:.3g} mrad: torque peak {torque:.3g} N m, position peak "
            f"{position:.3g} rad, relative distortion "
            f"{relative_distortion(robust_bla(level.spectra, level.lines.excited)):.3g}"
        )
        if torque > self._limits.torque_nm:
            return f"the torque limit at {amplitude:.3g} rad"
        if position > self._limits.position_rad:
            return f"the position limit at {amplitude:.3g} rad"
        if not level.is_periodic:
            return f"the response is not periodic at {amplitude:.3g} rad"
        self.levels[amplitude] = level
        return ""

    def _forbidden(self, amplitude: float) -> str:
        below = [known for known in self.levels if known < amplitude]
        if not below:
            return ""
        nearest = self.levels[max(below)]
        growth = amplitude / max(below)
        if nearest.peak[1] * growth > self._limits.torque_nm:
            return f"the torque limit, expected at {amplitude:.3g} rad"
        if nearest.peak[2] * growth > self._limits.position_rad:
            return f"the position limit, expected at {amplitude:.3g} rad"
        return ""

    def passed_least(self) -> str:
        _, values = self._criterion()
        i = int(np.argmin(values))
        passed = values.size - i > 2 and values[-1] > RISE * values[i]
        return "distortion rises again" if passed else ""

    def reach_limits(self) -> None:
        """Measure once more just below the limits, if the coarse steps stopped short of them."""
        last = max(self.levels)
        _, torque, position = self.levels[last].peak
        factor = 0.95 * min(self._limits.torque_nm / torque, self._limits.position_rad / position)
        if 1.05 < factor < STEP:
            self.measure(last * factor)

    def refine(self) -> None:
        """Measure half way between the least value and its neighbours, twice."""
        for _ in range(2):
            amplitudes, values = self._criterion()
            i = int(np.argmin(values))
            for j in (i - 1, i + 1):
                if 0 <= j < amplitudes.size:
                    self.measure(float(np.sqrt(amplitudes[i] * amplitudes[j])))

    def _criterion(self) -> tuple[np.ndarray, np.ndarray]:
        amplitudes = np.array(sorted(self.levels))
        blas = [
            robust_bla(self.levels[a].spectra, self.levels[a].lines.excited) for a in amplitudes
        ]
        return amplitudes, np.array([relative_distortion(bla) for bla in blas])


def evaluate(levels: Sequence[tuple[float, MeasuredLevel]], ended_by: str) -> Search:
    """Return what levels that were measured say, by the distortion criterion and the others.

    Args:
        levels: (amplitude, level), ascending; those that are not periodic are left out.
        ended_by: why there is no higher one.

    Raises:
        InputError: no usable level.
    """
    usable = [(a, level) for a, level in levels if level.is_periodic]
    if not usable:
        raise InputError("The response is periodic at no amplitude; record lower ones.")
    amplitudes = np.array([amplitude for amplitude, _ in usable])
    blas = [robust_bla(level.spectra, level.lines.excited) for _, level in usable]
    values = np.array([relative_distortion(bla) for bla in blas])
    best = least(amplitudes, values)
    drawn = _bootstrap(amplitudes, [level for _, level in usable])
    return Search(
        amplitudes,
        values,
        best,
        interval(drawn),
        _others(amplitudes, blas, best),
        is_bracketed(amplitudes, values),
        ended_by,
    )


def _bootstrap(amplitudes: np.ndarray, levels: Sequence[MeasuredLevel]) -> np.ndarray:
    """Return best amplitudes of resampled realizations, the same ones at all levels."""
    count = min(len(level.realizations) for level in levels)

    def estimate(chosen: np.ndarray) -> float:
        values = [
            relative_distortion(robust_bla([spectra[m] for m in chosen], level.lines.excited))
            for level, spectra in zip(levels, all_spectra, strict=True)
        ]
        return least(amplitudes, np.array(values))

    all_spectra = [level.spectra for level in levels]
    return resampled(count, estimate, BOOTSTRAPS)


def _others(amplitudes: np.ndarray, blas: list[BlaEstimate], best: float) -> dict[str, float]:
    variance: Criterion = "variance"
    by_variance = least(amplitudes, np.array([relative_distortion(bla, variance) for bla in blas]))
    by_change = least(amplitudes, extrapolation_values(amplitudes, blas, best))
    return {"variance": by_variance, "extrapolation": by_change}


def bag_levels(folder: Path) -> list[tuple[float, MeasuredLevel]]:
    """Return the levels of a folder by their amplitude (rms over lines, rad), ascending.

    Raises:
        InputError: bad bags, fewer than three levels, or levels of one realization.
    """
    levels = read_levels(folder)
    if len(levels) < 3:
        raise InputError(
            f"{folder}: holds {len(levels)} levels, but three or more show where distortion is "
            "least; record more amplitudes."
        )
    if min(len(level.realizations) for level in levels) < 2:
        raise InputError(f"{folder}: each level needs two or more realizations; record more.")
    rated = [(float(np.sqrt(np.mean(level.amplitudes_rad**2))), level) for level in levels]
    return sorted(rated, key=lambda pair: pair[0])


def within(
    levels: Sequence[tuple[float, MeasuredLevel]], limits: Limits
) -> list[tuple[float, MeasuredLevel]]:
    """Return the levels whose measured peaks keep the limits.

    Raises:
        InputError: fewer than three are left.
    """
    kept = [(amplitude, level) for amplitude, level in levels if limits.allow(level)]
    if len(kept) < 3:
        raise InputError(
            f"Only {len(kept)} of {len(levels)} levels keep the torque and position limits, but "
            "three or more show where distortion is least; record lower amplitudes."
        )
    return kept
