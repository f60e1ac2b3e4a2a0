"""Conducts a rehearsal: waits for the drive, starts the run, kills the node of a fault, ends it.

What goes wrong in a campaign ends it; here it is a finding, and the run goes on as long as there is
something to see. However it ends, the torque is brought to zero before the processes end.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rcl_interfaces.srv import SetParametersAtomically
from std_srvs.srv import Trigger

from fjr_interface.experiment import Experiment
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE
from fjr_kit.processes import ProcessGroup
from fjr_kit.stopping import Interruption
from fjr_sim_node.drive.faults import NO_FAULT, NODE, FaultPlan, as_text

from ..graph.conductor import Conductor
from .loop_progress import RehearsalProgress
from .machine import Machine, MachineWatch
from .observer import RehearsalRecorder
from .timing import loop_timing

_POLL_S = 0.01
_SHOW_S = 1.0
_REST_S = 2.0
_AFTER_S = 1.0  # for the last torque, and for a drive whose clock is slower
_SLOWER = 1.01
_REPEATED_S = 4.0  # Fast DDS by default repeats a message after 3 s
_SILENCE_S = 8.0


@dataclass(frozen=True)
class Killing:
    """A node that is to be killed, and started again.

    Attributes:
        node: its name.
        after_s: how long after the first position.
        restart_after_s: how long after that it is started again; infinity for never.
        start: starts it.
    """

    node: str
    after_s: float
    restart_after_s: float
    start: Callable[[], None]


@dataclass(frozen=True)
class Played:
    """What came of a run.

    Attributes:
        arrivals: all messages of r, y and u, each of dtype RECORD.
        ended: how it ended, in words.
        whole: whether it ran its course.
        interrupted: whether Ctrl-C ended it.
        ended_ns: when it ended, by the machine's clock.
        killed_ns: when a node was killed, by the machine's clock; None if none was.
        trip: why the controller holds the torque at zero; None if it does not.
        bag_damage: why there is no bag; None if there is one.
        machine: what the machine did.
    """

    arrivals: list[np.ndarray]
    ended: str
    whole: bool
    interrupted: bool
    ended_ns: int
    killed_ns: int | None
    trip: str | None
    bag_damage: str | None
    machine: Machine


class RehearsalConductor(Conductor):
    """Conducts one rehearsal."""

    _recorder: RehearsalRecorder

    def __init__(
        self,
        processes: ProcessGroup,
        interruption: Interruption,
        nodes: Iterable[str],
        namespace: str,
    ) -> None:
        """Join the graph; the processes of these nodes have been started in the namespace."""
        super().__init__(processes, interruption, nodes, RehearsalRecorder, namespace)
        self._killed_ns: int | None = None
        self._restarted = False
        self._set_simulator = self._node.create_client(
            SetParametersAtomically, "simulator/set_parameters_atomically"
        )
        self._controller = {
            name: self._node.create_client(Trigger, f"controller/{name}")
            for name in ("estop", "release", "status")
        }

    def prepare_simulated(self, plan: FaultPlan | None, seed: int) -> None:
        """Give the simulated drive a fault for the next run, or none; release the controller.

        What trips before a real drive stays tripped until a person releases it.
        """
        if self._restarted:  # one that has not found our clients yet drops its answers
            self._wait_for_answers()
        self._ask_controller("release")
        on_wire = plan is not None and plan.fault.acts_on != NODE
        text = as_text(plan) if plan is not None and on_wire else NO_FAULT
        self._set_parameters(self._set_simulator, "simulator", fault=text, fault_seed=seed)

    def wait_for_drive(self, say: Callable[[str], None]) -> None:
        """Wait for somebody else's drive, as long as it takes; say what is missing."""
        said = ""
        while missing := self._missing_of_drive():
            self._executor.spin_once(timeout_sec=_POLL_S)
            self._interruption.raise_if_asked()
            self._processes.raise_if_dead()
            if missing != said:
                say(f"Waiting for a drive: {missing}.")
                said = missing

    def _missing_of_drive(self) -> str | None:
        node = self._node
        if not node.count_publishers(MOTOR_POSITION.topic):
            return f"nobody publishes {self._topic(MOTOR_POSITION)}"
        readers = node.get_subscriptions_info_by_topic(MOTOR_TORQUE.topic)
        if all(reader.node_name == self._recorder_node.get_name() for reader in readers):
            return f"nobody subscribes to {self._topic(MOTOR_TORQUE)}"
        return None

    def observe(
        self,
        experiment: Experiment,
        bag: Path,
        progress: RehearsalProgress,
        killing: Killing | None = None,
    ) -> Played:
        """Play and observe one realization.

        Raises:
            InputError: the excitation refuses the experiment.
        """
        self._killed_ns, self._restarted = None, False
        self._recorder.begin(bag, experiment)
        self._choose(0, 0)
        self._start_realization()
        watch = MachineWatch({each.name: each.pid for each in self._processes.processes})
        ended: str | None = "an error ended it"
        try:
            ended = self._watch(experiment, progress, killing)
        finally:
            if ended is not None:
                self._bring_to_rest()
        interrupted, ended_ns = self._interruption.asked, time.time_ns()
        machine = watch.ended()
        status = self._ask_controller("status")
        trip = None if status is None or status.success else str(status.message)
        arrivals = self._recorder.close()
        return Played(
            arrivals,
            ended or "it ran its course",
            ended is None,
            interrupted,
            ended_ns,
            self._killed_ns,
            trip,
            self._recorder.damage,
            machine,
        )

    def _bring_to_rest(self) -> None:
        """Take the torque to zero by the controller's ramp, and see it arrive there."""
        if self._ask_controller("estop") is None:
            return
        until = time.monotonic() + _REST_S
        while time.monotonic() < until:
            self._recorder.poll()
            torque = self._recorder.recent[-1]["value"]
            if torque.size and torque[-1] == 0.0:
                return
            time.sleep(_POLL_S)

    def _ask_controller(self, name: str) -> Trigger.Response | None:
        """Call a service of the controller; return None if it does not answer."""
        client = self._controller[name]
        if not client.service_is_ready():
            return None
        future = client.call_async(Trigger.Request())
        until = time.monotonic() + _REST_S
        while not future.done() and time.monotonic() < until:
            self._executor.spin_once(timeout_sec=_POLL_S)
        return future.result() if future.done() else None

    def _watch(
        self, experiment: Experiment, progress: RehearsalProgress, killing: Killing | None
    ) -> str | None:
        """Watch until the end; return what ended it early, None if nothing did."""
        rate = experiment.sample_rate_hz
        length_s = _SLOWER * experiment.samples / rate + _AFTER_S
        first = shown = heard = time.monotonic()
        newest_ns = 0
        while not self._recorder.complete:
            self._recorder.poll()
            now = time.monotonic()
            if self._recorder.newest_ns[1] != newest_ns:
                first = first if newest_ns else now
                newest_ns, heard = self._recorder.newest_ns[1], now
            passed_s = now - first if newest_ns else 0.0
            if self._interruption.asked:
                return f"Ctrl-C ended it after {passed_s:.1f} s"
            if dead := self._processes.dead():
                return f"{dead.obituary()} after {passed_s:.1f} s"
            if passed_s > length_s + (0.0 if self._recorder.damage else _REPEATED_S):
                return None
            if now - heard > _SILENCE_S:
                return f"no position came for {_SILENCE_S:g} s, after {heard - first:.1f} s"
            if killing is not None and newest_ns:
                self._kill(killing, passed_s)
            if now - shown > _SHOW_S:
                shown = now
                r, y, u = self._recorder.recent
                progress.show(passed_s, loop_timing(r, y, u, rate))
            time.sleep(_POLL_S)
        return None

    def _kill(self, killing: Killing, passed_s: float) -> None:
        """Kill the node, and start it again, when their times have come."""
        if self._killed_ns is None and passed_s >= killing.after_s:
            self._processes.kill(killing.node)
            self._killed_ns = time.time_ns()
        if not self._restarted and passed_s >= killing.after_s + killing.restart_after_s:
            killing.start()
            self._restarted = True
