"""Reads a bag whose signals were sampled unevenly, each by a clock of its own, onto one even grid.

Position and reference are interpolated as band-limited signals, the torque is taken as a command
that is held from its stamp on (`band_limited`, `hold_equivalent`). The bag is read once to survey
it, then block by block like any other: memory does not grow with its length.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from ..bags.reader import MAX_LAG, BagReader, Record
from ..bags.signals import DEFAULT, SignalMap, decode
from ..experiment import Experiment, RecordDescription
from .accuracy import BAND, Resampling, Survey, Surveyed
from .grid_stream import Grid, GridStream

_PIECE = 4096
_SAME_RATE = 0.01
_SHORT = 20
"""A described bag may lack 1/20 period at its ends: its transient then begins as much earlier."""

Samples = tuple[np.ndarray, np.ndarray]


def open_bag(
    path: Path | str, signal_map: SignalMap = DEFAULT, resampling: Resampling | None = None
) -> BagReader:
    """Return the reader of a bag: onto an even grid if it is to be resampled."""
    if resampling is None:
        return BagReader(path, signal_map)
    return ResampledReader(path, signal_map, resampling)


class ResampledReader(BagReader):
    """One bag, resampled.

    Attributes:
        surveyed: what was found of each signal, its error among it.
        band_hz: frequency up to which the resampled signals can be analyzed.
    """

    def __init__(
        self,
        path: Path | str,
        signal_map: SignalMap = DEFAULT,
        resampling: Resampling = Resampling(),  # noqa: B008
    ) -> None:
        """Open and survey the bag.

        Raises:
            InputError: the bag is damaged, lacks a signal, or cannot be resampled well enough.
        """
        super().__init__(path, signal_map)
        surveys = {name: Survey(self._bag, name, topic) for name, topic in self.topics.items()}
        for name, samples in self._pieces():
            surveys[name].add(*samples)
        self.surveyed = {name: survey.finish() for name, survey in surveys.items()}
        self.sample_rate_hz = self._choose_rate(resampling)
        rates = [found.rate_hz for found in self.surveyed.values()]
        self.band_hz = BAND * min(*rates, self.sample_rate_hz) / 2.0
        self._lay_grid()
        self._lead = 0
        if self.experiment is not None:
            self.experiment = self._shortened(self.experiment)

    def _pieces(self) -> Iterator[tuple[str, Samples]]:
        """Yield the samples of the signals in pieces of `_PIECE`; the last may be shorter."""
        waiting: dict[str, list[Samples]] = {name: [] for name in self.topics}
        for block in self._messages():
            for name, topic in self.topics.items():
                if topic == block.topic.name:
                    waiting[name].append(decode(block, self._sources[name], self._bag))
                    if sum(len(stamps) for stamps, _ in waiting[name]) >= 2 * _PIECE:
                        *whole, rest = _cut(waiting[name])
                        waiting[name] = [rest]
                        yield from ((name, piece) for piece in whole)
        for name, parts in waiting.items():
            if parts:
                yield from ((name, piece) for piece in _cut(parts))

    def _choose_rate(self, resampling: Resampling) -> float:
        master = self.surveyed.get("reference", self.surveyed["position"])
        described = None if self.experiment is None else self.experiment.sample_rate_hz
        if described is None:
            return resampling.rate_hz or master.rate_hz
        if resampling.rate_hz not in (None, described):
            raise InputError(
                f"{self._bag}: the experiment description says {described:g} samples/s, not "
                f"{resampling.rate_hz:g}; resample with auto."
            )
        # One reference message is one sample, whatever the clock of the stamps makes of it.
        return master.rate_hz if abs(master.rate_hz / described - 1.0) < _SAME_RATE else described

    def _lay_grid(self) -> None:
        """Lay the grid where all signals have samples, through whole seconds."""
        found = self.surveyed.values()
        self._origin_ns = min(one.first_ns for one in found) // 10**9 * 10**9
        per_ns = self.sample_rate_hz * 1e-9
        first = (max(one.first_ns for one in found) - self._origin_ns) * per_ns
        last = (min(one.last_ns for one in found) - self._origin_ns) * per_ns
        self._first, self._last = math.ceil(first - 1e-6), math.floor(last + 1e-6)
        if self._last < self._first:
            raise InputError(
                f"{self._bag}: {' and '.join(sorted(set(self.topics.values())))} have no time in "
                "common; stamp them in one clock."
            )

    def _shortened(
        self, experiment: Experiment | RecordDescription
    ) -> Experiment | RecordDescription:
        """Return the description of what is left of it between the ends of all signals."""
        count = self._last - self._first + 1
        if isinstance(experiment, RecordDescription):
            return experiment.model_copy(update={"samples": count})
        period = experiment.samples_per_period
        transient = experiment.transient_periods
        total = (count + (period // _SHORT if transient else 0)) // period
        periods = min(experiment.periods, total - transient)
        if periods < 1:
            raise InputError(
                f"{self._bag}: the signals have {count / period:.4g} periods in common, too few "
                f"for {transient} transient ones and one to keep; record longer."
            )
        self._lead = max(total * period - count, 0)
        return experiment.model_copy(update={"periods": periods})

    def blocks(self, samples: int) -> Iterator[Record]:
        """Yield the resampled samples as `BagReader.blocks` does.

        Raises:
            InputError: the topics do not stand side by side in the bag, or the bag is not whole.
        """
        streams = {name: self._stream(found) for name, found in self.surveyed.items()}
        at = self._first - self._lead
        for name, piece in self._pieces():
            streams[name].add(*piece)
            ready = [stream.ready for stream in streams.values()]
            for _ in range(min(ready) // samples):
                yield self._record_at(streams, at, samples)
                at += samples
            if max(ready) - min(ready) > MAX_LAG:
                raise InputError(
                    f"{self._bag}: the topics do not stand side by side; record them together."
                )
        for stream in streams.values():
            stream.finish()
        left = self._last + 1 - at
        while left > 0:
            yield self._record_at(streams, at, min(samples, left))
            at, left = at + samples, left - samples

    def _stream(self, found: Surveyed) -> GridStream:
        grid = Grid(self._origin_ns, self.sample_rate_hz, self._first, self._last, self._lead)
        return GridStream(found, grid)

    def _record_at(self, streams: dict[str, GridStream], first: int, samples: int) -> Record:
        taken = {name: stream.take(samples) for name, stream in streams.items()}
        instants = np.rint(np.arange(first, first + samples) * (1e9 / self.sample_rate_hz))
        return Record(
            self._origin_ns + instants.astype(np.int64),
            taken.get("reference"),
            taken["torque"],
            taken["position"],
            taken.get("link"),
        )


def resampled(readers: Iterable[BagReader]) -> list[str]:
    """Return what resampling did to each signal, in the bag in which its error is greatest."""
    bags = [reader.surveyed.values() for reader in readers if isinstance(reader, ResampledReader)]
    return [
        max(same, key=lambda found: found.relative_error).sentence
        for same in zip(*bags, strict=True)
    ]


def _cut(parts: list[Samples]) -> list[Samples]:
    stamps, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return [
        (stamps[at : at + _PIECE], values[at : at + _PIECE]) for at in range(0, len(stamps), _PIECE)
    ]
