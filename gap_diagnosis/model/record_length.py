"""How long records may be: too short for any window, and too long to be played in time."""

from __future__ import annotations

from dataclasses import replace

from fjr_kit.errors import InputError
from fjr_records.records import Record, RecordSet

from .steady_runs import SteadyRuns

LEAST_SAMPLES = 64
"""Of each record: eight of the shortest windows."""
LONGEST_S = 300.0
MOST_SAMPLES = 30_000
"""Of all records together, what is played at the most: so many seconds, or so many samples where
that is longer, as of a slow plant that is sampled slowly."""


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
    total = sum(r.samples for r in records.records) / records.sample_rate_hz
    longest = max(LONGEST_S, MOST_SAMPLES / records.sample_rate_hz)
    if total <= longest:
        return records, []
    share = longest / total
    kept = [_first(record, max(int(share * record.samples), 1)) for record in records.records]
    note = (
        f"The records last {total:.0f} s; the first {100 * share:.0f} % of each are used, "
        f"{longest:.0f} s in all."
    )
    return replace(records, records=tuple(kept)), [note]


def _first(record: Record, samples: int) -> Record:
    reference, link = (
        None if signal is None else signal[:samples] for signal in (record.reference, record.link)
    )
    return replace(
        record,
        reference=reference,
        torque=record.torque[:samples],
        position=record.position[:samples],
        link=link,
    )
