"""Records cut into parts: blocks of windows, for fitting, for selecting or for reporting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fjr_records.records import RecordSet

from .lapped import windows_in

Purpose = Literal["fit", "select", "report"]

WINDOWS = 24
"""Windows into which the shortest record is cut, at least; twice as many where a level has a single
record, since that serves all purposes, and a test of few blocks shows nothing."""
_LONGEST_WINDOW_S = 4.0
_LONG = 160  # samples: longer hops are multiples of 16, which transforms fast
_SLOW_WINDOWS = 96
_WINDOWS_PER_BLOCK = 2
_PURPOSES: tuple[Purpose, ...] = ("fit", "select", "report")
_CYCLE: tuple[Purpose, ...] = ("fit", "select", "fit", "report")
"""Purposes of the blocks of a level's only record, shifted from level to level: what one time of
the record shows serves all purposes."""


@dataclass(frozen=True)
class Part:
    """Some windows of one record.

    Attributes:
        record: its index.
        level: index of its level.
        windows: which windows.
        purpose: what it is for.
        stretch: of the record, in time; what is left on parts of one stretch is alike.
    """

    record: int
    level: int
    windows: slice
    purpose: Purpose
    stretch: int


def hop_of(records: RecordSet, run_in: int, slow: bool) -> int:
    """Return half the length of the windows into which records are cut, samples, even.

    Args:
        records: the records.
        run_in: samples at the start of each that belong to no part.
        slow: whether they are compared by torque alone.
    """
    shortest = min(r.samples for r in records.records) - run_in
    levels = [r.level for r in records.records]
    alone = any(levels.count(level) == 1 for level in levels)
    windows = 2 * WINDOWS if alone else WINDOWS
    if slow:
        hop = shortest / (_SLOW_WINDOWS + 1)
    else:
        hop = min(shortest / (windows + 1), 0.5 * _LONGEST_WINDOW_S * records.sample_rate_hz)
    return max(int(hop - hop % (16 if hop >= _LONG else 2)), 8)


def cut(records: RecordSet, hop: int, run_in: int = 0) -> list[Part]:
    """Cut records into parts, and give each a purpose.

    Levels of three records or more have whole records for each purpose; of two, the second one
    selects and reports, block by block; a single one serves all three. Stretches of long records
    serve each purpose as early as late, so that a drift does not part them.

    Args:
        records: the records.
        hop: half the length of a window, samples.
        run_in: samples at the start of each that belong to no part.
    """
    parts, first = [], -(-run_in // hop)
    for number, level in enumerate(records.levels):
        members = [i for i, r in enumerate(records.records) if r.level == level]
        places = list(range(len(members)))
        if any(records.records[i].after_s for i in members):
            places = [min(place % 6, 5 - place % 6) for place in places]
        else:
            members.sort(key=lambda i: -float(np.abs(records.records[i].torque).max()))
        for place, index in zip(places, members, strict=True):
            count = windows_in(records.records[index].samples, hop)
            blocks = max((count - first) // _WINDOWS_PER_BLOCK, 1)
            ends = np.linspace(first, count, blocks + 1).astype(int)
            for block in range(blocks):
                purpose = _purpose(len(members), place, block + number)
                windows = slice(int(ends[block]), int(ends[block + 1]))
                stretch = block // len(_CYCLE) if len(members) == 1 else block
                parts.append(Part(index, level, windows, purpose, stretch))
    return parts


def spans_of(parts: Sequence[Part]) -> dict[int, slice]:
    """Return the windows from the first to the last of some parts, by record, ascending."""
    spans: dict[int, slice] = {}
    for part in sorted(parts, key=lambda part: part.record):
        now = spans.get(part.record, part.windows)
        begin, end = min(now.start, part.windows.start), max(now.stop, part.windows.stop)
        spans[part.record] = slice(begin, end)
    return spans


def joined(
    lines: Mapping[int, np.ndarray], spans: Mapping[int, slice], parts: Sequence[Part]
) -> np.ndarray:
    """Return the numbers on parts, one after the other.

    Args:
        lines: by record, (..., windows, lines) of its span.
        spans: from `spans_of` these parts, or more.
        parts: which.

    Returns:
        (..., numbers).
    """
    pieces = []
    for part in parts:
        first = spans[part.record].start
        own = lines[part.record][..., part.windows.start - first : part.windows.stop - first, :]
        pieces.append(own.reshape(*own.shape[:-2], -1))
    return np.concatenate(pieces, axis=-1)


def _purpose(records: int, place: int, block: int) -> Purpose:
    if records >= 3:
        return _PURPOSES[place % 3]
    if records == 2:
        return "fit" if place == 0 else _PURPOSES[1 + block % 2]
    return _CYCLE[block % 4]
