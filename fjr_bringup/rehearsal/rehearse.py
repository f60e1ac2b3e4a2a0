"""A rehearsal: plays one realization in real time, observes the loop and judges it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.experiment import Experiment
from fjr_interface.ros import fast_dds
from fjr_interface.topics import NAMESPACE, NODES
from fjr_kit.atomic import write_whole
from fjr_kit.check import Check
from fjr_kit.folder_lock import locked_folder
from fjr_kit.invocation import provenance
from fjr_kit.processes import ProcessGroup
from fjr_kit.stopping import Interruption
from fjr_sim_node.drive.faults import NODE, FaultPlan
from fjr_sim_node.simulation.simulator import run_realization

from ..campaign.plan import CAMPAIGN_FILE
from ..graph.domain import claimed_domain, reach
from ..graph.graph_run import ros_arguments, save_roles
from ..graph.launching import moved_file
from .limits import judge, limit_check
from .loop_progress import RehearsalProgress
from .prediction import predict
from .rehearsal_run import Killing, Played, RehearsalConductor
from .report import render
from .request import EXTERNAL, SIMULATED, Options, Plan, check_options
from .result import Rehearsal
from .safety import onset_ns, safe_state
from .timing import loop_timing

REPORT, RESULT = "report.html", "rehearsal.json"


def rehearse(options: Options, progress: RehearsalProgress) -> tuple[Rehearsal, Path, bool]:
    """Rehearse.

    Returns:
        What was found, the path of the report, and whether Ctrl-C ended it.

    Raises:
        InputError: bad options or files, or the graph does not start.
        KeyboardInterrupt: Ctrl-C before anything was measured.
    """
    plan = check_options(options)
    if plan.longer:
        progress.say(plan.longer)
    with locked_folder(plan.folder):
        return _rehearse(plan, progress)


def _rehearse(plan: Plan, progress: RehearsalProgress) -> tuple[Rehearsal, Path, bool]:
    options = plan.options
    plan.campaign.open_folder(plan.folder)
    if options.network:
        os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
        fast_dds.set_defaults(os.environ)
    with Interruption() as interruption, claimed_domain() as domain:
        progress.say(f"ROS domain {domain}; {reach()}.")
        with Graph(plan, progress, interruption) as graph:
            played = graph.play(plan.fault, options.seed)
        found = judged(plan, played, domain)
        report = _write(found, plan.folder, options.command)
    return found, report, played.interrupted


class Graph:
    """The running graph of a rehearsal: a context manager in which it can be played repeatedly."""

    def __init__(self, plan: Plan, progress: RehearsalProgress, interruption: Interruption) -> None:
        """Prepare; entering starts the processes in the claimed domain."""
        self._plan, self._progress, self._interruption = plan, progress, interruption
        self._logs = plan.folder / "log"

    def __enter__(self) -> Graph:
        """Start the processes and wait until all are there."""
        plan = self._plan
        self._logs.mkdir()
        campaign, namespace = plan.folder / CAMPAIGN_FILE, plan.options.namespace
        if namespace != NAMESPACE:
            campaign = moved_file(campaign, namespace, self._logs)
        files = [campaign, save_roles(self._logs, plan.roles, namespace)]
        self._arguments = ros_arguments(files, namespace)
        with ExitStack() as stack:
            self._processes = stack.enter_context(ProcessGroup())
            for node in plan.nodes:
                self._start(node)
            self._conductor = RehearsalConductor(
                self._processes, self._interruption, plan.nodes, namespace
            )
            stack.enter_context(self._conductor)
            if plan.options.drive == EXTERNAL:
                self._conductor.wait_for_drive(self._progress.say)
            self._conductor.wait_for_graph()
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """End the processes."""
        self._stack.close()

    @property
    def pids(self) -> dict[str, int]:
        """Process numbers of the nodes that run, by name."""
        return {process.name: process.pid for process in self._processes.processes}

    def _start(self, node: str, suffix: str = "") -> None:
        log = self._logs / f"{node}{suffix}.log"
        self._processes.start(node, NODES[node], self._arguments, log)

    def play(self, fault: FaultPlan | None = None, seed: int = 1, name: str = "") -> Played:
        """Play and observe the experiment once.

        Args:
            fault: what is to go wrong.
            seed: its seed.
            name: folder for the bag, below that of the rehearsal; it is made.
        """
        plan, folder = self._plan, self._plan.folder / name
        folder.mkdir(exist_ok=True)
        experiment = plan.experiment
        self._progress.expect(experiment.samples / experiment.sample_rate_hz)
        if plan.options.drive == SIMULATED:
            self._conductor.prepare_simulated(fault, seed)
        bag = bag_folder(folder, 0, 0)
        return self._conductor.observe(experiment, bag, self._progress, self._killing(fault))

    def _killing(self, fault: FaultPlan | None) -> Killing | None:
        if fault is None or fault.fault.acts_on != NODE:
            return None
        node = str(fault.values["node"])
        after_s, restart_s = fault.number("after_s"), fault.number("restart_after_s")
        return Killing(node, after_s, restart_s, partial(self._start, node, "_restarted"))


def judged(plan: Plan, played: Played, domain: int) -> Rehearsal:
    """Return what a run shows, measured by the plan's limits."""
    experiment, limits = plan.experiment, plan.limits.limits
    reference, position, torque = played.arrivals
    timing = loop_timing(reference, position, torque, experiment.sample_rate_hz)
    prediction = None
    if plan.knows_the_plant and timing.delay_s.size:
        prediction = predict(plan.campaign.values["simulator"], experiment, timing.delay_s)
    response = None
    if prediction is not None and plan.options.drive == SIMULATED:
        response = distance(
            plan.campaign.values["simulator"], experiment, prediction.delay_median_s, position
        )
    checks = judge(timing, prediction, limits, response)
    course = (
        limit_check("course", not played.whole, 0.0, played.ended),
        limit_check(
            "trip", played.trip is not None, 0.0, played.trip or "the controller has not tripped"
        ),
    )
    return Rehearsal(
        drive=plan.options.drive,
        hardware=bool(plan.options.hardware),
        domain=domain,
        reach=reach(),
        planned_s=experiment.samples / experiment.sample_rate_hz,
        ended=played.ended,
        fault=plan.fault_data,
        fault_seed=plan.options.seed,
        timing=timing,
        prediction=prediction,
        checks=(*course, *checks, *_safe_state(plan, played)),
        limits=limits,
        bag=None if played.bag_damage else bag_folder(plan.folder, 0, 0).name,
        bag_damage=played.bag_damage,
        experiment=experiment.model_dump(by_alias=True),
        machine=played.machine,
        signals=played.arrivals,
    )


def _safe_state(plan: Plan, played: Played) -> tuple[Check, ...]:
    if plan.fault is None:
        return ()
    _, position, torque = played.arrivals
    began_ns = onset_ns(plan.fault, position, played.killed_ns)
    end_ns, limit_nm = played.ended_ns, plan.torque_limit_nm
    check = safe_state(plan.fault, began_ns, position, torque, end_ns, limit_nm, plan.ahead_s)
    return (check,)


def distance(
    values: Mapping[str, Any], experiment: Experiment, delay_s: float, position: np.ndarray
) -> float:
    """Return how far positions are from the simulated ones, after the transient: relative rms.

    Args:
        values: checked SIMULATOR values.
        experiment: what was played.
        delay_s: delay of the loop.
        position: messages of y, of dtype RECORD.

    Returns:
        NaN if no position after the transient was seen.
    """
    delay = min(delay_s + values["delay.time_s"], 0.01)  # the most that the effect takes
    simulated = run_realization({**values, "delay.time_s": delay}, experiment).position
    skipped = experiment.transient_periods * experiment.samples_per_period
    _, of_seen, of_simulated = np.intersect1d(
        position["stamp"], experiment.stamps_ns[skipped:], return_indices=True
    )
    seen, due = position["value"][of_seen], simulated[skipped:][of_simulated]
    finite = np.isfinite(seen)
    if not finite.any():
        return float("nan")
    return float(np.sqrt(np.mean((seen - due)[finite] ** 2) / np.mean(due[finite] ** 2)))


def _write(found: Rehearsal, folder: Path, command: str | None) -> Path:
    write_whole(folder / RESULT, found.to_json())
    date = f"{datetime.now():%Y-%m-%d %H:%M:%S}"
    report = folder / REPORT
    write_whole(report, render(found, provenance(command, date)))
    return report
