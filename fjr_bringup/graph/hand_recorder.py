"""Records the realizations of a rig whose nodes were started by hand: `fjr record`."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter, keep_whole_periods
from fjr_interface.experiment import Experiment
from fjr_interface.ros.session import ros_session
from fjr_interface.topics import NAMESPACE, SIGNALS, Signal, checked_namespace, stamp_ns
from fjr_kit.stopping import Interruption

from ..campaign.progress import CampaignProgress
from .answers import refuse_trip
from .domain import own_domain, reach
from .recorder import STAMP, STAMP_FORMAT, Recorder

_POLL_S = 0.01
_SAY_S = 3.0


class HandRecorder(Recorder):
    """Makes a bag of each realization that is played from its first sample on, whatever it is.

    What is under way when the recorder comes is passed over; one that is begun anew in its middle
    is recorded anew.

    Attributes:
        late: whether samples were passed over because their realization began before.
    """

    def listen(self, out: Path) -> None:
        """Expect the next realization; its bag comes into the folder `out`."""
        self._out = out
        self.samples = 0
        self.newest_ns = [0] * len(self.signals)
        self.late = False
        self._runs = [0] * len(self.signals)  # which run each signal is in, as far as it was read
        self._inside = [False] * len(self.signals)  # whether the beginning of that run is read
        self._next = 0  # the first run that may be whole

    @property
    def experiment(self) -> Experiment:
        """The description of the realization under way."""
        return self._experiment

    def cut(self) -> tuple[Path, int] | None:
        """Close the bag under way with the whole periods that it has.

        Returns:
            Its folder and the number of periods after the transient; None if there is not one.
        """
        if self._writer is None or not self.samples:
            self.abort()
            return None
        writer, self._writer = self._writer, None
        writer.close()
        periods = keep_whole_periods(writer.folder, self._experiment, self.samples)
        return (writer.folder, periods) if periods else None

    def _open(self, description: str) -> None:
        experiment = Experiment.from_json(description, "topic experiment")
        if self._writer is not None:
            if experiment == self._experiment:
                return  # begun anew: the stamps say where
            self.abort()
        self._start(experiment)

    def _start(self, experiment: Experiment) -> None:
        self._experiment = experiment
        self._folder = bag_folder(self._out, experiment.level, experiment.realization)
        self._stamps = experiment.stamps_ns.tolist()
        self._first = _bytes(stamp_ns(1, experiment.sample_rate_hz))
        if self.samples:
            self._inside = [True] * len(self.signals)
        self.samples = 0
        self._writer = BagWriter(self._folder, experiment, signals=self.signals)

    def _write_complete_samples(self, writer: BagWriter) -> None:
        if self.samples and self._begun_anew():
            self.abort()
            self._start(self._experiment)
        if not self.samples:
            self._pass_over()
        assert self._writer is not None
        super()._write_complete_samples(self._writer)

    def _ready(self) -> int:
        return min(super()._ready(), len(self._stamps) - self.samples)

    def _begun_anew(self) -> bool:
        """Return whether a first sample has come where others of this realization were due."""
        due = len(self._stamps) - self.samples
        return any(
            payload[STAMP] == self._first
            for queue in self._queues
            for payload, _ in zip(queue, range(due), strict=False)
        )

    def _pass_over(self) -> None:
        """Leave out what came before the first sample of each signal.

        A run of which one signal lacks its first sample is left out in all signals: a node whose
        publisher was known later than that of another one has begun without this recorder.
        """
        before = -1
        while before != self._next:
            before = self._next
            for index in range(len(self.signals)):
                self._pass_over_in(index)

    def _pass_over_in(self, index: int) -> None:
        queue = self._queues[index]
        while queue:
            begins = queue[0][STAMP] == self._first
            if begins and self._inside[index]:
                self._runs[index] += 1
                self._inside[index] = False
            if begins and self._runs[index] >= self._next:
                return
            queue.popleft()
            self._inside[index] = self.late = True
            self._next = max(self._next, self._runs[index] + 1)


def record_by_hand(
    out: Path,
    count: int,
    progress: CampaignProgress,
    recorded: Callable[[Path], None],
    namespace: str = NAMESPACE,
    signals: tuple[Signal, ...] = SIGNALS,
) -> None:
    """Record realizations of the rig in the ROS domain of the environment.

    Args:
        out: folder of the bags.
        count: how many realizations.
        progress: where progress is shown.
        recorded: called with every bag when it lies, audited, in its place.
        namespace: where the rig is.
        signals: what is recorded of each sample.

    Raises:
        InputError: no namespace, the environment names no domain, a sample was lost, the
            controller has tripped, or the folder cannot be written.
        KeyboardInterrupt: Ctrl-C; the whole periods of the realization under way are kept.
    """
    domain, namespace = own_domain(), checked_namespace(namespace)
    with ros_session():
        node = rclpy.create_node("recorder", namespace=namespace)
        recorder = HandRecorder(node, signals)
        progress.say(f"Recording in ROS domain {domain}; {reach()}.")
        with Interruption() as interruption:
            try:
                for _ in range(count):
                    _record_one(recorder, out, progress, interruption)
                    _refuse_trip(namespace)
                    bag = bag_folder(
                        out, recorder.experiment.level, recorder.experiment.realization
                    )
                    recorder.finish()
                    recorded(bag)
            except KeyboardInterrupt:
                kept = recorder.cut()
                if kept is not None:
                    progress.say(f"Ended after {kept[1]} whole periods, which are kept.")
                    recorded(kept[0])
                raise
            finally:
                recorder.abort()
        node.destroy_node()


def _record_one(
    recorder: HandRecorder, out: Path, progress: CampaignProgress, interruption: Interruption
) -> None:
    """Record until a realization is complete; say what is waited for."""
    recorder.listen(out)
    seen, said, heard = 0, "", time.monotonic()
    while not recorder.complete:
        samples = recorder.poll()
        if samples != seen:
            if not seen:
                what = recorder.experiment
                progress.describe(f"level {what.level}, realization {what.realization}")
                progress.expect_s(what.samples / what.sample_rate_hz)
            progress.update(samples / recorder.experiment.sample_rate_hz)
            seen, heard = samples, time.monotonic()
        if time.monotonic() - heard > _SAY_S and (now := _waits_for(recorder)) != said:
            said = now
            progress.say(now)
        interruption.raise_if_asked()
        time.sleep(_POLL_S)
    progress.finish_run("recorded", 0.0)


def _waits_for(recorder: HandRecorder) -> str:
    if topic := recorder.unwritten:
        return f"Waiting for a publisher of {topic}."
    if not recorder.described:
        return f"Waiting for the description of a realization on {recorder.description_topic}."
    if recorder.samples:
        return f"Sample {recorder.samples + 1} does not come; `fjr status` says who is missing."
    reset = "`fjr reset` plays it from its beginning"
    if not recorder.late:
        return f"Waiting for the first sample; if the realization has begun, {reset}."
    return (
        f"Waiting for the first sample; {reset}. It began before all nodes knew this recorder: "
        "-p readers:=controller,recorder makes the excitation wait for one."
    )


def _refuse_trip(namespace: str) -> None:
    """Refuse a trip by a node of its own, since that of the recorder hears samples alone."""
    node: Node = rclpy.create_node("record_client", namespace=namespace)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        refuse_trip(node, executor)
    finally:
        executor.shutdown()
        node.destroy_node()


def _bytes(stamp: int) -> bytes:
    return STAMP_FORMAT.pack(*divmod(stamp, 1_000_000_000))
