"""Recorder of one realization at a time: raw messages in, an audited bag out.

Nothing is deserialized: a sample is complete when all its signals have arrived with one stamp, and
then goes to the bag in a fixed order, so the same run always gives the same bytes. What has been
recorded is published on `recorded`, and the excitation never streams further than a window beyond
it, less than the depth of the topics: a slow disk slows the lockstep and loses nothing.
"""

from __future__ import annotations

import shutil
import struct
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from builtin_interfaces.msg import Time
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fjr_interface import topics
from fjr_interface.bags.reader import audit
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment
from fjr_interface.ros import runtime
from fjr_kit.errors import InputError

STAMP = slice(4, 12)
STAMP_FORMAT = struct.Struct("<iI")


class Recorder:
    """Records realizations; driven by `poll`, several times a second, from one thread."""

    def __init__(self, node: Node, signals: tuple[topics.Signal, ...] = topics.SIGNALS) -> None:
        """Subscribe on a node that no executor spins."""
        self.signals = signals
        self._subscriptions = [
            node.create_subscription(
                JointState, signal.topic, lambda _: None, runtime.SIGNAL_QOS, raw=True
            )
            for signal in signals
        ]
        self._descriptions = node.create_subscription(
            String, topics.EXPERIMENT_TOPIC, lambda _: None, runtime.EXPERIMENT_QOS
        )
        self._recorded = node.create_publisher(Time, topics.RECORDED_TOPIC, runtime.EXPERIMENT_QOS)
        self._queues: list[deque[bytes]] = [deque() for _ in signals]
        self._writer: BagWriter | None = None
        self._folder = Path()

    @property
    def unwritten(self) -> str | None:
        """A recorded topic that has no publisher yet, None if all have."""
        for subscription in (*self._subscriptions, self._descriptions):
            if subscription.get_publisher_count() < 1:
                return str(subscription.topic_name)
        return None

    @property
    def description_topic(self) -> str:
        """Where the realization's description comes."""
        return str(self._descriptions.topic_name)

    @property
    def described(self) -> bool:
        """Whether the realization's description has arrived."""
        return self._writer is not None

    def begin(self, folder: Path, experiment: Experiment) -> None:
        """Expect one realization: its bag starts when its description arrives."""
        self._folder = folder
        self._expected = experiment
        self.samples = 0
        self.newest_ns = [0] * len(self.signals)
        for subscription, queue in zip(self._subscriptions, self._queues, strict=True):
            runtime.take_all(subscription)
            queue.clear()

    @property
    def complete(self) -> bool:
        """Whether every sample of the realization is in the bag."""
        return self._writer is not None and self.samples == len(self._stamps)

    def poll(self) -> int:
        """Record what has arrived; return the number of samples recorded so far.

        Raises:
            InputError: a sample was lost, repeated or out of order, or the disk fails.
        """
        for message in runtime.take_all(self._descriptions):
            self._open(message.data)
        for index, queue in enumerate(self._queues):
            queue.extend(self._take(index))
            if queue:
                self.newest_ns[index] = _stamp_of(queue[-1])
        if self._writer is not None:
            self._write_complete_samples(self._writer)
        return self.samples

    def _take(self, index: int) -> Sequence[bytes]:
        """Return what has arrived of a signal."""
        return runtime.take_all(self._subscriptions[index])

    def _open(self, description: str) -> None:
        experiment = Experiment.from_json(description, "topic experiment")
        if experiment != self._expected or self._writer is not None:
            return  # of an earlier realization
        self._stamps = experiment.stamps_ns.tolist()
        self._writer = BagWriter(self._folder, experiment, signals=self.signals)

    def _write_complete_samples(self, writer: BagWriter) -> None:
        before = self.samples
        queues, stamps = self._queues, self._stamps
        for _ in range(self._ready()):
            if self.samples == len(stamps):
                raise InputError("More samples arrived than the experiment has; start it again.")
            payloads = [queue.popleft() for queue in queues]
            stamp = stamps[self.samples]
            expected = STAMP_FORMAT.pack(*divmod(stamp, 1_000_000_000))
            for signal, payload in zip(self.signals, payloads, strict=True):
                if payload[STAMP] != expected:
                    raise InputError(
                        f"{self._folder}: topic {signal.absolute_topic}, sample "
                        f"{self.samples + 1}: stamp {_stamp_of(payload) * 1e-9:.6f} s where "
                        f"{stamp * 1e-9:.6f} s was due, so a sample was lost or repeated; start "
                        "the campaign again to resume."
                    )
            writer.write(stamp, payloads)
            self.samples += 1
        if self.samples > before:
            self._set_pace(stamps[self.samples - 1])

    def _ready(self) -> int:
        """Return how many samples have all their signals."""
        return min(map(len, self._queues))

    def _set_pace(self, stamp_ns: int) -> None:
        seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
        self._recorded.publish(Time(sec=seconds, nanosec=nanoseconds))

    def finish(self) -> None:
        """Close the bag and audit what is on the disk; a bag that fails the audit is removed."""
        assert self._writer is not None
        writer, self._writer = self._writer, None
        writer.close()
        try:
            audit(self._folder)
        except InputError:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def abort(self) -> None:
        """Give the bag under way up."""
        if self._writer is not None:
            self._writer.abort()
            self._writer = None


def _stamp_of(payload: bytes) -> int:
    seconds, nanoseconds = STAMP_FORMAT.unpack_from(payload, 4)
    return seconds * 1_000_000_000 + nanoseconds
