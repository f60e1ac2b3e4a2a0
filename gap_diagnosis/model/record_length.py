"""How long records may be: too short for any window, and too long to be played in time.

What is too long is played in stretches over the whole record, each as a run of its own: what goes
with time, such as a friction that falls while a gear warms up, then shows from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_records.records import Record, RecordSet

from .steady_runs import SteadyRuns

LEAST_SAMPLES = 64
"""Of each record: eight of the shortest windows."""
LONGEST_S = 300.0
MOST_SAMPLES = 30_000
"""Of all records together, what is played at the most: so many seconds, or so many samples where
that is longer, as of a slow plant that is sampled slowly."""
RUNS = 6
"""Of a level that its stretches make at the least: two to fit, to select and to report."""
_FEWEST = 3  # likewise, where the level is given less time: one for each purpose
_LEAST_STRETCH = 0.1  # of what is played in all; shorter ones have no slow windows
_FIRST = 20  # samples at the beginning of a stretch over which the axis stands
_SHOWN = 2  # records whose stretches a note names, at the most
_REACH = 0.25  # of what is left out between two stretches: where the begin of one is looked for
_MOVES = 0.3  # of the rms motion of all stretches of a record: the least of each
_STANDS = 0.1  # of its rms motion over as many samples: the most of an axis that stands


def within(records: RecordSet) -> tuple[RecordSet, list[str]]:
    """Refuse a record that is too short, and cut those that are too long together; say so."""
    for record in records.records:
        if record.samples < LEAST_SAMPLES:
            raise InputError(
                f"{record.name}: holds {record.samples} samples, too few to cut into windows; "
                f"record {LEAST_SAMPLES} or more."
            )
    if isinstance(records, SteadyRuns):  # they were chosen by their length
        return records, []
    rate = records.sample_rate_hz
    total = sum(r.samples for r in records.records) / rate
    longest = max(LONGEST_S, MOST_SAMPLES / rate)
    if total <= longest:
        return records, []
    share = longest / total
    least = int(_LEAST_STRETCH * longest * rate)
    kept: list[Record] = []
    spread: list[str] = []
    begun: list[str] = []
    for level in records.levels:
        members = [i for i, r in enumerate(records.records) if r.level == level]
        begins = _begins(records, members, share, least)
        runs, numbers = sum(map(len, begins)), count()
        for index, own in zip(members, begins, strict=True):
            record = records.records[index]
            samples = max(int(share * record.samples / len(own)), 1)
            if len(own) == 1:
                kept.append(_part(record, 0, samples))
                continue
            kept += [_stretch(record, begin, samples, next(numbers), runs) for begin in own]
            spread.append(f"{len(own)} stretches of {record.name} of {samples / rate:.0f} s")
            begun.append(_listed([f"{begin / rate:.0f}" for begin in own]))
    used = [*spread[:_SHOWN]]
    if len(spread) > _SHOWN:
        used.append(f"as many of {len(spread) - _SHOWN} more")
    if len(spread) < len(records.records):
        used.append(f"the first {100 * share:.0f} % of each{' other' if spread else ''}")
    notes = [f"The records last {total:.0f} s; {_listed(used)} are used, {longest:.0f} s in all."]
    if spread:
        at = f", from {begun[0]} s on" if len(begun) == 1 else " over the whole of its record"
        notes.append(f"Each stretch counts as a run of its own{at}: what goes with time shows.")
    return replace(records, records=tuple(kept)), [" ".join(notes)]


def _listed(words: Sequence[str]) -> str:
    return " and ".join(", ".join(words).rsplit(", ", 1))


def _begins(records: RecordSet, members: list[int], share: float, least: int) -> list[list[int]]:
    """Return where the stretches of each record of a level begin, samples; only at 0 for one.

    The stretches of a record are as many as make `RUNS` runs of the level, of one length. They
    begin where the axis stands, for what moves has a state that is less well known. An axis that
    never does is begun where it moves least, if its level has no other record. One that hardly
    moves for a part of the record, or swings free, is played from its beginning alone.

    Args:
        records: all.
        members: indices of the records of the level.
        share: of each record that is used.
        least: samples of the shortest stretch.
    """
    first = [[0] for _ in members]
    own = [records.records[i] for i in members]
    again = any(len(group) > 1 and set(group) & set(members) for group in records.repeats)
    periodic = not all(isinstance(r.description, RecordDescription) for r in own)
    if records.swings_free or again or periodic:
        return first
    room = min(int(share * r.samples) for r in own) // max(least, 1)
    stretches = min(math.ceil(RUNS / len(own)), room)
    if stretches < 2 or stretches * len(own) < _FEWEST:
        return first
    found = [_spread(r, int(share * r.samples / stretches), stretches) for r in own]
    stand = [stands for _, stands in found]
    if any(stands is None for stands in stand) or (len(own) > 1 and not all(stand)):
        return first
    return [begins for begins, _ in found]


def _spread(record: Record, samples: int, stretches: int) -> tuple[list[int], bool | None]:
    """Return where stretches of a record begin, samples, and whether the axis stands there.

    None in place of that where it hardly moves in one of them.
    """
    windows = np.lib.stride_tricks.sliding_window_view(record.position, _FIRST)
    moves = windows.max(axis=-1) - windows.min(axis=-1)
    reach = int(_REACH * (record.samples - stretches * samples) / (stretches - 1))
    begins = [0]
    for last in np.linspace(0, record.samples - samples, stretches).astype(int)[1:]:
        near = moves[last - reach : last + 1]
        begins.append(int(last) - reach + int(np.argmin(near)))
    squares = [float(np.mean(moves[begin : begin + samples] ** 2)) for begin in begins]
    rms = math.sqrt(sum(squares) / stretches)
    if math.sqrt(min(squares)) < _MOVES * rms:
        return begins, None
    return begins, bool(moves[begins[1:]].max() <= _STANDS * rms)


def _stretch(record: Record, begin: int, samples: int, number: int, runs: int) -> Record:
    """Return a stretch as a run of its own, whose controller has run before it."""
    after = begin / record.description.sample_rate_hz
    known = {"realization": number, "realizations": runs, "samples": samples}
    return replace(
        _part(record, begin, samples),
        name=f"{record.name} from {after:.0f} s",
        description=record.description.model_copy(update=known),
        elapsed_s=record.elapsed_s + after,
        after_s=after,
        held=() if begin else record.held,
    )


def _part(record: Record, begin: int, samples: int) -> Record:
    kept = slice(begin, begin + samples)
    reference, link = (
        None if signal is None else signal[kept] for signal in (record.reference, record.link)
    )
    return replace(
        record,
        reference=reference,
        torque=record.torque[kept],
        position=record.position[kept],
        link=link,
    )
