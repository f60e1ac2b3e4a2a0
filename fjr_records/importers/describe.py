"""From records to experiment descriptions: levels, realizations, repeats, common lines."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from fjr_interface.experiment import Experiment, RecordDescription
from fjr_kit.errors import InputError

from ..lines import classify
from .import_map import is_linear
from .record_file import Record
from .repetition import Repetition

SAME_REFERENCE = 0.02
"""Greatest rms difference of two references, relative to their rms, that are the same."""
SAME_MOTION, SAME_TORQUE = 0.15, 0.3
"""Greatest rms difference of position and control error, and of torque, relative to their rms, of
runs that repeat each other; another gain of the controller shows in one of them."""
SAME_LEVEL = 0.1
"""Greatest difference of the references' rms over lines within a level, relative to it."""
ODD_LINE = 0.1
"""Difference of a line's amplitude from the level's median from which it is named."""
MOST_NAMED = 3
ALIKE = 2e-3
"""Greatest deviation of lines from their mean amplitude at which one number stands for all."""

Description = Experiment | RecordDescription


def describe(
    records: Sequence[Record],
    levels: int,
    controllers: Sequence[dict[str, Any] | None],
    must_repeat: bool = False,
) -> tuple[list[Description], list[str]]:
    """Describe each record.

    Records that each repeat, but with other periods or lines, are described as records that do
    not, which one diagnosis takes together.

    Args:
        records: level by level, equally many of each.
        levels: how many amplitudes they hold.
        controllers: what is known of the controller, for each record.
        must_repeat: whether the user says that they repeat in the same way.

    Returns:
        Their descriptions, of one kind, and sentences on what differs between them.

    Raises:
        InputError: they do not belong into one experiment.
    """
    _check_rates(records)
    _check_kinds(records)
    each_level = len(records) // levels
    notes: list[str] = []
    found: list[Description] = []
    periodic = all(isinstance(record.repetition, Repetition) for record in records)
    differing = _differing(records, each_level) if periodic else None
    if differing is not None and must_repeat:
        raise InputError(
            f"{differing}; import them into separate folders, or leave out what is said of their "
            "periods and lines: then they are records that do not repeat."
        )
    if differing is not None:
        notes.append(
            f"{differing}, so all are taken as records that do not repeat; imported into separate "
            "folders, each gives a BLA by its periods"
        )
    lines = _common_lines(records, notes) if periodic and differing is None else None
    axis = {"axis": "linear"} if is_linear(records[0].columns) else {}
    from_speed = records[0].columns["position"].is_speed
    speed = {"position_from": "speed"} if from_speed else {}
    for level in range(levels):
        part = slice(level * each_level, (level + 1) * each_level)
        inside = records[part]
        amplitude = None if lines is None else _amplitude(inside, lines, notes)
        repeats = _repeats(inside, controllers[part], notes)
        for number, record in enumerate(inside):
            common = {
                "sample_rate_hz": record.sample_rate_hz,
                "realization": number,
                "realizations": each_level,
                "level": level,
                "levels": levels,
                "repeat_of": repeats[number],
                "controller": controllers[part][number],
                "imported": _source(record),
                **axis,
                **speed,
            }
            source = str(record.path)
            if lines is None:
                found.append(RecordDescription.of(source, samples=record.samples, **common))
                continue
            assert isinstance(record.repetition, Repetition)
            found.append(
                Experiment.of(
                    source,
                    samples_per_period=record.repetition.samples_per_period,
                    periods=record.repetition.periods,
                    transient_periods=record.repetition.transient_periods,
                    amplitude_rad=amplitude,
                    excited_harmonics=lines.tolist(),
                    detection_harmonics=classify(lines.tolist()).odd.tolist(),
                    **common,
                )
            )
    return found, notes


def _source(record: Record) -> dict[str, Any]:
    named = {quantity: [c.name, c.factor] for quantity, c in record.columns.items()}
    return {"file": record.path.name, "columns": named}


def _check_kinds(records: Sequence[Record]) -> None:
    """Refuse files of which one states an angle and the other a length or a speed."""
    first = records[0]
    for record in records[1:]:
        one, other = first.columns, record.columns
        if (is_linear(one), one["position"].is_speed) != (
            is_linear(other),
            other["position"].is_speed,
        ):
            raise InputError(
                f"{first.path} and {record.path} state units of different kinds; give the units "
                "in --map, or import them as experiments of their own."
            )


def _check_rates(records: Sequence[Record]) -> None:
    first = records[0]
    for record in records[1:]:
        if abs(record.sample_rate_hz / first.sample_rate_hz - 1.0) > 1e-6:
            raise InputError(
                f"{first.path} and {record.path} differ in sample rate ({first.sample_rate_hz:g} "
                f"and {record.sample_rate_hz:g} Hz); import them into separate folders."
            )


def _differing(records: Sequence[Record], each_level: int) -> str | None:
    """Return what says that two records repeat in different ways; None if none do.

    Args:
        records: level by level.
        each_level: how many.
    """
    whole = records[0].repetition
    assert isinstance(whole, Repetition)
    common = whole.excited
    for record in records[1:]:
        other = record.repetition
        assert isinstance(other, Repetition)
        same = (other.samples_per_period, other.periods) == (
            whole.samples_per_period,
            whole.periods,
        )
        common = np.intersect1d(common, other.excited)
        if not same or common.size < 0.9 * max(whole.excited.size, other.excited.size):
            return (
                f"{records[0].path} and {record.path} differ in period, number of periods or "
                "excited lines"
            )
    for number, record in enumerate(records):
        first = records[number - number % each_level]
        ratio = _amplitudes(record, common) / _amplitudes(first, common)
        if np.median(np.abs(ratio / np.median(ratio) - 1.0)) > ODD_LINE:
            return f"{first.path} and {record.path} differ in the amplitudes of most lines"
    return None


def _amplitudes(record: Record, lines: np.ndarray) -> np.ndarray:
    assert isinstance(record.repetition, Repetition)
    return record.repetition.amplitudes[np.isin(record.repetition.excited, lines)]


def _common_lines(records: Sequence[Record], notes: list[str]) -> np.ndarray:
    """Return the lines that all references excite, and name those that only some of them have."""
    excited = []
    for record in records:
        assert isinstance(record.repetition, Repetition)
        excited.append(record.repetition.excited)
    common: np.ndarray = functools.reduce(np.intersect1d, excited)
    for record in records:
        assert isinstance(record.repetition, Repetition)
        own = ~np.isin(record.repetition.excited, common)
        pairs = zip(record.repetition.excited[own], record.repetition.amplitudes[own], strict=True)
        for line, size in pairs:
            notes.append(
                f"{record.path.name}: only here line {line} has {size:.3g} {_unit(record)}; it is "
                "not counted as excited"
            )
    return common


def _amplitude(
    records: Sequence[Record], lines: np.ndarray, notes: list[str]
) -> float | list[float]:
    """Return the amplitudes of a level, and name lines that differ in one of its records."""
    amplitudes = np.array([_amplitudes(record, lines) for record in records])
    usual = np.median(amplitudes, axis=0)
    base_hz = records[0].sample_rate_hz / _period(records[0])
    rms, unit = np.sqrt(np.mean(amplitudes**2, axis=1)), _unit(records[0])
    for record, own, size in zip(records, amplitudes, rms, strict=True):
        # Scaled as a whole it is another level; a few lines that differ are not.
        if abs(np.median(own / amplitudes[0]) - 1.0) > SAME_LEVEL:
            raise InputError(
                f"{record.path}: the amplitudes of the reference differ from those of "
                f"{records[0].path} (amplitude per line {size:.3g} and {rms[0]:.3g} {unit}); say "
                "how many levels the files hold, or import it into another folder."
            )
        odd = np.flatnonzero(np.abs(own / usual - 1.0) > ODD_LINE)
        for at in odd[:MOST_NAMED]:
            notes.append(
                f"{record.path.name}: line {lines[at]} ({lines[at] * base_hz:.4g} Hz) has "
                f"{own[at]:.3g} {unit}, {abs(own[at] / usual[at] - 1.0):.0%} off the others"
            )
        if odd.size > MOST_NAMED:
            notes.append(f"{record.path.name}: {odd.size - MOST_NAMED} more lines differ so")
    mean = amplitudes.mean(axis=0)
    if np.abs(mean - mean.mean()).max() <= ALIKE * mean.mean():
        return float(f"{mean.mean():.4g}")
    return [float(f"{amplitude:.6g}") for amplitude in mean]


def _unit(record: Record) -> str:
    """Return the unit of the reference."""
    return "m" if is_linear(record.columns) else "rad"


def _period(record: Record) -> int:
    assert isinstance(record.repetition, Repetition)
    return record.repetition.samples_per_period


def _repeats(
    records: Sequence[Record], controllers: Sequence[dict[str, Any] | None], notes: list[str]
) -> list[int | None]:
    """Return for each record of a level the first one that it repeats, or None."""
    repeats: list[int | None] = []
    for number, record in enumerate(records):
        found, unlike = None, None
        for earlier in range(number) if "r" in record.signals else ():
            if repeats[earlier] is not None or not _same_reference(records[earlier], record):
                continue
            same_law = controllers[earlier] == controllers[number]
            if same_law and _moves_alike(records[earlier], record):
                found = earlier
                break
            unlike = records[earlier].path.name
        if found is None and unlike is not None:
            notes.append(
                f"{record.path.name} has the reference of {unlike} but moves otherwise, as under "
                "another controller or load; it is taken as a run of its own"
            )
        repeats.append(found)
    return repeats


def _same_reference(one: Record, other: Record) -> bool:
    size = min(one.samples, other.samples)
    if size < 0.9 * max(one.samples, other.samples):
        return False
    return _difference(one.signals["r"][:size], other.signals["r"][:size]) <= SAME_REFERENCE


def _moves_alike(one: Record, other: Record) -> bool:
    size = min(one.samples, other.samples)
    (r1, r2), (u1, u2), (y1, y2) = (
        [each.signals[symbol][:size] for each in (one, other)] for symbol in "ruy"
    )
    motion = max(_difference(y1, y2), _difference(r1 - y1, r2 - y2))
    return motion <= SAME_MOTION and _difference(u1, u2) <= SAME_TORQUE


def _difference(one: np.ndarray, other: np.ndarray) -> float:
    scale = float(np.std(one))
    return float(np.std(one - other)) / scale if scale > 0 else float(np.ptp(other) > 0)
