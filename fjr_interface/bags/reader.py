"""Reads bags into arrays: whole chunks at a time, in bounded memory, auditing every sample.

Whatever is not whole is refused with an InputError that names file, topic, sample and time; nothing
else is raised, however damaged the bag. See `mcap_blocks` for what checksums can and cannot show.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from fjr_kit.errors import InputError

from ..experiment import CUSTOM_DATA_KEY, Experiment, RecordDescription, parse_experiment
from ..topics import EXPERIMENT_TOPIC, STRING
from .audit import Grid, SignalAudit, refuse_different_stamps, regular_rate_hz
from .blocks import MEND, Block
from .files import bag_files
from .signal_queues import SignalQueue, ready_and_lag
from .signals import DEFAULT, SignalMap, SignalSource, decode

LINEAR_AXIS = (
    "The axis is linear: read m for rad, N for N m and kg for kg m2 wherever units are said."
)

SPEED = (
    "The position is the integral of a recorded speed: it counts from where each run begins, which "
    "is not known, and noise and offset of the speed let it drift."
)

MAX_LAG = 2**21
_AUDIT_BLOCK = 2**16
_RATE_SAMPLES = 1000
_CRASH_S = 1.0
_MAX_DESCRIPTION = 2**21


@dataclass(frozen=True)
class Record:
    """The signals of consecutive samples, all of shape (samples,).

    Attributes:
        stamps_ns: int64, header stamps.
        reference: float64 in rad, or None if not read.
        torque: float64 in N m.
        position: float64 in rad.
        link: float64 in rad, or None if the bag has none.
    """

    stamps_ns: np.ndarray
    reference: np.ndarray | None
    torque: np.ndarray
    position: np.ndarray
    link: np.ndarray | None


class BagReader:
    """One bag: its description at once, its samples block by block.

    Attributes:
        path: the bag's folder.
        experiment: the description in metadata.yaml or on the experiment topic; None if neither.
        sample_rate_hz: from the description, else from the stamps.
        topics: the topic of each signal that is read, by its name in `Record`.
        notes: sentences on what is missing of the bag but can be done without, and on its units.
    """

    def __init__(self, path: Path | str, signal_map: SignalMap = DEFAULT) -> None:
        """Open the bag, find its signals and its description.

        Raises:
            InputError: the bag is damaged, lacks a signal, or its two descriptions differ.
        """
        self.path = Path(path)
        self._bag = str(path)
        self._files = bag_files(self.path)
        self.notes = self._files.notes
        topics = self._files.topics
        self._sources = signal_map.sources()
        described = SignalSource(EXPERIMENT_TOPIC, "data", required=False)
        strings = [topic for topic, kind in topics.items() if kind == STRING]
        self._experiment_topic = described.find(strings, self._bag)
        self.experiment = self._find_description()
        if self.experiment is not None and self.experiment.linear:
            self.notes += (LINEAR_AXIS,)
        if self.experiment is not None and self.experiment.integrated:
            self.notes += (SPEED,)
        if isinstance(self.experiment, RecordDescription) and "reference" in self._sources:
            self._sources["reference"] = replace(self._sources["reference"], required=False)
        found = {name: s.find(topics, self._bag) for name, s in self._sources.items()}
        self.topics: dict[str, str] = {name: topic for name, topic in found.items() if topic}
        self._note_early_ends()
        if self.experiment is not None:
            self.sample_rate_hz = self.experiment.sample_rate_hz
        else:
            self.sample_rate_hz = self._rate_from(self._first_stamps())

    def blocks(self, samples: int) -> Iterator[Record]:
        """Yield the samples in consecutive blocks of exactly `samples`; the last may be shorter.

        The bag is whole only if the iteration ends: its last checks come before its last block.

        Raises:
            InputError: the bag is not whole.
        """
        if samples < 1:
            raise ValueError("a block must have at least one sample")
        described = None if self.experiment is None else self.experiment.samples
        grid = Grid(self.sample_rate_hz, described)
        queues = {
            name: SignalQueue(SignalAudit(self._bag, topic, grid))
            for name, topic in self.topics.items()
        }
        first = 1
        for block in self._messages():
            for name, queue in queues.items():
                if self.topics[name] == block.topic.name:
                    queue.add(*decode(block, self._sources[name], self._bag))
            ready, lag = ready_and_lag(queues)
            while ready >= samples:
                yield self._record(queues, samples, first)
                first, ready = first + samples, ready - samples
            if lag > MAX_LAG:
                self._refuse_lag(queues, first + ready)
        for queue in queues.values():
            queue.audit.finish()
        ready, lag = ready_and_lag(queues)
        rest = [self._record(queues, ready, first)] if ready else []  # refuses different stamps
        if lag > (self._greatest_lag() if self._files.unclosed else 0):
            self._refuse_lag(queues, first + ready)
        yield from rest

    def _record(self, queues: dict[str, SignalQueue], samples: int, first: int) -> Record:
        taken = {name: queue.take(samples) for name, queue in queues.items()}
        stamps = taken["position"][0]
        for name, (others, _) in taken.items():
            pair = (self.topics["position"], self.topics[name])
            refuse_different_stamps(self._bag, pair, (stamps, others), first)
        values = {name: column for name, (_, column) in taken.items()}
        return Record(
            stamps,
            values.get("reference"),
            values["torque"],
            values["position"],
            values.get("link"),
        )

    def _messages(self) -> Iterator[Block]:
        """Yield all blocks; check descriptions on the way and the counts of messages at the end."""
        counts: dict[str, int] = {}
        for block in self._files.blocks(self._wanted):
            topic = block.topic.name
            counts[topic] = counts.get(topic, 0) + len(block.starts)
            if topic == self._experiment_topic and self._described(block) != self.experiment:
                self._refuse_two_descriptions(topic)
            if topic in self._wanted:
                yield block
        expected = self._files.counts
        for topic in sorted(counts.keys() | expected.keys()):
            there, said = counts.get(topic, 0), expected.get(topic, 0)
            if there != said:
                raise InputError(
                    f"{self._bag}: {topic}: {there} messages are there but {self._files.counted} "
                    f"{said}; {MEND}."
                )

    def _find_description(self) -> Experiment | RecordDescription | None:
        """Return the description in the metadata, else the first on the experiment topic."""
        in_metadata = self._described_in_metadata()
        wanted = self._experiment_topic
        if in_metadata is None and wanted is not None and wanted in self._files.counts:
            for block in self._blocks_of(wanted):
                return self._described(block)
        return in_metadata

    def _first_stamps(self) -> np.ndarray:
        """Return the first stamps of the position, int64."""
        stamps = np.empty(0, np.int64)
        for block in self._blocks_of(self.topics["position"]):
            more, _ = decode(block, self._sources["position"], self._bag)
            stamps = np.append(stamps, more)
            if len(stamps) >= _RATE_SAMPLES:
                break
        return stamps

    @property
    def _wanted(self) -> set[str]:
        described = {self._experiment_topic} if self._experiment_topic else set()
        return {*self.topics.values(), *described}

    def _blocks_of(self, topic: str) -> Iterator[Block]:
        return (block for block in self._files.blocks({topic}) if block.topic.name == topic)

    def _described_in_metadata(self) -> Experiment | RecordDescription | None:
        metadata = self._files.metadata
        text = None if metadata is None else (metadata.custom_data or {}).get(CUSTOM_DATA_KEY)
        if text is None:
            return None
        source = f"{self.path / 'metadata.yaml'}: custom_data"
        if not isinstance(text, str):
            raise InputError(f"{source}: {CUSTOM_DATA_KEY} must be a text that holds JSON.")
        return parse_experiment(text, source)

    def _described(self, block: Block) -> Experiment | RecordDescription:
        """Return the description in a block of the experiment topic."""
        source = f"{self._bag}: {block.topic.name}"
        if (block.sizes > _MAX_DESCRIPTION).any():
            raise InputError(f"{source}: is longer than {_MAX_DESCRIPTION} bytes; {MEND}.")
        texts = {block.payload(i) for i in range(len(block.starts))}
        found = [parse_experiment(_string(text, source), source) for text in texts]
        if any(each != found[0] for each in found):
            self._refuse_two_descriptions(block.topic.name)
        return found[0]

    def _refuse_two_descriptions(self, topic: str) -> NoReturn:
        raise InputError(
            f"{self._bag}: {topic}: two different experiment descriptions are in the bag; {MEND}."
        )

    def _rate_from(self, stamps: np.ndarray) -> float:
        where = f"{self._bag}: {self.topics['position']}"
        if len(stamps) < 2:
            raise InputError(f"{where}: holds fewer than two samples; {MEND}.")
        try:
            return regular_rate_hz(stamps)
        except ValueError:
            raise InputError(f"{where}: the stamps do not rise; {MEND}.") from None

    def _greatest_lag(self) -> float:
        """Return by how many samples a topic of an unclosed file may end before the others."""
        return _CRASH_S * self.sample_rate_hz

    def _note_early_ends(self) -> None:
        counts = {topic: self._files.counts.get(topic, 0) for topic in self.topics.values()}
        if self._files.unclosed and len(set(counts.values())) > 1:
            ends = " and ".join(f"{count} messages of {topic}" for topic, count in counts.items())
            self.notes += (f"{self.path.name}: there are {ends}; the last ones are left out.",)

    def _refuse_lag(self, queues: dict[str, SignalQueue], number: int) -> None:
        behind = min(queues, key=lambda name: queues[name].audit.samples)
        raise InputError(
            f"{self._bag}: {self.topics[behind]}: sample {number} and later ones are missing where "
            f"other topics have them; {MEND}."
        )


def _string(payload: bytes, source: str) -> bytes:
    """Return the text of a serialized std_msgs/String, undecoded."""
    length = int.from_bytes(payload[4:8], "little")
    if payload[:2] != b"\x00\x01" or length < 1 or 8 + length > len(payload):
        raise InputError(f"{source}: the message is corrupted; {MEND}.")
    return payload[8 : 8 + length - 1]


def read_record(path: Path | str, signal_map: SignalMap = DEFAULT) -> Record:
    """Read a whole bag; raise InputError if it is not whole."""
    (record,) = BagReader(path, signal_map).blocks(2**62)
    return record


def audit(path: Path | str, signal_map: SignalMap = DEFAULT) -> None:
    """Read a bag through without keeping it; raise InputError if it is not whole."""
    for _ in BagReader(path, signal_map).blocks(_AUDIT_BLOCK):
        pass
