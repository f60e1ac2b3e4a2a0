"""Two campaigns: BLAs, distortion and noise, at the lines and amplitudes that both have."""

from __future__ import annotations

import numpy as np
from scipy.special import digamma
from scipy.stats import f as f_law
from scipy.stats import ttest_1samp

from bla_analyzer.results.result import BlaEstimate, LevelResult, LineLevels, Result
from bla_analyzer.results.summary import level_name, total_distortion
from fjr_kit.errors import InputError

from .result import BlaDifference, LevelDifference, Pair, PowerDifference, PowerKind
from .statistics import complex_p, degrees_of, fisher, holm, welch

SAME_AMPLITUDE = 0.02
"""Relative difference of amplitudes up to which two levels are one."""
_SAME_RATE = 1e-6
_SAME_LINE = 1e-6
_ROUNDING_RAD = 1e-15  # amplitudes below are rounding of the arithmetic: no encoder measures them
_FEWEST_LINES = 8  # shared lines from which on a change of power is tested


def compared_campaigns(first: Result, other: Result, false_alarm: float) -> Pair:
    """Return what differs between two campaigns.

    Args:
        first: the campaign that the other is held against.
        other: the other one.
        false_alarm: rate at which one line of a level may be marked without a change.

    Raises:
        InputError: other rates, no BLA, no amplitude or no line in common.
    """
    a, b = first.source, other.source
    rates = first.sample_rate_hz, other.sample_rate_hz
    if abs(rates[0] - rates[1]) > _SAME_RATE * rates[0]:
        raise InputError(
            f"{a} was sampled at {rates[0]:.6g} Hz and {b} at {rates[1]:.6g} Hz, so that their "
            "BLAs under held torque differ by that alone; compare campaigns of one rate."
        )
    for result in (first, other):
        if all(level.bla is None for level in result.levels):
            raise InputError(f"{result.source} allows no BLA, so there is nothing to compare.")
    shared = _shared_levels(first, other)
    if not shared:
        raise InputError(
            f"{a} and {b} have no amplitude in common ({_amplitudes(first)} against "
            f"{_amplitudes(other)} mrad); the BLA depends on it, so record both at one."
        )
    levels = [_level(one, two, false_alarm) for one, two in shared]
    found = [level for level in levels if level is not None]
    if not found:
        raise InputError(
            f"{a} and {b} have no reliable line in common; record both on one grid of lines."
        )
    unjudged = any(level.p_value is None for level in found)
    return Pair(other=b, levels=found, notes=_notes(first, other, len(found), unjudged))


def amplitude(level: LevelResult) -> float:
    """Return what a level is known by: its amplitude of a line, or its rms without lines (rad)."""
    local = level.bla is not None and level.bla.method == "local"
    if level.amplitude_rad.size and not local:
        return float(np.sqrt(np.mean(level.amplitude_rad**2)))
    return float(level.reference_rms_rad)


def _amplitudes(result: Result) -> str:
    return ", ".join(f"{1e3 * amplitude(level):.3g}" for level in result.levels)


def _shared_levels(first: Result, other: Result) -> list[tuple[LevelResult, LevelResult]]:
    pairs = []
    for one in first.levels:
        mine = amplitude(one)
        near = [two for two in other.levels if abs(amplitude(two) - mine) <= SAME_AMPLITUDE * mine]
        if one.bla is not None and near and near[0].bla is not None:
            pairs.append((one, near[0]))
    return pairs


def _notes(first: Result, other: Result, levels: int, grids_differ: bool) -> list[str]:
    notes = []
    most = max(len(first.levels), len(other.levels))
    if levels < most:
        notes.append(f"Only {levels} of {most} levels are in both; the others are not compared.")
    if first.controller != other.controller:
        notes.append(
            "The controllers differ, so the torques do; of a nonlinear rig the BLA may differ by "
            "that alone."
        )
    if grids_differ:
        notes.append(
            "The excited lines differ: those that are shared are shown, but not judged, since BLA, "
            "distortion and noise of a nonlinear rig depend on which lines are excited."
        )
    return notes


def _shared(one: np.ndarray, two: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of frequencies that both have."""
    if not one.size or not two.size:
        return np.empty(0, int), np.empty(0, int)
    nearest = np.abs(one[:, None] - two[None, :]).argmin(axis=1)
    same = np.abs(two[nearest] - one) <= _SAME_LINE * np.abs(one)
    return np.flatnonzero(same), nearest[same]


def _level(one: LevelResult, two: LevelResult, false_alarm: float) -> LevelDifference | None:
    assert one.bla is not None and two.bla is not None
    i, j = _shared(one.bla.frequency_hz, two.bla.frequency_hz)
    one_grid = i.size == one.bla.frequency_hz.size == two.bla.frequency_hz.size
    usable = _known(one.bla, i) & _known(two.bla, j)
    i, j = i[usable], j[usable]
    if not i.size:
        return None
    g = one.bla.g[i], two.bla.g[j]
    variances = one.bla.var_total[i], two.bla.var_total[j]
    degrees = (
        degrees_of(one.bla.radius_95[i], variances[0]),
        degrees_of(two.bla.radius_95[j], variances[1]),
    )
    n, variance = welch(variances, degrees), variances[0] + variances[1]
    difference = g[1] - g[0]
    p = complex_p(difference, variance, n)
    adjusted = holm(p)
    p_lines, p_all = float(adjusted.min()), fisher(p)
    excess = np.mean((np.abs(difference) ** 2 - variance) / np.abs(g[0]) ** 2)
    return LevelDifference(
        name=level_name(one),
        bla=BlaDifference(
            frequency_hz=one.bla.frequency_hz[i],
            g_first=g[0],
            g_other=g[1],
            radius_95=np.sqrt(variance * n * np.expm1(-np.log(0.05) / n)),
            p_value=p,
            changed=adjusted <= false_alarm,
        ),
        change_percent=100.0 * float(np.sqrt(max(excess, 0.0))),
        worst_hz=float(one.bla.frequency_hz[i][p.argmin()]),
        p_lines=p_lines,
        p_all=p_all,
        p_value=min(1.0, 2.0 * min(p_lines, p_all)) if one_grid else None,
        powers=_powers(one, two, one_grid),
    )


def _known(bla: BlaEstimate, at: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        known = np.isfinite(bla.radius_95[at]) & (bla.var_total[at] > 0.0)
    return np.asarray(known & bla.reliable[at])


def _powers(one: LevelResult, two: LevelResult, one_grid: bool) -> list[PowerDifference]:
    """Return the changes of the kinds of power that both levels know."""
    found = []
    kinds: tuple[PowerKind, ...] = ("total", "odd", "even", "noise")
    for kind in kinds:
        mine, theirs = _power(one, kind), _power(two, kind)
        i, j = _shared(mine[0], theirs[0])
        pair = mine[1][i], theirs[1][j]
        known = (pair[0] > _ROUNDING_RAD**2) & (pair[1] > _ROUNDING_RAD**2)
        if known.any():
            degrees = _degrees(one, kind), _degrees(two, kind)
            powers = pair[0][known], pair[1][known]
            found.append(_power_difference(kind, *powers, degrees, one_grid))
    return found


def _power(level: LevelResult, kind: PowerKind) -> tuple[np.ndarray, np.ndarray]:
    """Return the frequencies of a kind of line, and the power there; 0 where it is not known."""
    if kind == "total":
        f, amplitudes = level.excited.frequency_hz, total_distortion(level)
    elif kind == "noise":
        f, amplitudes = level.excited.frequency_hz, level.excited.noise
    else:
        lines: LineLevels = getattr(level, kind)
        f, amplitudes = lines.frequency_hz, lines.corrected
    return f, np.nan_to_num(np.square(amplitudes))


def _degrees(level: LevelResult, kind: PowerKind) -> float:
    """Return the complex degrees of freedom of the power at a line."""
    assert level.bla is not None
    realizations, periods = level.bla.realizations, level.bla.periods
    if kind == "noise":
        return float(max(realizations * (periods - 1), 1))
    return float(max(realizations - 1, 1) if kind == "total" else realizations)


def _power_difference(
    kind: PowerKind,
    one: np.ndarray,
    two: np.ndarray,
    degrees: tuple[float, float],
    judged: bool,
) -> PowerDifference:
    """Return the change of the mean level of lines.

    The logarithm of a mean of n squared normal numbers lies digamma(n) - ln n too low on average,
    which is taken away. Noise of one line has nothing to do with that of another: a t-test over
    lines. Distortion of all lines rises and falls together with the realization: an F-test in which
    only realizations count, as if there were one line.
    """
    bias = [digamma(n) - np.log(n) for n in degrees]
    logs = np.log(one) - bias[0], np.log(two) - bias[1]
    change = logs[1] - logs[0]
    p = None
    if judged and change.size >= _FEWEST_LINES and float(np.ptp(change)) > 0.0:
        p = float(ttest_1samp(change, 0.0).pvalue)
    if judged and kind != "noise":
        ratio = float(np.exp(change.mean()))
        sides = [law(ratio, 2.0 * degrees[1], 2.0 * degrees[0]) for law in (f_law.cdf, f_law.sf)]
        p = min(1.0, 2.0 * float(min(sides)))
    in_db = 10.0 / np.log(10.0)
    return PowerDifference(
        kind=kind,
        first_db=in_db * float(logs[0].mean()),
        other_db=in_db * float(logs[1].mean()),
        change_db=in_db * float(change.mean()),
        lines=int(change.size),
        p_value=p,
    )
