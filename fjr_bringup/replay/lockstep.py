"""`fjr replay --into`: a bag's signals against the real nodes, in lockstep, recorded anew.

Nodes that read the bag stand in for those whose signals it gives; all others are the real ones.
"""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.topics import NODES
from fjr_kit.atomic import refuse_existing
from fjr_kit.errors import InputError
from fjr_kit.folder_lock import locked_folder
from fjr_kit.processes import ProcessGroup
from fjr_kit.stopping import Interruption

from ..campaign.progress import CampaignProgress
from ..graph.conductor import Conductor
from ..graph.domain import claimed_domain, reach
from ..graph.graph_run import ROLES, start_nodes
from .comparison import Difference, compare, report, write_report
from .lockstep_plan import CONTROLLER, LOOP, PLANT, ReplayPlan

_EXCITATION = {"excitation": "fjr_bringup.replay.excitation"}
STAND_INS: Mapping[str, Mapping[str, str]] = {
    LOOP: _EXCITATION,
    PLANT: {**_EXCITATION, "controller": "fjr_bringup.replay.controller"},
    CONTROLLER: {**_EXCITATION, "simulator": "fjr_bringup.replay.simulator"},
}
"""Node name and the module that stands in for it, by what the bag is replayed into."""

_OPEN_LOOP = {"readers": "recorder", "describe_controller": False}
"""How the excitation plays where no controller reads the reference."""


def replay_into(plan: ReplayPlan, out: Path | None) -> tuple[Path, dict[str, Difference]]:
    """Replay, compare and report.

    Args:
        plan: what to replay.
        out: folder of replay.json and the recorded bag; None for a folder beside the bag, and the
            recorded bag is not kept.

    Returns:
        The path of replay.json, and what differs, by signal.

    Raises:
        InputError: a node died or hangs, a sample was lost, or the folder can't be used.
        KeyboardInterrupt: Ctrl-C; nothing is left of the replay.
    """
    folder = out or plan.bag.absolute().parent / "replay" / plan.bag.name / plan.into
    kept = folder / plan.bag.name if out else None
    if kept is not None:
        refuse_existing(kept)
    with locked_folder(folder), _scratch() as scratch:
        place = kept or scratch / plan.bag.name
        _play(plan, place, scratch)
        differences = compare(plan.bag, place, plan.into)
        path = write_report(folder, report(plan, differences, kept))
    return path, differences


def _play(plan: ReplayPlan, bag: Path, logs: Path) -> None:
    """Play the graph and record it into a bag."""
    seconds = plan.experiment.samples / plan.experiment.sample_rate_hz
    with (
        CampaignProgress(done="replayed") as progress,
        Interruption() as interruption,
        claimed_domain() as domain,
        ProcessGroup() as processes,
    ):
        progress.expect_s(seconds)
        progress.say(f"ROS domain {domain}; {reach()}.")
        nodes = {**NODES, **STAND_INS[plan.into]}
        start_nodes(processes, nodes, [_parameters(plan, logs)], logs)
        with Conductor(processes, interruption) as conductor:
            conductor.wait_for_graph()
            progress.describe(f"replay into the {plan.into}")
            conductor.play(bag, plan.experiment, progress)


def _parameters(plan: ReplayPlan, folder: Path) -> Path:
    """Write the parameters of all nodes; return the file."""
    bag = {"bag": str(plan.bag.absolute())}
    values: dict[str, dict[str, Any]] = {
        node: {**plan.values.get(node, bag), **ROLES[node]} for node in NODES
    }
    if plan.into == PLANT:
        values["excitation"].update(_OPEN_LOOP)
    file = folder / "nodes.yaml"
    save_parameter_file(file, values)
    return file


@contextlib.contextmanager
def _scratch() -> Iterator[Path]:
    """Make a folder that is removed unless a sentence may name a log in it."""
    folder = Path(tempfile.mkdtemp(prefix="fjr-replay-"))
    try:
        yield folder
    except InputError:
        raise
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)
