"""Recorder of a rehearsal: writes down when every message was sent and received, whatever is lost.

It only listens, in a process that has no part in the loop; both times are taken by the middleware
when a message leaves and when it arrives, so how often this looks does not matter. As long as
nothing is lost there is a bag as well, as the recorder of campaigns makes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from rclpy.node import Node

from fjr_interface import topics
from fjr_interface.bags.joint_state import JointStateReader, LayoutError
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError

from ..graph.recorder import Recorder
from .timing import RECORD

ARRIVALS = "arrivals.npz"
"""File with all messages of a rehearsal: `reference`, `position`, `torque`, of dtype RECORD."""

NAMES = ("reference", "position", "torque")
_MOST_WAITING = 2 * topics.SIGNAL_DEPTH
"""Samples that may wait for a signal of theirs; references are that far ahead at most."""
_RECENT = 2000


class RehearsalRecorder(Recorder):
    """A recorder that outlives what goes wrong.

    Attributes:
        damage: why there is no bag, None as long as it may become whole.
        newest_ns: newest stamp of each signal.
        recent: the last messages of each signal.
    """

    def __init__(self, node: Node) -> None:
        """Subscribe on a node that no executor spins."""
        super().__init__(node)
        self._decoders = [JointStateReader(signal.field).decode for signal in self.signals]
        self._logs: list[BinaryIO] = []
        self.damage: str | None = None

    def begin(self, folder: Path, experiment: Experiment) -> None:
        """Expect one realization; see Recorder."""
        super().begin(folder, experiment)
        self._bag = folder
        self.damage = None
        self.recent = [np.zeros(0, RECORD) for _ in self.signals]
        self._paced_ns = 0
        self._logs = [self._log(name).open("wb") for name in NAMES]

    def _log(self, name: str) -> Path:
        return self._bag.with_name(f".{name}.arrivals")

    def poll(self) -> int:
        """Take what has arrived; return the number of samples in the bag."""
        try:
            super().poll()
        except InputError as error:
            self._give_up(str(error))
        if max(map(len, self._queues)) > _MOST_WAITING:
            self._give_up(self._incomplete())
        if self.damage is not None:
            for queue in self._queues:
                queue.clear()
            if self.newest_ns[1] != self._paced_ns:
                self._paced_ns = self.newest_ns[1]
                self._set_pace(self._paced_ns)
        return self.samples

    def _give_up(self, why: str) -> None:
        if self.damage is None:
            self.damage = f"There is no whole bag: {why}"
        self.abort()

    def _open(self, description: str) -> None:
        if self.damage is None:
            super()._open(description)

    def _incomplete(self) -> str:
        return (
            f"{self.samples} of {self._expected.samples} samples came with reference, position "
            "and torque."
        )

    def _take(self, index: int) -> Sequence[bytes]:
        subscription, decode = self._subscriptions[index], self._decoders[index]
        payloads, rows = [], []
        handle, kind = subscription.handle, subscription.msg_type
        with handle:
            while (message := handle.take_message(kind, True)) is not None:
                payload, times = message
                try:
                    stamp, value = decode(payload)
                except LayoutError as error:
                    self._give_up(f"topic {self.signals[index].absolute_topic}: {error}.")
                    continue
                payloads.append(payload)
                rows.append((stamp, times["source_timestamp"], times["received_timestamp"], value))
        if rows:
            arrived = np.array(rows, RECORD)
            self._logs[index].write(arrived.tobytes())
            self.recent[index] = np.concatenate([self.recent[index], arrived])[-_RECENT:]
            self.newest_ns[index] = int(arrived["stamp"][-1])
        return payloads

    def close(self) -> list[np.ndarray]:
        """End the bag, keep it if it is whole, and return all messages of r, y and u.

        They are kept as ARRIVALS beside the bag. A bag that is not whole raises nothing: `damage`
        says why there is none.
        """
        if self.damage is None:
            try:
                if not self.complete:
                    raise InputError(self._incomplete())
                self.finish()
            except InputError as error:
                self._give_up(str(error))
        arrivals: Any = {}
        for name, log in zip(NAMES, self._logs, strict=True):
            log.close()
            arrivals[name] = np.fromfile(self._log(name), RECORD)
        np.savez_compressed(self._bag.with_name(ARRIVALS), **arrivals)
        for name in NAMES:
            self._log(name).unlink()
        return list(arrivals.values())
