"""What the data of each level say, and what they cannot say, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .loop import peak_sentence
from .result import BlaEstimate, LevelResult, LineLevels, Result
from .summary import (
    AT_NOISE_DB,
    SIGNIFICANCE,
    counted,
    level_name,
    mean_level_db,
    summarize,
    total_distortion,
)

ODD_DB = 6.0
"""An even part this far below the total distortion (dB) makes the distortion odd."""
DIFFERENT_LINES = 0.15
"""Share of lines at which the discs of two levels lie apart, from which on the BLA depends on the
level; by chance less than 0.05 lie apart."""


def findings(level: LevelResult) -> list[str]:
    """Return what the data of a level say, in sentences."""
    if level.bla is None:
        return ["No BLA: the data do not allow one; see the checks."]
    sentences = [
        _model_sentence(level),
        *_detection_sentences(level),
        *_total_sentences(level, level.bla),
        *_line_sentences(level, level.bla),
        peak_sentence(level.bla),
    ]
    return [sentence for sentence in sentences if sentence]


def _model_sentence(level: LevelResult) -> str:
    known = [c for c in level.comparisons if np.isfinite(c.v_mean)]
    if not known:
        return ""
    best = min(known, key=lambda c: c.v_mean)
    nearest = f"Nearest model: {best.name}" if len(known) > 1 else f"Against {best.name}"
    return f"{nearest}, V = {best.v_mean:.3g} dB\N{SUPERSCRIPT TWO}."


def _detection_sentences(level: LevelResult) -> list[str]:
    """Return one sentence for each kind of detection line, relative to its own noise."""
    linear = mean_level_db(level.excited.position)
    kinds: tuple[tuple[str, LineLevels], ...] = (("Odd", level.odd), ("Even", level.even))
    sentences = []
    for name, lines in kinds:
        power = mean_level_db(lines.corrected)
        if not np.isfinite(power):
            continue
        noise = _beside_noise(power - mean_level_db(lines.noise))
        sentences.append(f"{name} distortion {_beside_excited(power - linear)}{noise}.")
    return sentences


def _beside_excited(above_db: float) -> str:
    """Return how a level lies to that of the excited lines."""
    return f"{abs(above_db):.1f} dB {'above' if above_db > 0 else 'below'} the excited lines"


def _beside_noise(above_db: float) -> str:
    """Return how a level lies to its noise, as the end of a sentence."""
    if not np.isfinite(above_db):
        return ""
    if abs(above_db) < AT_NOISE_DB:
        return ", at the level of noise"
    return f", {abs(above_db):.1f} dB {'above' if above_db > 0 else 'below'} noise"


def _total_sentences(level: LevelResult, bla: BlaEstimate) -> list[str]:
    """Return what is known of all distortion together, and of its odd and even part."""
    total = mean_level_db(total_distortion(level))
    if not np.isfinite(total):
        return []
    noise = mean_level_db(level.excited.noise) if bla.method == "local" else np.nan
    what = "Total distortion and noise" if np.isnan(noise) else "Total distortion with its noise"
    beside = _beside_excited(total - mean_level_db(level.excited.position))
    sentences = [f"{what} {beside}{_beside_noise(total - noise)}."]
    if bla.method == "local" and np.isnan(noise):
        sentences.append(
            "Distortion and noise cannot be told apart: no run was repeated, so repeat one."
        )
    sentences.append(_parity_sentence(level, total))
    return sentences


def _parity_sentence(level: LevelResult, total_db: float) -> str:
    even_db, odd_db = (mean_level_db(lines.corrected) for lines in (level.even, level.odd))
    if np.isfinite(even_db):
        beyond = odd_db if np.isfinite(odd_db) else total_db
        if beyond - even_db >= ODD_DB:
            return f"The distortion is odd: its even part is {beyond - even_db:.1f} dB below it."
        return ""
    if np.isfinite(odd_db):
        return ""
    return (
        "Odd and even distortion cannot be told apart: no line of the band is free of excitation."
    )


def _line_sentences(level: LevelResult, bla: BlaEstimate) -> list[str]:
    """Return sentences about the lines of the BLA."""
    numbers = summarize(level)
    sentences = []
    if np.isfinite(bla.nonlinear_p_value).any():
        sentences.append(
            f"Nonlinear variance significant ({100 * SIGNIFICANCE:g} % level) at "
            f"{numbers.significant} of {numbers.lines} lines."
        )
    if numbers.unreliable:
        why = "varies too much between realizations there"
        if bla.method == "local" or bla.realizations == 1:
            why = "is too weak there beside its distortion and noise"
        sentences.append(f"{counted(numbers.unreliable, 'line')} unreliable: the torque {why}.")
    return sentences


def between_levels(result: Result) -> list[str]:
    """Return for each pair of neighbouring levels whether the BLA depends on the level."""
    known = [level for level in result.levels if level.bla is not None]
    return [_pair(one, two) for one, two in pairwise(known)]


def _pair(one: LevelResult, two: LevelResult) -> str:
    assert one.bla is not None and two.bla is not None
    names = f"{level_name(one)} and {level_name(two)}"
    g, radius, kept = _at(one.bla, two.bla)
    if not kept.size:
        return f"{names} share no frequencies."
    distance = np.abs(g - one.bla.g[kept])
    apart = float(np.mean(distance > np.hypot(radius, one.bla.radius_95[kept])))
    change = float(np.median(distance / np.abs(one.bla.g[kept])))
    if apart > DIFFERENT_LINES:
        return (
            f"{names} differ at {apart:.0%} of the lines beyond their discs (median {change:.0%} "
            "of |G|): the rig is nonlinear, its BLA depends on the level."
        )
    return f"{names} agree within their discs at {1.0 - apart:.0%} of the lines."


def _at(one: BlaEstimate, two: BlaEstimate) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return G and radius of `two` at the frequencies of `one` that lie in its band, and those."""
    f, known = one.frequency_hz, two.frequency_hz
    usable = np.isfinite(one.radius_95) & one.reliable
    kept = np.flatnonzero(usable & (f >= known[0]) & (f <= known[-1]))
    log_g = np.log(np.abs(two.g)) + 1j * np.unwrap(np.angle(two.g))
    at = np.log(f[kept])
    g = np.exp(np.interp(at, np.log(known), log_g))
    radius = np.interp(at, np.log(known), two.radius_95)
    sure = np.isfinite(radius)
    return g[sure], radius[sure], kept[sure]


def all_findings(result: Result) -> list[tuple[str, Sequence[str]]]:
    """Return (name of a level, its sentences), and what the levels say together."""
    found: list[tuple[str, Sequence[str]]] = [
        (level_name(level), findings(level)) for level in result.levels
    ]
    together = between_levels(result)
    return [*found, ("Levels", together)] if together else found
