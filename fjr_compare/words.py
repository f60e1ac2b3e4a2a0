"""What a comparison says in words and tables, for page and terminal."""

from __future__ import annotations

import math

from fjr_kit.page import Mark, Row

from .result import Comparison, LevelDifference, Pair, PowerDifference

POWERS = {
    "total": "distortion and noise at excited lines",
    "odd": "odd distortion",
    "even": "even distortion",
    "noise": "noise",
}


_LEAST_P = 1e-12  # what is rarer depends on the tails of a law that no data have shown


def headline(found: Comparison) -> str:
    """Return whether anything changed, in a sentence."""
    if not judged(found) and not found.changed:
        return "Whether anything changed cannot be judged."
    rate = f"{100.0 * found.false_alarm:g} %"
    if not found.changed:
        return f"No change that can be told from chance ({found.tests} tests, at {rate} together)."
    count = len(found.changes)
    return f"{count} change{'' if count == 1 else 's'} beyond chance (at {rate} for all tests)."


def judged(found: Comparison) -> bool:
    """Tell whether any BLA or parameter was tested, so that "no change" says something."""
    tested = [level.p_value for pair in found.pairs for level in pair.levels]
    tested += [parameter.p_value for pair in found.pairs for parameter in pair.parameters]
    return any(p is not None for p in tested)


def mark(changed: bool, tested: bool = True) -> Mark | str:
    """Return the word on a test, in its colour."""
    if not tested:
        return "not judged"
    return Mark.of(not changed, ("no change", "changed"))


def chance(p: float | None) -> str:
    """Return a p-value in a sentence."""
    if p is None:
        return "not judged"
    return f"p = {p:.1g}" if p >= _LEAST_P else f"p below {_LEAST_P:g}"


def probability(value: float | None) -> float:
    """Return a p-value for a column of numbers, NaN where there is none."""
    return math.nan if value is None else value


def level_rows(pair: Pair) -> list[Row]:
    """Return name, change, worst line, significant lines, p and verdict of each level's BLA."""
    return [_level_row(level) for level in pair.levels]


def _level_row(level: LevelDifference) -> Row:
    lines = f"{int(level.bla.changed.sum())} of {level.bla.changed.size}"
    p = probability(level.p_adjusted)
    word = mark(level.changed, level.p_value is not None)
    return (level.name, level.change_percent, level.worst_hz, lines, p, word)


def power_rows(pair: Pair) -> list[Row]:
    """Return level, kind, both levels, change, p and verdict of each power."""
    return [_power_row(level.name, power) for level in pair.levels for power in level.powers]


def _power_row(name: str, power: PowerDifference) -> Row:
    p = probability(power.p_adjusted)
    word = mark(power.changed, power.p_value is not None)
    values = (power.first_db, power.other_db, power.change_db)
    return (name, power.kind, *values, p, word)


def parameter_rows(pair: Pair) -> list[Row]:
    """Return name, unit, both values, change with interval, scatter, p and verdict."""
    rows: list[Row] = []
    for one in pair.parameters:
        numbers = (one.first.value, one.other.value, probability(one.change_percent))
        ends = (one.low, one.high, probability(one.scatter_percent), probability(one.p_adjusted))
        rows.append(
            (one.name, one.unit, *numbers, *ends, mark(one.changed, one.p_value is not None))
        )
    return rows


def cause_rows(pair: Pair) -> list[Row]:
    """Return causes, the probability of each diagnosis, and the verdict."""
    return [
        (
            " or ".join(cause.effects),
            _present(cause.first),
            _present(cause.other),
            mark(cause.changed),
        )
        for cause in pair.causes
    ]


def _present(probability: float | None) -> str:
    return "not named" if probability is None else f"{probability:.0%}"


def gap_rows(pair: Pair) -> list[Row]:
    """Return the gap of nominal and updated simulation in both diagnoses."""
    rows: list[Row] = []
    stages = ("nominal", "updated")
    for stage, one, two in zip(stages, pair.gap_first, pair.gap_other, strict=True):
        for what, a, b in (
            ("position", one.nrmse_position, two.nrmse_position),
            ("torque", one.nrmse_torque, two.nrmse_torque),
        ):
            in_percent = [100.0 * probability(value) for value in (a, b)]
            rows.append((f"{stage} simulation, {what}", *in_percent))
    return rows
