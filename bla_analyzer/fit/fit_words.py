"""What a fitted model says, and what it cannot say, in sentences."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.stats import binom

from .fit_types import Fit, Interval, LevelFit, OutputFit, Root
from .physical import MEANINGS

SIGNIFICANCE = 0.05
SHARED = (
    "The local polynomial method estimated neighbouring lines from common windows: their errors "
    "are alike, so intervals are too narrow and the residual is not white; analyze by the robust "
    "or the fast method if you can."
)
OUTPUT_WORDS = {"motor_position": "motor position", "link_position": "link position"}
OSCILLATES = 1.0 - 1e-6
"""Damping ratio below which a root is one of a pair."""


def findings(fit: LevelFit, shared: bool) -> list[str]:
    """Return what the fit of a level says, in sentences.

    Args:
        fit: the level.
        shared: whether neighbouring lines were estimated from common data.
    """
    return [
        _order_sentence(fit),
        _whiteness_sentence(fit),
        *(_disc_sentence(one) for one in fit.outputs),
        *_notes(fit),
        *([SHARED] if shared else []),
    ]


def _order_sentence(fit: LevelFit) -> str:
    test = fit.test
    span = f"{test.expected:.4g} expected (95 %: {test.low:.4g} to {test.high:.4g})"
    said = f"Cost {test.cost:.4g}, {span}"
    if test.cost > test.high:
        return (
            f"{said}: the model does not explain the BLA within its variance, so all intervals are "
            f"widened by {fit.widening:.3g}."
        )
    if test.cost < test.low:
        return f"{said}: less than variances let expect, so these are rather too large."
    return f"{said}: the model explains the BLA within its variance."


def _whiteness_sentence(fit: LevelFit) -> str:
    white, lags = fit.whiteness, fit.whiteness.correlation.size
    beyond = f"{white.outside} of {lags} lags beyond the 95 % bound, p = {white.p_value:.2g}"
    if white.p_value < SIGNIFICANCE:
        return f"The residual is not white ({beyond}): what is left of it has a shape."
    return f"The residual is white ({beyond})."


def _disc_sentence(fit: OutputFit) -> str:
    """Say where the residual exceeds the discs, and whether distortion is behind it."""
    what = OUTPUT_WORDS[fit.output].capitalize()
    outside = fit.p_value < SIGNIFICANCE
    count, lines = int(outside.sum()), outside.size
    by_chance = SIGNIFICANCE * lines
    where = f"the model lies outside the 95 % disc at {count} of {lines} lines"
    if binom.sf(count - 1, lines, SIGNIFICANCE) > SIGNIFICANCE:
        return f"{what}: {where}, no more than chance."
    nonlinear = int((outside & fit.nonlinear_dominates).sum())
    f = fit.frequency_hz[outside]
    said = f"{what}: {where} ({by_chance:.2g} by chance), from {f.min():.4g} to {f.max():.4g} Hz"
    if nonlinear > 0.5 * count:
        return (
            f"{said}; at {nonlinear} of these, nonlinear distortion outweighs noise, so nonlinear "
            "bias exceeds the discs there: no linear model of this form is the rig's, and more "
            "data will not bring them together."
        )
    return f"{said}; distortion does not dominate there, so a higher order may explain it."


def _notes(fit: LevelFit) -> list[str]:
    notes = []
    if fit.noise_only:
        notes.append(
            "No line was left free, so distortion is unknown: weights and intervals are those of "
            "noise alone and too narrow where the rig is nonlinear."
        )
    if fit.left_out_hz.size:
        notes.append(
            f"{fit.left_out_hz.size} unreliable lines were left out, from "
            f"{fit.left_out_hz.min():.4g} to {fit.left_out_hz.max():.4g} Hz."
        )
    unstable = [pole for pole in fit.poles if pole.damping_ratio.high < 0]
    if unstable:
        words = ", ".join(f"{pole.frequency_hz.value:.4g} Hz" for pole in unstable)
        low = fit.outputs[0].frequency_hz.min()
        where = " below the band" if all(p.frequency_hz.value < low for p in unstable) else ""
        notes.append(
            f"The model has poles{where} that are unstable beyond their intervals ({words})."
        )
    unknown = [name for name, one in fit.parameters.items() if _unknown(one)]
    if unknown:
        notes.append(
            f"The BLA does not tell {', '.join(unknown)}: the interval holds zero, or a factor "
            "of two and more."
        )
    return notes


def _unknown(one: Interval) -> bool:
    return one.low <= 0 or one.high > 2.0 * one.value


def pairs(roots: Sequence[Root]) -> list[Root]:
    """Return one root of each pair that oscillates: resonances or antiresonances."""
    return [r for r in roots if abs(r.damping_ratio.value) < OSCILLATES and r.im > 0]


def headline(fit: Fit) -> str:
    """Return in one sentence whether the models explain the BLAs."""
    passed = sum(level.test.passed for level in fit.levels)
    count = len(fit.levels)
    does = "explains" if passed or count > 1 else "does not explain"
    what = f"The {fit.model} model {does} the BLA within its variance"
    return f"{what}." if count == 1 else f"{what} at {passed} of {count} levels."


def quantities(level: LevelFit) -> list[tuple[str, Interval]]:
    """Return what a reader wants first, by name: parameters, delay, modes, gains."""
    found = [(f"{name}, {MEANINGS[name]}", one) for name, one in level.parameters.items()]
    if level.delay_s.std > 0:
        found.append(("delay", level.delay_s))
    for number, pole in enumerate(pairs(level.poles), start=1):
        found.append((f"resonance {number}", pole.frequency_hz))
        found.append((f"resonance {number}: damping", pole.damping_ratio))
    for one in level.outputs:
        where = f", {one.output.partition('_')[0]}" if len(level.outputs) > 1 else ""
        for number, zero in enumerate(pairs(one.zeros), start=1):
            found.append((f"antiresonance {number}{where}", zero.frequency_hz))
            found.append((f"antiresonance {number}{where}: damping", zero.damping_ratio))
        found.append((f"gain{where}", one.gain))
    return found


def between_levels(fits: Sequence[LevelFit]) -> list[str]:
    """Return for each pair of neighbouring levels which quantities differ beyond intervals."""
    return [_pair(one, two) for one, two in pairwise(fits)]


def _pair(one: LevelFit, two: LevelFit) -> str:
    first, second = _quantities(one), _quantities(two)
    common = [name for name in first if name in second]
    changed = [
        f"{name} {first[name].value:.4g} to {second[name].value:.4g} {first[name].unit}".rstrip()
        for name in common
        if abs(first[name].value - second[name].value)
        > np.hypot(_half(first[name]), _half(second[name]))
    ]
    names = f"{one.name} and {two.name}"
    if not changed:
        return f"{names}: no quantity differs beyond its interval."
    return (
        f"{names}: {len(changed)} of {len(common)} quantities differ beyond their intervals "
        f"({'; '.join(changed)}): the rig is nonlinear, each model holds for its level."
    )


def _half(one: Interval) -> float:
    return 0.5 * (one.high - one.low)


def _quantities(fit: LevelFit) -> dict[str, Interval]:
    """Return the parameters of a physical model, or the resonances of a rational one."""
    if fit.parameters:
        return fit.parameters
    found = {}
    kinds = [("resonance", fit.poles), ("antiresonance", fit.outputs[0].zeros)]
    for what, roots in kinds:
        for number, root in enumerate(pairs(roots), start=1):
            found[f"{what} {number}"] = root.frequency_hz
    return found
