"""What `fjr diagnose` prints: verdict, effects with parameters, gap, and when not to believe it."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from rich.console import Console

from fjr_kit.terminal import print_table
from gap_diagnosis.outcome.diagnosis import Diagnosis, Gap
from gap_diagnosis.outcome.verdict_words import (
    HELD_OUT,
    WORDS,
    closed,
    explains,
    explanation,
    headline,
    meaning,
    summaries,
    unit_of,
)

RANKED = 5
"""How many explanations the summary on the terminal shows."""


def print_summary(diagnosis: Diagnosis, console: Console, out: Path) -> None:
    """Print verdict, what it means, effects with parameters, gap and what a reader must see."""
    words = WORDS[diagnosis.verdict]
    sure = f"(verdict: {diagnosis.verdict}, confidence {diagnosis.confidence:.0%})"
    _say(console, f"{headline(diagnosis)} {sure}")
    _say(console, f"{meaning(diagnosis)} {words.action}")
    for sentence in summaries(diagnosis):
        _say(console, sentence)
    if diagnosis.effects:
        print_table(console, *_parameters(diagnosis), left=("unit",))
    if diagnosis.gap.nominal is not None:
        print_table(console, *_gaps(diagnosis))
        if share := closed(diagnosis):
            _say(console, share)
    if diagnosis.ranking and diagnosis.verdict in ("ambiguous", "unexplained"):
        print_table(console, *_ranking(diagnosis))
    if diagnosis.next_experiment is not None:
        _say(console, f"Next experiment: {diagnosis.next_experiment.description}")
    for note in diagnosis.notes:
        _say(console, f"Note: {note}")
    _say(console, f"When not to believe it: {words.doubt}")
    if diagnosis.parameters:
        _say(console, f"Better simulation: fjr simulate --rig {shlex.quote(str(out))}/updated.yaml")


def _say(console: Console, sentence: str) -> None:
    console.print(sentence, highlight=False, markup=False)


Content = tuple[list[tuple[str, str]], list[list[str]]]
"""Heads and rows of a table."""


def _parameters(diagnosis: Diagnosis) -> Content:
    """Return the parameters of the named effects with their 95 % intervals."""
    heads = [("parameter", ""), ("value", ""), ("95 % interval", ""), ("unit", "")]
    rows = [
        [name, f"{e.value:.4g}", f"{e.low:.4g} to {e.high:.4g}", unit_of(name)]
        for name, e in diagnosis.parameters.items()
        if "." in name
    ]
    return heads, rows


def _gaps(diagnosis: Diagnosis) -> Content:
    """Return the gap at each stage."""
    gap = f"{HELD_OUT[diagnosis.reported_on]} gap"
    heads = [(gap, ""), ("position", "%"), ("torque", "%"), ("misfit/dof", "")]
    stages: dict[str, Gap | None] = {
        "nominal": diagnosis.gap.nominal,
        "refit": diagnosis.gap.refit,
    }
    if explains(diagnosis):
        name = explanation(diagnosis.effects) if diagnosis.effects else "best explanation"
        stages[f"with {name}" if diagnosis.effects else name] = diagnosis.gap.explained
    stages["noise floor"] = diagnosis.gap.noise_floor
    rows = []
    for name, gap_there in stages.items():
        if gap_there is not None:
            shares = [_percent(gap_there.nrmse_position), _percent(gap_there.nrmse_torque)]
            rows.append([name, *shares, _number(gap_there.chi2_per_dof)])
    return heads, rows


def _ranking(diagnosis: Diagnosis) -> Content:
    misfit = f"{HELD_OUT[diagnosis.reported_on]} misfit/dof"
    heads = [("explanation", ""), (misfit, ""), ("converged", "")]
    rows = [
        [explanation(c.effects), _number(c.held_out_chi2), "yes" if c.converged else "no"]
        for c in diagnosis.ranking[:RANKED]
    ]
    return heads, rows


def _percent(value: float | None) -> str:
    return _number(None if value is None else 100.0 * value)


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"
