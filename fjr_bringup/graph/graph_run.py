"""Runs a campaign through the real ROS graph and records one bag per realization."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.topics import NAMESPACE, NODES
from fjr_kit.processes import ProcessGroup
from fjr_kit.stopping import Interruption
from fjr_sim_node.simulation.simulator import recorded_signals

from ..campaign.live import LiveBla
from ..campaign.plan import CAMPAIGN_FILE, Campaign
from ..campaign.progress import CampaignProgress
from .conductor import Conductor
from .domain import claimed_domain, reach
from .recorder import Recorder

ROLES: dict[str, dict[str, Any]] = {
    "simulator": {"readers": "controller,recorder"},
    "controller": {"readers": "simulator,recorder"},
    "excitation": {"readers": "controller,recorder", "autostart": False, "pace": "recorded"},
}
"""How the nodes play their parts when a recorder listens and a campaign conducts."""


def run_campaign(
    campaign: Campaign,
    folder: Path,
    *,
    composed: bool = False,
    live: LiveBla | None = None,
    progress: CampaignProgress,
) -> list[Path]:
    """Run what the folder lacks of a campaign through the ROS graph.

    Args:
        campaign: what to run.
        folder: experiment folder; an interrupted campaign in it is resumed.
        composed: all nodes in one process instead of one each.
        live: told of each bag; what it finds good enough is not recorded further.
        progress: where progress is shown.

    Returns:
        The bags that were recorded.

    Raises:
        InputError: a node died or hangs, a sample was lost, or the folder can't be used.
    """
    pending = campaign.open_folder(folder)
    progress.expect(campaign, pending)
    if live is not None:
        live.take_up(folder, pending)
        pending = [run for run in pending if not live.enough(run[0])]
    if not pending:
        return []
    logs = folder / "log"
    logs.mkdir(exist_ok=True)
    with Interruption() as interruption, claimed_domain() as domain, ProcessGroup() as processes:
        progress.say(f"ROS domain {domain}; {reach()}.")
        files = [folder / CAMPAIGN_FILE, save_roles(logs, ROLES)]
        if composed:
            name = "simulator, controller and excitation"
            log = logs / "composed.log"
            processes.start(name, "fjr_bringup.graph.composed", ros_arguments(files), log)
        else:
            start_nodes(processes, NODES, files, logs)
        recorder = partial(Recorder, signals=recorded_signals(campaign.values["simulator"]))
        with Conductor(processes, interruption, recorder=recorder) as conductor:
            conductor.wait_for_graph()
            bags = []
            for level, realization in pending:
                if live is not None and live.enough(level):
                    continue
                bags.append(conductor.record(campaign, folder, level, realization, progress))
                if live is not None:
                    live.take(level, realization, bags[-1])
            return bags


def save_roles(
    logs: Path, roles: Mapping[str, Mapping[str, Any]], namespace: str = NAMESPACE
) -> Path:
    """Write how the nodes play their parts, {node: {parameter: value}}; return the file."""
    file = logs / "roles.yaml"
    save_parameter_file(file, roles, namespace=namespace)
    return file


def ros_arguments(files: Sequence[Path], namespace: str = NAMESPACE) -> list[str]:
    """Return the ROS arguments that make a node read parameter files, of which later ones win.

    Args:
        files: with the node in the namespace.
        namespace: where the node is to be.
    """
    words = [word for file in files for word in ("--params-file", str(file))]
    return words if namespace == NAMESPACE else [*words, "-r", f"__ns:={namespace}"]


def start_nodes(
    processes: ProcessGroup, nodes: Mapping[str, str], files: Sequence[Path], logs: Path
) -> None:
    """Start each named node's module in a process of its own, with the parameter files."""
    for node, module in nodes.items():
        processes.start(node, module, ros_arguments(files), logs / f"{node}.log")
