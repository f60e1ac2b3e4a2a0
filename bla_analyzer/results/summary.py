"""The few numbers and sentences of a result that a person reads first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fjr_kit.check import Check, failed

from .result import BlaEstimate, LevelResult, LineLevels, Method, Result

SIGNIFICANCE = 0.05
"""Below this p-value the nonlinear variance of a line counts as significant."""

AT_NOISE_DB = 2.0
"""A mean power this near to that of noise counts as noise."""

METHODS: dict[Method, str] = {
    "robust": "robust method",
    "fast": "fast method",
    "local": "local polynomial method",
}

ROUND_OFF = 1e-10
"""A reference line this much weaker than the strongest one is left out of plots."""


def decibel(amplitude: np.ndarray | float) -> np.ndarray:
    """Return 20 log10 |amplitude|; NaN where the amplitude is zero or unknown."""
    size = np.abs(np.asarray(amplitude))
    size = np.where(size > 0, size, np.nan)
    return 20.0 * np.log10(size)


def phase_deg(g: np.ndarray) -> np.ndarray:
    """Return the unwrapped phase in degrees; NaN stays NaN.

    The median of the lowest fifth of the lines lies within (-270, 90]: masses turn a torque by
    -180 degrees there, so that motor and link begin on one branch, and none at the edge of two.
    """
    phase = np.full(len(g), np.nan)
    known = np.isfinite(g)
    if known.any():
        unwrapped = np.degrees(np.unwrap(np.angle(g[known])))
        low = np.median(unwrapped[: -(-unwrapped.size // 5)])
        phase[known] = unwrapped - 360.0 * np.ceil((low - 90.0) / 360.0)
    return phase


def bla_phase_deg(level: LevelResult, bla: BlaEstimate) -> np.ndarray:
    """Return the phase of the BLA in degrees, on the branch that lies nearest to the first model.

    Unwrapping by itself would carry the phase errors of unreliable lines on to all later ones.
    """
    if not level.comparisons:
        return phase_deg(bla.g)
    g0 = level.comparisons[0].g0
    return phase_deg(g0) + np.angle(bla.g / g0, deg=True)


def magnitude_band_db(g: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return least and greatest magnitude within the discs, in dB; open below 20 dB under |G|."""
    size = np.abs(g)
    return decibel(np.maximum(size - radius, 0.1 * size)), decibel(size + radius)


def phase_reach_deg(g: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return how far the phase reaches within the discs, in degrees; 180 where they hold zero."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = radius / np.abs(g)
    reach = np.degrees(np.arcsin(np.minimum(ratio, 1.0)))
    return np.where(ratio >= 1.0, 180.0, reach)


def signal_at(level: LevelResult, lines: LineLevels, signal: str) -> np.ndarray:
    """Return reference, torque or position at `lines`.

    The reference is NaN where it is nothing but round-off of the excited lines.
    """
    values: np.ndarray = getattr(lines, signal)
    if signal != "reference":
        return values
    floor = ROUND_OFF * np.max(level.excited.reference, initial=0.0)
    return np.where(values > floor, values, np.nan)


def shown_signals(level: LevelResult) -> list[tuple[str, str]]:
    """Return the signals whose spectra are known, with units; position is the last."""
    played = np.isfinite(level.excited.reference).any()
    return [("reference", "rad")] * bool(played) + [("torque", "N m"), ("position", "rad")]


def significant(bla: BlaEstimate) -> np.ndarray:
    """Return where the nonlinear variance is positive and significant, bool (F,)."""
    return (bla.nonlinear_p_value < SIGNIFICANCE) & (bla.var_nonlinear > 0)


def total_distortion(level: LevelResult) -> np.ndarray:
    """Return the rms of distortion and noise in y at the excited lines of one realization, rad.

    The answer of the loop to them is taken away; by the coherence, NaN where that is unknown or
    the line is not reliable, as G and with it that answer are not known there.
    """
    if level.bla is None:
        return np.full(level.excited.position.shape, np.nan)
    with np.errstate(divide="ignore"):
        rest = 1.0 / level.bla.coherence - 1.0
    known = np.abs(level.bla.g) * level.excited.torque * np.sqrt(rest)
    return np.where(level.bla.reliable, known, np.nan)


def mean_level_db(amplitude: np.ndarray) -> float:
    """Return the level of the mean power of lines in dB; NaN if no line is known."""
    known = amplitude[np.isfinite(amplitude)]
    return float(decibel(np.sqrt(np.mean(known**2)))) if known.size else float("nan")


@dataclass(frozen=True)
class LevelSummary:
    """Key numbers of a level.

    Attributes:
        name: such as 'Level 0, 7 mrad'.
        lines, unreliable: excited lines, and those whose Var(U)/|U|^2 is not small.
        significant, negative: lines whose nonlinear variance is significant, or negative.
        radius_percent: median over lines of the 95 % disc radius over |G|, in percent.
        linear_db, total_db, odd_db, even_db, noise_db: mean power of Y at excited lines, of
            distortion and noise at the reliable ones, of Yc at odd and even detection lines, and of
            noise, in dB re 1 rad; NaN where there is none.
    """

    level: int
    name: str
    lines: int
    unreliable: int
    significant: int
    negative: int
    radius_percent: float
    linear_db: float
    total_db: float
    odd_db: float
    even_db: float
    noise_db: float


def summarize(level: LevelResult) -> LevelSummary:
    """Return the key numbers of a level."""
    bla = level.bla
    radius = bla.radius_95 / np.abs(bla.g) if bla is not None else np.empty(0)
    radius = radius[np.isfinite(radius)]
    return LevelSummary(
        level=level.level,
        name=level_name(level),
        lines=len(level.excited.frequency_hz),
        unreliable=int((~bla.reliable).sum()) if bla is not None else 0,
        significant=int(significant(bla).sum()) if bla is not None else 0,
        negative=int((bla.var_nonlinear < 0).sum()) if bla is not None else 0,
        radius_percent=100.0 * float(np.median(radius)) if radius.size else float("nan"),
        linear_db=mean_level_db(level.excited.position),
        total_db=mean_level_db(total_distortion(level)),
        odd_db=mean_level_db(level.odd.corrected),
        even_db=mean_level_db(level.even.corrected),
        noise_db=mean_level_db(noise_of(level)),
    )


def noise_of(level: LevelResult) -> np.ndarray:
    """Return the noise at the detection lines in rad, or at the excited ones if there are none."""
    detection = np.concatenate([level.odd.noise, level.even.noise])
    return detection if detection.size else level.excited.noise


def amplitudes_rad(result: Result) -> np.ndarray:
    """Return the rms over lines of the amplitude of each level, rad; NaN without lines."""
    return np.array(
        [
            np.sqrt(np.mean(level.amplitude_rad**2)) if level.amplitude_rad.size else np.nan
            for level in result.levels
        ]
    )


def v_by_model(result: Result) -> dict[str, np.ndarray]:
    """Return V of each model at each level, dB^2, (levels,); NaN where it was not compared."""
    found = [{c.name: c.v_mean for c in level.comparisons} for level in result.levels]
    names = dict.fromkeys(name for values in found for name in values)
    return {name: np.array([values.get(name, np.nan) for values in found]) for name in names}


def level_name(level: LevelResult) -> str:
    """Return the name of a level, such as 'Level 0, 7 mrad', by its line amplitude or its rms."""
    if not level.amplitude_rad.size or not np.isfinite(level.reference_rms_rad):
        return f"Level {level.level}"
    if level.bla is not None and level.bla.method == "local":
        return f"Level {level.level}, {_angles(level.reference_rms_rad)} rms"
    low, high = float(np.min(level.amplitude_rad)), float(np.max(level.amplitude_rad))
    return f"Level {level.level}, {_angles(*((high,) if np.isclose(low, high) else (low, high)))}"


def _angles(*rad: float) -> str:
    """Return an angle or a span of angles (rad) in mrad, or in rad from 1 rad on."""
    unit, scale = ("rad", 1.0) if max(rad) >= 1.0 else ("mrad", 1e3)
    return f"{'-'.join(f'{scale * value:.3g}' for value in rad)} {unit}"


def failed_checks(result: Result) -> tuple[Check, ...]:
    """Return the checks that did not pass."""
    return failed(result.checks)


def headline(result: Result) -> str:
    """Return the verdict on the data in one sentence."""
    bad, total = len(failed_checks(result)), len(result.checks)
    if not total:
        return "No checks of the data were made."
    if not bad:
        return "The one check of the data passed." if total == 1 else f"All {total} checks passed."
    return f"{bad} of {total} checks failed: read them before you use the numbers."


def campaign(result: Result) -> str:
    """Return what was analysed in one sentence."""
    levels, first = len(result.levels), result.levels[0]
    seconds = result.samples_per_period / result.sample_rate_hz
    f = first.excited.frequency_hz
    span = f"{f.min():.4g} to {f.max():.4g} Hz" if f.size else "none"
    method = "" if first.bla is None else f", {METHODS[first.bla.method]}"
    if result.excitation != "periodic":
        again = " that repeat references" if result.excitation == "repeated" else ""
        return (
            f"Excitation without period: {counted(levels, 'level')}, "
            f"{counted(len(result.bags), 'record')}{again}, of up to {seconds:.4g} s at "
            f"{result.sample_rate_hz:.6g} Hz, {len(f)} frequencies, {span}{method}."
        )
    realizations = (
        "" if first.bla is None else f"{counted(first.bla.realizations, 'realization')} x "
    )
    return (
        f"Periodic excitation: {counted(levels, 'level')}, {realizations}"
        f"{counted(result.periods, 'period')} of {seconds:.4g} s at {result.sample_rate_hz:.6g} Hz "
        f"after {counted(result.transient_periods, 'transient period')}, {len(f)} excited lines "
        f"from {span}{method}."
    )


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural where it must be."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
