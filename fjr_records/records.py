"""Records as they come: runs of one rig held whole in memory, whether they are periodic or not.

A record is one run from its first sample to its last: a chirp, noise, moves, a servo's log, or a
multisine with its transient. Analysis and diagnosis of whatever does not repeat begin here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader
from fjr_interface.bags.signals import DEFAULT, SignalMap
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.resampling.accuracy import Resampling
from fjr_interface.resampling.resampled_reader import open_bag, resampled
from fjr_kit.errors import InputError

Description = Experiment | RecordDescription

_SAME_RATE = 1e-6


@dataclass(frozen=True)
class Record:
    """One run, whole.

    Attributes:
        name: name of the bag.
        description: what is known of it; without description a record of level 0.
        reference: r, float64 (samples,) in rad; None if it was not recorded.
        torque: u, likewise in N m.
        position: y, likewise in rad.
        link: q, likewise in rad; None without a second encoder.
        elapsed_s: when it began, since the first run did (s); zero where that is not known.
        held: position at the times that were left out since the drive was off, for its noise.
        after_s: of a stretch, how long its run had gone on before it (s); its controller has the
            state of that time, even where the axis stands at zero.
    """

    name: str
    description: Description
    reference: np.ndarray | None
    torque: np.ndarray
    position: np.ndarray
    link: np.ndarray | None
    elapsed_s: float = 0.0
    held: tuple[np.ndarray, ...] = ()
    after_s: float = 0.0

    @property
    def level(self) -> int:
        """Index of the excitation level."""
        return self.description.level

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.position.size

    @property
    def controller(self) -> dict | None:
        """Description of the controller; None if it is not known."""
        return self.description.controller


@dataclass(frozen=True)
class RecordSet:
    """All runs of a folder, in the order (level, realization).

    Attributes:
        source: the folder.
        sample_rate_hz: common to all.
        records: one for each bag.
        notes: sentences that a reader of any result must see.
    """

    source: str
    sample_rate_hz: float
    records: tuple[Record, ...]
    notes: tuple[str, ...] = ()

    @cached_property
    def levels(self) -> tuple[int, ...]:
        """The levels that are there, ascending."""
        return tuple(sorted({record.level for record in self.records}))

    @cached_property
    def linear(self) -> bool:
        """Whether the axis is linear: m, N and kg stand for rad, N m and kg m2."""
        return any(record.description.linear for record in self.records)

    @cached_property
    def swings_free(self) -> bool:
        """Whether no run has a torque: then sizes show only as ratios to the inertia."""
        return not any(np.any(record.torque) for record in self.records)

    @cached_property
    def repeats(self) -> tuple[tuple[int, ...], ...]:
        """Groups of indices of records that repeat each other, each index in one group.

        Records of one level repeat each other if one's `repeat_of` names the other, or if their
        references are the same in every sample.
        """
        groups: list[list[int]] = []
        for index, record in enumerate(self.records):
            mine = next((g for g in groups if _repeats(record, self.records[g[0]])), None)
            if mine is None:
                groups.append([index])
            else:
                mine.append(index)
        return tuple(map(tuple, groups))


def _repeats(one: Record, first: Record) -> bool:
    if one.level != first.level or one.samples != first.samples:
        return False
    if one.description.repeat_of is not None:
        return one.description.repeat_of == first.description.realization
    if one.reference is None or first.reference is None:
        return False
    return one.controller == first.controller and np.array_equal(one.reference, first.reference)


def read_records(
    folder: Path | str,
    signal_map: SignalMap = DEFAULT,
    *,
    resampling: Resampling | None = None,
) -> RecordSet:
    """Read all bags of a folder whole, periodic or not; a bag may lack its reference.

    Args:
        folder: experiment folder, or one bag.
        signal_map: which topics and fields are the signals.
        resampling: how to bring unevenly sampled bags onto an even grid; None refuses them.

    Raises:
        InputError: a damaged or empty bag, a signal that is missing or not finite, or bags of
            several sample rates.
    """
    optional = reference_optional(signal_map)
    readers = [open_bag(bag, optional, resampling) for bag in find_bags(folder)]
    rate = readers[0].sample_rate_hz
    for reader in readers:
        if abs(reader.sample_rate_hz / rate - 1.0) > _SAME_RATE:
            raise InputError(
                f"{readers[0].path.name} and {reader.path.name} differ in sample rate; put them "
                "into separate folders."
            )
    records = [_read(reader, place) for place, reader in enumerate(readers)]
    records.sort(key=lambda r: (r.level, r.description.realization))
    notes = list(dict.fromkeys(note for reader in readers for note in reader.notes))
    undescribed = [r.path.name for r in readers if r.experiment is None]
    if undescribed:
        notes.append(
            f"{_names(undescribed)} without experiment description: taken as records of one level."
        )
    return RecordSet(str(folder), rate, tuple(records), (*notes, *resampled(readers)))


def reference_optional(signal_map: SignalMap) -> SignalMap:
    """Return the same map for bags that may lack their reference."""
    if signal_map.reference is None:
        return signal_map
    return replace(signal_map, reference=replace(signal_map.reference, required=False))


def _read(reader: BagReader, place: int) -> Record:
    blocks = list(reader.blocks(2**62))
    if not blocks:
        raise InputError(f"{reader.path.name}: holds no samples; record it again.")
    (block,) = blocks
    for name in ("reference", "torque", "position", "link"):
        signal = getattr(block, name)
        if signal is not None and not np.isfinite(signal).all():
            raise InputError(
                f"{reader.path.name}: {name} holds values that are not finite; record it again."
            )
    description = reader.experiment or RecordDescription.of(
        str(reader.path), sample_rate_hz=reader.sample_rate_hz, realization=place
    )
    return Record(
        reader.path.name, description, block.reference, block.torque, block.position, block.link
    )


def _names(names: Sequence[str]) -> str:
    shown = ", ".join(names[:3])
    return shown if len(names) < 4 else f"{shown} and {len(names) - 3} more"
