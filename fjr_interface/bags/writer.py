"""Writes one realization as a rosbag2 bag (version 9, MCAP, zstd chunks) of the interface.

The log time of a message is its header stamp, so the same content always gives the same bytes.
"""

from __future__ import annotations

import shutil
import tempfile
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import QosDurability, QosHistory, QosReliability
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores, get_typestore

from fjr_kit.atomic import new_partial
from fjr_kit.errors import InputError

from ..experiment import CUSTOM_DATA_KEY, Experiment, RecordDescription
from ..topics import (
    EXPERIMENT_TOPIC,
    JOINT,
    JOINT_STATE,
    NAMESPACE,
    SIGNAL_DEPTH,
    SIGNALS,
    STRING,
    Signal,
    stamp_ns,
    stamps_ns,
)
from .files import bag_files
from .joint_state import JointStateWriter
from .qos import stated_qos
from .storage import ChecksummedWriter

SIGNAL_QOS = stated_qos(
    QosHistory.KEEP_LAST, SIGNAL_DEPTH, QosReliability.RELIABLE, QosDurability.VOLATILE
)
EXPERIMENT_QOS = stated_qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL
)
_PIECE = 2**14
"""Samples whose messages are held in memory at once."""


class BagWriter:
    """Writes one bag; a context manager.

    The bag grows in a hidden folder beside its final place and is moved there, complete, by
    `close`. If the body of the `with` statement raises, nothing is left. What a killed process left
    behind is cleared away by the next one that writes the same bag.
    """

    def __init__(
        self,
        folder: Path | str,
        experiment: Experiment | RecordDescription,
        *,
        joint: str = JOINT,
        signals: tuple[Signal, ...] = SIGNALS,
    ) -> None:
        """Start the bag `folder` and record the experiment description as its first message.

        Args:
            folder: the bag's folder; its parents are made, itself it must not exist.
            experiment: description of the realization.
            joint: joint name in messages that `write_arrays` makes.
            signals: the signals of each sample, in the order in which they are recorded.

        Raises:
            InputError: the folder exists, is being written, or cannot be made.
        """
        self.folder = Path(folder).absolute()
        self.experiment = experiment
        self.signals = signals
        self.samples = 0
        self._joint = joint
        self._partial = new_partial(self.folder)
        self._open_bag = True
        try:
            self._open()
        except BaseException:
            self._clear_away()
            raise

    def _open(self) -> None:
        store = get_typestore(Stores.ROS2_JAZZY)
        self._writer = ChecksummedWriter(
            self._partial.path, version=9, storage_plugin=StoragePlugin.MCAP
        )
        self._writer.set_custom_data(CUSTOM_DATA_KEY, self.experiment.to_json())
        self._writer.open()
        self._storage: Any = self._writer.storage
        description = self._writer.add_connection(
            f"{NAMESPACE}/{EXPERIMENT_TOPIC}",
            STRING,
            typestore=store,
            offered_qos_profiles=[EXPERIMENT_QOS],
        )
        self._channels = tuple(
            self._writer.add_connection(
                signal.absolute_topic,
                JOINT_STATE,
                typestore=store,
                offered_qos_profiles=[SIGNAL_QOS],
            ).id
            for signal in self.signals
        )
        message = store.types[STRING](self.experiment.to_json())
        self._first = self._last = stamp_ns(1, self.experiment.sample_rate_hz)
        self._writer.write(description, self._first, store.serialize_cdr(message, STRING))

    def write(self, stamp_ns: int, payloads: Sequence[bytes]) -> None:
        """Record one sample.

        Args:
            stamp_ns: the header stamp of all its messages.
            payloads: serialized JointStates, one for each signal in order.

        Raises:
            InputError: the disk is full or fails.
        """
        try:
            self._storage.write_sample(stamp_ns, self._channels, payloads)
        except OSError as error:
            raise self._unwritable(error) from None
        self.samples += 1
        self._last = stamp_ns

    def write_arrays(self, **values: np.ndarray) -> None:
        """Record the whole realization, one float64 array (samples,) by each signal's symbol.

        The stamps are those of the experiment: `write_arrays(r=r, y=y, u=u)`, with q if it is among
        the signals.

        Raises:
            ValueError: the symbols are not those of the signals, or the lengths differ or are not
                `experiment.samples`, where that is described.
        """
        if set(values) != {signal.symbol for signal in self.signals}:
            raise ValueError(f"expected the signals {[signal.symbol for signal in self.signals]}")
        samples = self.experiment.samples or len(values[self.signals[0].symbol])
        stamps = stamps_ns(samples, self.experiment.sample_rate_hz)
        for signal in self.signals:
            if np.shape(values[signal.symbol]) != stamps.shape:
                raise ValueError(f"{signal.symbol} must have the shape {stamps.shape}")
        encoders = [JointStateWriter(signal.field, self._joint) for signal in self.signals]
        for at in range(0, samples, _PIECE):
            piece = slice(at, at + _PIECE)
            columns = [
                _rows(encoder.encode_many(stamps[piece], values[signal.symbol][piece]))
                for encoder, signal in zip(encoders, self.signals, strict=True)
            ]
            for stamp, *payloads in zip(stamps[piece].tolist(), *columns, strict=True):
                self.write(stamp, payloads)

    def close(self) -> None:
        """Finish the bag and move it to its place.

        Raises:
            InputError: the disk is full or fails, or the folder has come to exist meanwhile.
        """
        writer = self._writer
        try:
            self._storage.count_samples(self._channels, self.samples)
            for channel in self._channels:
                writer.counts[channel] = self.samples
            writer.min_timestamp = min(writer.min_timestamp, self._first)
            writer.max_timestamp = max(writer.max_timestamp, self._last)
            writer.close()
            self._partial.publish()
        except OSError as error:
            raise self._unwritable(error) from None
        finally:
            self._clear_away()

    def abort(self) -> None:
        """Give the bag up; nothing is left of it."""
        with suppress(OSError):
            self._writer.abort()
        self._clear_away()

    def _clear_away(self) -> None:
        self._open_bag = False
        self._partial.clear_away()

    def _unwritable(self, error: OSError) -> InputError:
        return InputError(
            f"{self.folder}: the bag cannot be written ({error.strerror}); make room or choose "
            "another folder."
        )

    def __enter__(self) -> BagWriter:
        """Return the writer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Close the bag, or abort it if the body raised; a bag closed in the body stays."""
        if not self._open_bag:
            return
        if kind is None:
            self.close()
        else:
            self.abort()


def keep_whole_periods(bag: Path, experiment: Experiment, samples: int) -> int:
    """Replace a bag that ends in the middle of a realization by one of its whole periods.

    Args:
        bag: its folder, as `BagWriter` has written it with the three signals.
        experiment: its description, with all periods that were meant to come.
        samples: how many it holds.

    Returns:
        The number of kept periods after the transient; 0 if the bag was removed for want of one.
    """
    periods = samples // experiment.samples_per_period - experiment.transient_periods
    if periods < 1:
        shutil.rmtree(bag)
        return 0
    kept = experiment.model_copy(update={"periods": periods})
    stamps = kept.stamps_ns.tolist()
    waiting: dict[str, deque[bytes]] = {signal.absolute_topic: deque() for signal in SIGNALS}
    with tempfile.TemporaryDirectory(prefix=".", dir=bag.parent) as scratch:
        place = Path(scratch) / bag.name
        with BagWriter(place, kept) as writer:
            for block in bag_files(bag).blocks(waiting):
                if block.topic.name in waiting:
                    queue = waiting[block.topic.name]
                    queue.extend(map(block.payload, range(len(block.starts))))
                ready = min(map(len, waiting.values()))
                for _ in range(min(ready, len(stamps) - writer.samples)):
                    payloads = [queue.popleft() for queue in waiting.values()]
                    writer.write(stamps[writer.samples], payloads)
        shutil.rmtree(bag)
        place.replace(bag)
    return periods


def _rows(block: np.ndarray) -> list[bytes]:
    """Return the rows of a uint8 block (messages, bytes) as bytes."""
    size = block.shape[1]
    data = block.tobytes()
    return [data[at : at + size] for at in range(0, len(data), size)]
