"""What `fjr plan` prints of what an experiment could show: parameters, effects, and why not."""

from __future__ import annotations

from collections import defaultdict

from rich.console import Console

from fjr_kit.number_text import three_digits
from fjr_kit.terminal import print_table
from gap_diagnosis.foresight.foreseen import ForeseenEffect, ForeseenParameter, Foresight

_PARAMETERS = [
    *(("parameter", ""), ("nominal", ""), ("unit", ""), ("standard\nerror", "%")),
    *(("others\nknown", "%"), ("identifiable", "")),
]
_NAMED = 2
_EFFECTS = [
    *(("effect", ""), ("from", ""), ("or", ""), ("unit", ""), ("best at", "")),
    ("not told from", ""),
]


def print_foresight(found: Foresight, console: Console) -> None:
    """Print both tables, what shows no limit and why, and notes."""
    _say(console, f"What a diagnosis of {found.source} could show ({', '.join(found.levels)}):")
    rows = [_parameter(one) for one in found.parameters]
    print_table(console, _PARAMETERS, rows, left=("unit", "identifiable"))
    limited = [one for one in found.effects if one.limit is not None]
    if limited:
        _say(
            console,
            "Each effect would be named from this size of its leading parameter on (most and least "
            "visible shape):",
        )
        print_table(
            console,
            _EFFECTS,
            [_effect(one) for one in limited],
            left=("unit", "best at", "not told from"),
            apart=_EFFECTS.index(("best at", "")),
        )
    reasons = defaultdict(list)
    for one in found.effects:
        if one.limit is None:
            reasons[one.why_not].append(one.effect)
    for why, names in reasons.items():
        _say(console, f"No limit: {', '.join(names)}. {why}")
    for note in found.notes:
        _say(console, f"Note: {note}")


def _parameter(one: ForeseenParameter) -> list[str]:
    known: str = one.identifiable
    if one.tied_to:
        known = f"only together with {', '.join(one.tied_to)}"
    return [
        one.name,
        f"{one.nominal:.4g}",
        one.unit,
        three_digits(one.error_percent),
        three_digits(one.others_known_percent),
        known,
    ]


def _effect(one: ForeseenEffect) -> list[str]:
    return [
        one.parameter,
        three_digits(one.limit),
        three_digits(one.limit_worst),
        one.unit,
        one.level,
        _some(one.not_told_from),
    ]


def _some(names: list[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "") or "-"


def _say(console: Console, sentence: str) -> None:
    console.print(sentence, highlight=False, markup=False, soft_wrap=True)
