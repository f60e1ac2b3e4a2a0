"""What `fjr import` has understood, in words."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fjr_interface.experiment import Experiment, RecordDescription
from fjr_kit.errors import shown
from fjr_records.importers.columns import Held, held_columns
from fjr_records.importers.importer import Understood
from fjr_records.importers.likely_columns import likely_map
from fjr_records.importers.made_torque import SWINGS_FREE
from fjr_records.importers.part import LEAST_SAMPLES
from fjr_records.importers.record_file import SYMBOLS, Record
from fjr_records.importers.repetition import Repetition

_UNITS = {"reference": "rad", "torque": "N m", "position": "rad", "link": "rad"}
_LINEAR_UNITS = {"reference": "m", "torque": "N", "position": "m", "link": "m"}


def held_by(path: Path) -> Iterator[str]:
    """Yield the lines that say what a file holds, for those who must name its columns."""
    columns, more = held_columns(path)
    yield f"{path.name} holds"
    width = max((len(one.name) for one in columns), default=0)
    for one in columns:
        shape = " x ".join(map(str, one.shape))
        if one.holes:
            shape = f"{np.prod(one.shape) - one.holes} of {shape}"
        values = "not all finite real numbers"
        if one.range is not None:
            values = f"from {one.range[0]:.6g} to {one.range[1]:.6g}"
        title = f", called {shown(one.title)}" if one.title else ""
        yield f"  {one.name:<{width}}  {shape:>14}  {values}{title}"
    if more:
        yield f"  and {more} more, not shown"
    likely = likely_map(_signals(columns))
    specs = [
        f"{quantity}={likely.get(quantity, 'COLUMN:UNIT')}"
        for quantity in ("torque", "position", "reference", "time")
        if quantity in likely or quantity != "reference"
    ]
    guess = " (as the names suggest)" if likely else ""
    yield (
        "Nothing was written. Next: name the columns of torque and position, perhaps of reference "
        f"and time{guess}: --dry-run --map {shlex.quote(','.join(specs))}"
    )


def _signals(columns: Sequence[Held]) -> list[str]:
    """Return the names of the columns that vary, of the length that most of them have."""
    vary = [
        one
        for one in columns
        if one.range and one.range[0] < one.range[1]
        if LEAST_SAMPLES <= max(one.shape, default=0) == np.prod(one.shape)
    ]
    lengths = [max(one.shape) for one in vary]
    usual = max(lengths, key=lengths.count, default=0)
    return [one.name for one, length in zip(vary, lengths, strict=True) if length == usual]


def summary(understood: Understood) -> Iterator[str]:
    """Yield the lines of the summary: each file, then what they are together."""
    for record, one in zip(understood.records, understood.descriptions, strict=True):
        yield from _file(record, one)
    yield from _together(understood)


def _file(record: Record, one: Experiment | RecordDescription) -> Iterator[str]:
    seconds = record.samples / record.sample_rate_hz
    yield (
        f"{record.path.name}: level {one.level}, realization {one.realization}: {seconds:.6g} s at "
        f"{record.sample_rate_hz:.6g} Hz, {record.samples} samples"
    )
    units = _LINEAR_UNITS if one.linear else _UNITS
    for quantity, symbol in SYMBOLS.items():
        if symbol not in record.signals:
            if quantity != "link":
                yield f"  {quantity:<10} not recorded"
            continue
        values, unit = record.signals[symbol], units[quantity]
        column = record.columns.get(quantity)
        source = "none acts" if SWINGS_FREE in record.notes else "made by the controller"
        if column is not None:
            stated = f" in {column.unit} as the file says" if column.stated else ""
            source = f"{column.name}{stated}, times {column.factor:.6g}"
        yield (
            f"  {quantity:<10} rms {np.sqrt(np.mean(values**2)):.4g} {unit}, from "
            f"{values.min():.4g} to {values.max():.4g} {unit} ({source})"
        )
    timing = record.timing
    if timing.gaps:
        yield f"  gaps       {timing.gaps}, the longest {timing.longest_gap_s:.4g} s"
    else:
        yield "  gaps       none"
    found = record.repetition
    if isinstance(found, Repetition):
        base = record.sample_rate_hz / found.samples_per_period
        yield (
            f"  repeats    every {found.samples_per_period} samples ({1.0 / base:.6g} s): "
            f"{found.transient_periods} transient and {found.periods} kept periods, "
            f"{found.excited.size} excited lines from {found.excited[0] * base:.6g} to "
            f"{found.excited[-1] * base:.6g} Hz"
        )
    else:
        yield f"  repeats    not: {found}"
    for note in record.notes:
        yield f"  note       {note}."


def _together(understood: Understood) -> Iterator[str]:
    first = understood.descriptions[0]
    runs = len(understood.descriptions)
    repeats = sum(one.repeat_of is not None for one in understood.descriptions)
    yield (
        f"Together: {runs} run{'s' * (runs != 1)} at {first.levels} level"
        f"{'s' * (first.levels != 1)}, {repeats} of them repeating another, described as "
        + ("a periodic multisine." if isinstance(first, Experiment) else "records, not periodic.")
    )
    for one in understood.descriptions:
        if one.repeat_of is not None:
            yield f"  level {one.level}: realization {one.realization} repeats {one.repeat_of}"
    for note in understood.notes:
        yield f"  {note}."
    yield f"  controller: {_controller(understood)}"


def _controller(understood: Understood) -> str:
    laws = {_law(one.controller) for one in understood.descriptions}
    return "; ".join(sorted(laws))


def _law(controller: dict[str, Any] | None) -> str:
    if controller is None:
        return "unknown"
    unknown = controller.get("unknown")
    gains = f"unknown {', '.join(unknown)}" if unknown else "all gains known"
    own_hz = {**controller, **controller.get("given", {})}.get("rate_hz")
    rate = f", run at {own_hz:g} Hz" if own_hz else ""
    return f"{controller['kind']}, {gains}{rate}"
