"""What `fjr diagnose` prints: verdict, effects with parameters, gap, and when not to believe it."""

from __future__ import annotations

import shlex
from pathlib import Path

from rich.console import Console

from fjr_kit.number_text import three_digits
from fjr_kit.terminal import print_table
from gap_diagnosis.outcome.cause_words import (
    cause_name,
    choice_sentences,
    contender_names,
    digits,
    evidence_sentences,
    percent,
    remainder_sentences,
    share_sentences,
    share_words,
    summaries_with_telltales,
)
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.outcome.verdict_words import (
    HELD_OUT,
    action,
    closed,
    doubt,
    explanation,
    headline,
    is_better,
    meaning,
    unit_of,
)

RANKED = 5
"""How many explanations beside the chosen one the summary on the terminal shows."""


def print_summary(diagnosis: Diagnosis, console: Console, out: Path, *, runs: bool = True) -> None:
    """Print verdict, what it means, effects with parameters, gap and what a reader must see.

    Args:
        diagnosis: the result.
        console: where to.
        out: the folder of the results.
        runs: whether `updated.yaml` holds a controller, so that it can be simulated as it is.
    """
    sure = f"(verdict: {diagnosis.verdict}, confidence {diagnosis.confidence:.0%})"
    _say(console, f"{headline(diagnosis)} {sure}")
    _say(console, f"{meaning(diagnosis)} {action(diagnosis)}")
    for sentence in summaries_with_telltales(diagnosis):
        _say(console, sentence)
    if diagnosis.causes:
        print_table(console, *_causes(diagnosis))
        for sentence in share_sentences(diagnosis):
            _say(console, sentence)
    if diagnosis.effects:
        print_table(console, *_parameters(diagnosis), left=("unit",))
    if diagnosis.steps:
        print_table(console, *_steps(diagnosis))
        if share := closed(diagnosis):
            _say(console, share)
    if sentences := remainder_sentences(diagnosis):
        _say(console, f"Remainder: {' '.join(sentences)}")
    if diagnosis.evidence is not None:
        _say(console, f"Evidence: {' '.join(evidence_sentences(diagnosis.evidence))}")
    if diagnosis.contenders and (diagnosis.effects or diagnosis.verdict == "unexplained"):
        print_table(console, *_contenders(diagnosis))
        for sentence in choice_sentences(diagnosis):
            _say(console, sentence)
    if diagnosis.next_experiment is not None:
        _say(console, f"Next experiment: {diagnosis.next_experiment.description}")
    for note in diagnosis.notes:
        _say(console, f"Note: {note}")
    _say(console, f"When not to believe it: {doubt(diagnosis)}")
    if diagnosis.parameters and is_better(diagnosis):
        place = f"{shlex.quote(str(out))}/updated.yaml"
        if runs:
            _say(console, f"Better simulation: fjr simulate --rig {place}")
        else:
            _say(
                console,
                f"Better simulation: {place}. It holds no controller, since the recorded one is "
                "unknown or no pd_filtered law: add yours before fjr simulate, or take the joint "
                f"elsewhere by fjr export{' --linear' if diagnosis.linear else ''}.",
            )


def _say(console: Console, sentence: str) -> None:
    console.print(sentence, highlight=False, markup=False)


Content = tuple[list[tuple[str, str]], list[list[str]]]
"""Heads and rows of a table."""


def _parameters(diagnosis: Diagnosis) -> Content:
    """Return the parameters of the named effects with their 95 % intervals."""
    heads = [("parameter", ""), ("value", ""), ("95 % interval", ""), ("unit", "")]
    rows = [
        [name, value, f"{low} to {high}", unit_of(name, linear=diagnosis.linear)]
        for name, e in diagnosis.parameters.items()
        if "." in name
        for value, low, high in [digits(e)]
    ]
    return heads, rows


def _causes(diagnosis: Diagnosis) -> Content:
    """Return the named causes, greatest share first."""
    heads = [("cause", ""), ("present", ""), ("share of the gap (95 %)", "")]
    rows = [
        [cause_name(cause), percent(cause.present), share_words(cause.share)]
        for cause in diagnosis.causes
    ]
    return heads, rows


def _steps(diagnosis: Diagnosis) -> Content:
    """Return the gap from step to step."""
    gap = f"{HELD_OUT[diagnosis.reported_on]} gap"
    heads = [(gap, ""), ("position", "%"), ("torque", "%"), ("misfit/dof", "")]
    rows = []
    for step in diagnosis.steps:
        name = f"with {explanation([step.added])}" if step.added else step.stage
        shares = [_percent(step.nrmse_position), _percent(step.nrmse_torque)]
        rows.append([name, *shares, three_digits(step.chi2_per_dof)])
    floor = diagnosis.gap.noise_floor
    if floor is not None:
        shares = [_percent(floor.nrmse_position), _percent(floor.nrmse_torque)]
        rows.append(["noise floor", *shares, three_digits(floor.chi2_per_dof)])
    return heads, rows


def _contenders(diagnosis: Diagnosis) -> Content:
    """Return the explanations that the verdict chose among, the chosen one first."""
    heads = [
        ("explanation", ""),
        ("misfit/dof", "selecting data"),
        ("gain", "nats"),
        ("converged", ""),
    ]
    found = zip(contender_names(diagnosis), diagnosis.contenders, strict=True)
    rows = [
        [
            name,
            three_digits(c.held_out_chi2),
            three_digits(c.gain) if place else "-",
            "yes" if c.converged else "no",
        ]
        for place, (name, c) in enumerate(found)
    ]
    return heads, rows[: 1 + RANKED]


def _percent(value: float | None) -> str:
    return three_digits(None if value is None else 100.0 * value)
