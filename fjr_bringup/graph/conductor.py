"""Conducts the running graph: starts realizations, records them, notices nodes that end or hang."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NoReturn

import rclpy
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.experiment import Experiment
from fjr_interface.ros.session import ros_session
from fjr_interface.topics import NAMESPACE, NODES, Signal
from fjr_kit.errors import InputError
from fjr_kit.processes import ProcessGroup
from fjr_kit.stopping import Interruption

from ..campaign.plan import Campaign
from ..campaign.progress import CampaignProgress
from .answers import ANSWER_S, answer_of, refuse_trip
from .recorder import Recorder

_POLL_S = 0.01
_START_S = 90.0  # the very first start compiles the physics
_TRY_S = 10.0
_SILENCE_S = 4.0  # a node of a stalled realization that answers nothing for so long hangs
_STALL_S = 8.0  # Fast DDS by default repeats a message after 3 s
_PREPARATION_S = 5e-6  # for each sample: the nodes make reference and noise before the first one


class Conductor:
    """Talks to the graph: sets the realization, starts it, records it, notices who hangs."""

    def __init__(
        self,
        processes: ProcessGroup,
        interruption: Interruption,
        nodes: Iterable[str] = tuple(NODES),
        recorder: Callable[[Node], Recorder] = Recorder,
        namespace: str = NAMESPACE,
    ) -> None:
        """Join the graph; the processes of these nodes have been started in the namespace."""
        self._processes = processes
        self._nodes = tuple(nodes)
        self._interruption = interruption
        self._stack = ExitStack()
        self._stack.enter_context(ros_session())
        self._node = rclpy.create_node("campaign", namespace=namespace)
        self._recorder_node = rclpy.create_node("recorder", namespace=namespace)
        self._recorder = recorder(self._recorder_node)
        self._said_still = False
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._set = self._node.create_client(
            SetParametersAtomically, "excitation/set_parameters_atomically"
        )
        self._start = self._node.create_client(Trigger, "excitation/start")

    def __enter__(self) -> Conductor:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give a bag under way up and leave the graph."""
        self._recorder.abort()
        self._executor.shutdown()
        self._node.destroy_node()
        self._recorder_node.destroy_node()
        self._stack.close()

    def wait_for_graph(self) -> None:
        """Wait until every node is there, alone, and knows the recorder.

        A node that answers has matched what was announced before the client that asks it: the
        recorder's subscriptions and the other clients.
        """
        self._wait_for_answers()
        until = time.monotonic() + _STALL_S
        while self._recorder.unwritten or not self._start.service_is_ready():
            self._wait_a_moment(until, "excitation")
        self._refuse_others()

    def _wait_for_answers(self) -> None:
        for node in self._nodes:
            until = time.monotonic() + _START_S
            while not self._answers(node, until):
                pass

    def _answers(self, node: str, until: float) -> bool:
        """Return whether a node answers soon; the next try is made by a client found anew."""
        client = self._node.create_client(GetParameters, f"{node}/get_parameters")
        future, asked = None, 0.0
        patience = time.monotonic() + _TRY_S
        while not (future and future.done()) and time.monotonic() < patience:
            # A node that has not matched the client yet drops its answer: ask again.
            if client.service_is_ready() and time.monotonic() > asked + ANSWER_S:
                asked = time.monotonic()
                future = client.call_async(GetParameters.Request(names=["joint"]))
            self._wait_a_moment(until, node)
        self._node.destroy_client(client)
        return bool(future and future.done())

    def _refuse_others(self) -> None:
        for signal in self._recorder.signals:
            writers = self._node.get_publishers_info_by_topic(signal.topic)
            if len(writers) > 1:
                names = ", ".join(f"{each.node_namespace}/{each.node_name}" for each in writers)
                raise InputError(
                    f"Several nodes publish on {self._topic(signal)} ({names}); stop the others "
                    "or set another ROS_DOMAIN_ID."
                )

    def _topic(self, signal: Signal) -> str:
        return str(self._node.resolve_topic_name(signal.topic))

    def _wait_a_moment(self, until: float, suspect: str) -> None:
        self._executor.spin_once(timeout_sec=_POLL_S)
        self._interruption.raise_if_asked()
        self._processes.raise_if_dead()
        if time.monotonic() > until:
            self._blame(suspect)

    def _blame(self, node: str) -> NoReturn:
        words = self._processes.named(node).last_words()
        raise InputError(f"The {node} node hangs{words}")

    def _call(self, client: Any, request: Any, node: str, until: float) -> Any:
        future = client.call_async(request)
        while not future.done():
            self._wait_a_moment(until, node)
        return future.result()

    def record(
        self,
        campaign: Campaign,
        folder: Path,
        level: int,
        realization: int,
        progress: CampaignProgress,
    ) -> Path:
        """Play and record one realization; return its bag."""
        bag = bag_folder(folder, level, realization)
        experiment = campaign.experiment(level, realization)
        level_text = f"level {level + 1} of {campaign.levels}, " if campaign.levels > 1 else ""
        progress.describe(f"{level_text}realization {realization + 1} of {experiment.realizations}")
        self._choose(level, realization)
        return self.play(bag, experiment, progress)

    def play(self, bag: Path, experiment: Experiment, progress: CampaignProgress) -> Path:
        """Start the realization that the excitation has, and record it; return its bag."""
        self._recorder.begin(bag, experiment)
        self._start_realization()
        self._record_all(experiment, progress)
        refuse_trip(self._node, self._executor)
        self._recorder.finish()
        progress.finish_run(f"{bag.name} recorded", experiment.samples / experiment.sample_rate_hz)
        return bag

    def _choose(self, level: int, realization: int) -> None:
        self._set_parameters(self._set, "excitation", level=level, realization=realization)

    def _start_realization(self) -> None:
        until = time.monotonic() + _STALL_S
        answer = self._call(self._start, Trigger.Request(), "excitation", until)
        if not answer.success:
            raise InputError(f"The excitation refuses to start: {answer.message}")

    def _set_parameters(self, client: Any, node: str, **values: int | str) -> None:
        request = SetParametersAtomically.Request()
        for name, value in values.items():
            if isinstance(value, str):
                kind = {"type": ParameterType.PARAMETER_STRING, "string_value": value}
            else:
                kind = {"type": ParameterType.PARAMETER_INTEGER, "integer_value": value}
            request.parameters.append(Parameter(name=name, value=ParameterValue(**kind)))
        until = time.monotonic() + _STALL_S
        result = self._call(client, request, node, until).result
        if not result.successful:
            raise InputError(f"The {node} refuses: {result.reason}")

    def _record_all(self, experiment: Experiment, progress: CampaignProgress) -> None:
        seen = 0
        until = time.monotonic() + _STALL_S + _PREPARATION_S * experiment.samples
        while not self._recorder.complete:
            samples = self._recorder.poll()
            if samples != seen:
                seen = samples
                until = time.monotonic() + _STALL_S
                progress.update(samples / experiment.sample_rate_hz)
            self._interruption.raise_if_asked()
            self._processes.raise_if_dead()
            if time.monotonic() > until:
                if not self._stands_still(progress):
                    self._blame_who_hangs()
                until = time.monotonic() + _STALL_S
            time.sleep(_POLL_S)

    def _stands_still(self, progress: CampaignProgress) -> bool:
        """Return whether somebody has paused or stopped the simulation; say so once."""
        answer = answer_of("simulator/status", self._node, self._executor)
        if answer is None or answer.message.startswith("playing"):
            self._said_still = False
            return False
        if not self._said_still:
            progress.say(f"The simulation is {answer.message}. `fjr play` lets it go on.")
            self._said_still = True
        return True

    def _blame_who_hangs(self) -> NoReturn:
        """Blame the node that answers nothing; the one that owes a message if all of them answer.

        A node that stops while it sends has reached some of its readers: to the recorder it looks
        as if another one owed the answer.
        """
        owes = self._who_owes()
        for node in (owes, *(each for each in self._nodes if each != owes)):
            self._answers(node, time.monotonic() + _SILENCE_S)
        self._blame(owes)

    def _who_owes(self) -> str:
        """Return the node that owes the next message, by the newest stamp of each signal."""
        reference, position, torque = self._recorder.newest_ns[:3]
        if not self._recorder.described:  # it follows the controller's answer to the reference
            return "controller" if reference else "excitation"
        if reference < position:
            return "excitation"
        return "simulator" if position <= torque else "controller"
