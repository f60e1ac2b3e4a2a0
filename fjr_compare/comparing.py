"""Campaigns or diagnoses side by side: reads them, compares each with the first, counts tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bla_analyzer.analysis import analyze
from bla_analyzer.results.result import Result, load_result
from fjr_interface.bags.files import find_bags
from fjr_kit.errors import InputError
from fjr_kit.telling import Progress
from gap_diagnosis.outcome.diagnosis import Diagnosis

from .campaigns import compared_campaigns
from .diagnoses import compared_diagnoses
from .result import (
    Comparison,
    Kind,
    LevelDifference,
    Pair,
    PowerDifference,
    Tested,
)
from .statistics import holm
from .words import POWERS, chance

FALSE_ALARM = 0.05
LEAST_DB = 1.0
"""A change of distortion or noise that is smaller is not counted, however sure it is."""

_RESULT, _DIAGNOSIS = "result.json", "diagnosis.json"


def compare(
    places: Sequence[Path | str],
    *,
    false_alarm: float = FALSE_ALARM,
    progress: Progress = lambda _: None,
) -> Comparison:
    """Compare campaigns or diagnoses with the first one.

    Args:
        places: two or more, all campaigns or all diagnoses: folders or files of either, or folders
            of bags, which are analyzed.
        false_alarm: how often a comparison of what is the same may say that something changed.
        progress: told what is done.

    Raises:
        InputError: fewer than two, a place that is neither, both kinds, or what cannot be compared.
    """
    if len(places) < 2:
        raise InputError("Name two or more campaigns or diagnoses to compare.")
    if not 0.0 < false_alarm < 1.0:
        raise InputError(f"The rate of false alarms must lie between 0 and 1, not {false_alarm:g}.")
    read = [_read(Path(place), progress) for place in places]
    names = _names(list(map(Path, places)))
    first = read[0]
    for name, one in zip(names, read, strict=True):
        if type(one) is not type(first):
            raise InputError(
                f"{names[0]} is a {_kind(first)} and {name} a {_kind(one)}; compare campaigns with "
                "campaigns, or diagnoses with diagnoses."
            )
    progress("comparing")
    pairs = []
    for name, other in zip(names[1:], read[1:], strict=True):
        if isinstance(first, Result) and isinstance(other, Result):
            one, two = (r.model_copy(update={"source": n}) for r, n in
                        ((first, names[0]), (other, name)))  # fmt: skip
            pairs.append(compared_campaigns(one, two, false_alarm))
        elif isinstance(first, Diagnosis) and isinstance(other, Diagnosis):
            pairs.append(compared_diagnoses((names[0], name), first, other))
    kind: Kind = "campaigns" if isinstance(first, Result) else "diagnoses"
    return judged_pairs(kind, names[0], pairs, false_alarm)


def _kind(read: Result | Diagnosis) -> str:
    return "campaign" if isinstance(read, Result) else "diagnosis"


def _names(places: Sequence[Path]) -> list[str]:
    """Return the places as they were given, doubles numbered."""
    names: list[str] = []
    for place in map(str, places):
        again = sum(name == place or name.startswith(f"{place} (") for name in names)
        names.append(f"{place} ({again + 1})" if again else place)
    return names


def _read(place: Path, progress: Progress) -> Result | Diagnosis:
    if place.name == _DIAGNOSIS or (place / _DIAGNOSIS).is_file():
        return Diagnosis.read(place if place.name == _DIAGNOSIS else place / _DIAGNOSIS)
    if place.suffix == ".json":
        return load_result(place)
    for file in (place / _RESULT, place / "analysis" / _RESULT):
        if file.is_file():
            return load_result(file)
    try:
        find_bags(place)
    except InputError as error:
        raise InputError(
            f"{error} To compare, name a folder that fjr analyze or fjr diagnose has written, or "
            "one of bags."
        ) from None
    progress(f"analyzing {place}")
    return analyze(place)


def judged_pairs(kind: Kind, first: str, pairs: Sequence[Pair], false_alarm: float) -> Comparison:
    """Return the comparison with every test corrected for all.

    Args:
        kind: what the pairs are.
        first: name of what the others are held against.
        pairs: what was found of each other.
        false_alarm: for all tests together.
    """
    tests = [test for pair in pairs for test in _tests(pair) if test.p_value is not None]
    adjusted = holm([float(test.p_value or 0.0) for test in tests])
    by_test = {id(test): float(p) for test, p in zip(tests, adjusted, strict=True)}

    def judged(test: Tested) -> dict[str, object]:
        p = by_test.get(id(test))
        if p is None:
            return {}
        small = isinstance(test, PowerDifference) and abs(test.change_db) < LEAST_DB
        return {"p_adjusted": p, "changed": p <= false_alarm and not small}

    done = []
    for pair in pairs:
        levels = [_with(level, judged) for level in pair.levels]
        parameters = [each.model_copy(update=judged(each)) for each in pair.parameters]
        done.append(pair.model_copy(update={"levels": levels, "parameters": parameters}))
    changes = [sentence for pair in done for sentence in _changes(pair)]
    return Comparison(
        kind=kind,
        first=first,
        false_alarm=false_alarm,
        tests=len(tests),
        changed=bool(changes),
        changes=changes,
        pairs=done,
    )


def _with(level: LevelDifference, judged: Callable[[Tested], dict[str, object]]) -> LevelDifference:
    """Return a level with its verdicts; lines are marked in a level that changed, only."""
    mine = judged(level)
    update = {**mine, "powers": [power.model_copy(update=judged(power)) for power in level.powers]}
    if not mine.get("changed"):
        none = {"changed": np.zeros(level.bla.changed.size, bool)}
        update["bla"] = level.bla.model_copy(update=none)
    return level.model_copy(update=update)


def _tests(pair: Pair) -> Iterator[Tested]:
    for level in pair.levels:
        yield level
        yield from level.powers
    yield from pair.parameters


def _changes(pair: Pair) -> Iterator[str]:
    """Yield a sentence on each change."""
    for level in pair.levels:
        if level.changed:
            count = int(level.bla.changed.sum())
            where = f"{count} of {level.bla.changed.size} lines are significant by themselves"
            yield (
                f"{pair.other}, {level.name}: the BLA changed by {level.change_percent:.2g} % of "
                f"|G| (rms over lines; {chance(level.p_adjusted)}), most clearly at "
                f"{level.worst_hz:.3g} Hz; {where}."
            )
        for power in level.powers:
            if power.changed:
                yield (
                    f"{pair.other}, {level.name}: {POWERS[power.kind]} changed by "
                    f"{power.change_db:+.1f} dB ({chance(power.p_adjusted)})."
                )
    for one in pair.parameters:
        if one.changed:
            by = "" if one.change_percent is None else f" by {one.change_percent:+.2g} %"
            unit = f" {one.unit}" if one.unit else ""
            yield (
                f"{pair.other}: {one.name} changed{by}, from {one.first.value:.4g} to "
                f"{one.other.value:.4g}{unit} ({chance(one.p_adjusted)})."
            )
    for cause in pair.causes:
        if cause.changed:
            name = " or ".join(cause.effects)
            gone = cause.other is None
            yield f"{pair.other}: {name} is {'gone' if gone else 'there, and was not before'}."
