"""The few numbers and sentences of a result that a person reads first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fjr_kit.check import Check, failed

from .result import BlaEstimate, LevelResult, LineLevels, Result

SIGNIFICANCE = 0.05
"""Below this p-value the nonlinear variance of a line counts as significant."""

AT_NOISE_DB = 2.0
"""A mean power this near to that of noise counts as noise."""

ROUND_OFF = 1e-10
"""A reference line this much weaker than the strongest one is left out of plots."""


def decibel(amplitude: np.ndarray | float) -> np.ndarray:
    """Return 20 log10 |amplitude|; NaN where the amplitude is zero or unknown."""
    size = np.abs(np.asarray(amplitude))
    size = np.where(size > 0, size, np.nan)
    return 20.0 * np.log10(size)


def phase_deg(g: np.ndarray) -> np.ndarray:
    """Return the unwrapped phase in degrees, its median within (-180, 180]; NaN stays NaN."""
    phase = np.full(len(g), np.nan)
    known = np.isfinite(g)
    if known.any():
        unwrapped = np.degrees(np.unwrap(np.angle(g[known])))
        phase[known] = unwrapped - 360.0 * np.ceil((np.median(unwrapped) - 180.0) / 360.0)
    return phase


def bla_phase_deg(level: LevelResult, bla: BlaEstimate) -> np.ndarray:
    """Return the phase of the BLA in degrees, on the branch that lies nearest to the first model.

    Unwrapping by itself would carry the phase errors of unreliable lines on to all later ones.
    """
    if not level.comparisons:
        return phase_deg(bla.g)
    g0 = level.comparisons[0].g0
    return phase_deg(g0) + np.angle(bla.g / g0, deg=True)


def signal_at(level: LevelResult, lines: LineLevels, signal: str) -> np.ndarray:
    """Return reference, torque or position at `lines`.

    The reference is NaN where it is nothing but round-off of the excited lines.
    """
    values: np.ndarray = getattr(lines, signal)
    if signal != "reference":
        return values
    floor = ROUND_OFF * np.max(level.excited.reference, initial=0.0)
    return np.where(values > floor, values, np.nan)


def significant(bla: BlaEstimate) -> np.ndarray:
    """Return where the nonlinear variance is positive and significant, bool (F,)."""
    return (bla.nonlinear_p_value < SIGNIFICANCE) & (bla.var_nonlinear > 0)


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
        linear_db, odd_db, even_db, noise_db: mean power of Y at excited lines, of Yc at odd and
            even detection lines, and of noise, in dB re 1 rad; NaN where there is none.
    """

    level: int
    name: str
    lines: int
    unreliable: int
    significant: int
    negative: int
    radius_percent: float
    linear_db: float
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
        odd_db=mean_level_db(level.odd.corrected),
        even_db=mean_level_db(level.even.corrected),
        noise_db=mean_level_db(noise_of(level)),
    )


def noise_of(level: LevelResult) -> np.ndarray:
    """Return the noise at the detection lines in rad, or at the excited ones if there are none."""
    detection = np.concatenate([level.odd.noise, level.even.noise])
    return detection if detection.size else level.excited.noise


def level_name(level: LevelResult) -> str:
    """Return the name of a level by its line amplitude, such as 'Level 0, 7 mrad'."""
    low, high = 1e3 * np.min(level.amplitude_rad), 1e3 * np.max(level.amplitude_rad)
    span = f"{high:.3g}" if np.isclose(low, high) else f"{low:.3g}-{high:.3g}"
    return f"Level {level.level}, {span} mrad"


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
    period = result.samples_per_period / result.sample_rate_hz
    f = first.excited.frequency_hz
    realizations = (
        "" if first.bla is None else f"{_count(first.bla.realizations, 'realization')} x "
    )
    method = "" if first.bla is None else f", {first.bla.method} method"
    return (
        f"{_count(levels, 'level')}, {realizations}{_count(result.periods, 'period')} of "
        f"{period:.4g} s at {result.sample_rate_hz:.6g} Hz after "
        f"{_count(result.transient_periods, 'transient period')}, {len(f)} excited lines from "
        f"{f.min():.4g} to {f.max():.4g} Hz{method}."
    )


def findings(level: LevelResult) -> list[str]:
    """Return what the data of a level say, in sentences."""
    if level.bla is None:
        return ["No BLA: the data do not allow one; see the checks."]
    return [s for s in (_model_sentence(level), *_distortion_sentences(level), *_lines(level)) if s]


def _model_sentence(level: LevelResult) -> str:
    known = [c for c in level.comparisons if np.isfinite(c.v_mean)]
    if not known:
        return ""
    best = min(known, key=lambda c: c.v_mean)
    nearest = f"Nearest model: {best.name}" if len(known) > 1 else f"Against {best.name}"
    return f"{nearest}, V = {best.v_mean:.3g} dB\N{SUPERSCRIPT TWO}."


def _distortion_sentences(level: LevelResult) -> list[str]:
    """Return one sentence for each kind of detection line, relative to its own noise."""
    linear = mean_level_db(level.excited.position)
    kinds: tuple[tuple[str, LineLevels], ...] = (("Odd", level.odd), ("Even", level.even))
    sentences = []
    for name, lines in kinds:
        power = mean_level_db(lines.corrected)
        if not np.isfinite(power):
            continue
        noise = _beside_noise(power - mean_level_db(lines.noise))
        below = linear - power
        sentences.append(f"{name} distortion {below:.1f} dB below the excited lines{noise}.")
    return sentences


def _beside_noise(above_db: float) -> str:
    """Return how a level lies to its noise, as the end of a sentence."""
    if not np.isfinite(above_db):
        return ""
    if abs(above_db) < AT_NOISE_DB:
        return ", at the level of noise"
    return f", {abs(above_db):.1f} dB {'above' if above_db > 0 else 'below'} noise"


def _lines(level: LevelResult) -> list[str]:
    """Return sentences about the lines of the BLA."""
    numbers = summarize(level)
    sentences = []
    if level.bla is not None and np.isfinite(level.bla.nonlinear_p_value).any():
        sentences.append(
            f"Nonlinear variance significant ({100 * SIGNIFICANCE:g} % level) at "
            f"{numbers.significant} of {numbers.lines} lines."
        )
    if level.bla is not None and numbers.unreliable:
        why = "varies too much between realizations there"
        if level.bla.realizations == 1:
            why = "is too weak there beside its distortion and noise"
        lines = _count(numbers.unreliable, "line")
        sentences.append(f"{lines} unreliable: the torque {why}.")
    return sentences


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
