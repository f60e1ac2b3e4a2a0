"""Plan of a replay in lockstep: its nodes and parameters, checked before any node starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from controller_node import pd_filtered
from fjr_interface.bags.reader import audit
from fjr_interface.experiment import Experiment
from fjr_interface.parameter_file import load_parameter_file
from fjr_interface.parameters import Value
from fjr_kit.errors import InputError
from fjr_sim_node.simulation.simulator import SIMULATOR, encoder_noise

from ..campaign.plan import CAMPAIGN_FILE, GROUPS
from ..campaign.settings import parse_settings
from .bag import read_description, the_bag

LOOP, PLANT, CONTROLLER = "closed-loop", "plant", "controller"

PLAYED_ANEW = {
    LOOP: ("position", "torque"),
    PLANT: ("position",),
    CONTROLLER: ("torque",),
}
"""Signals that the graph makes anew, by what the bag is replayed into; the others are the bag's."""

PAPER = "paper"
"""Names the paper's rig."""

_PARTS = {LOOP: ("simulator", "controller"), PLANT: ("simulator",), CONTROLLER: ("controller",)}


@dataclass(frozen=True)
class ReplayPlan:
    """One bag and what it is replayed into.

    Attributes:
        bag: the bag's folder.
        into: LOOP, PLANT or CONTROLLER.
        rig: where the simulator's parameters come from; None without a simulator.
        values: {node: {parameter: value}} of the nodes that take part for real.
        experiment: what is played: the bag's description, with the controller that takes part.
    """

    bag: Path
    into: str
    rig: str | None
    values: dict[str, dict[str, Value]]
    experiment: Experiment


def plan_replay(
    bag: Path, into: str, rig: str | None = None, settings: Sequence[str] = ()
) -> ReplayPlan:
    """Check bag, rig and settings.

    Args:
        bag: a bag, or a folder with one bag.
        into: LOOP, PLANT or CONTROLLER.
        rig: parameter file, or PAPER; None for the campaign.yaml beside the bag.
        settings: `node.parameter=value` that win over it.

    Raises:
        InputError: the bag is not whole or describes no experiment, a controller that no node can
            play, bad parameters, or none.
    """
    bag = the_bag(bag)
    experiment = read_description(str(bag))
    given = _settings(settings, into)
    values: dict[str, dict[str, Value]] = {}
    source: str | None = None
    file: Mapping[str, Mapping[str, Any]] = {}
    if "simulator" in _PARTS[into]:
        source, file = _rig(bag, rig)
    elif rig is not None:
        raise InputError("--rig names a simulated plant, but none takes part; leave it out.")
    if "controller" in _PARTS[into]:
        values["controller"] = _controller(bag, experiment, file, given.get("controller", {}))
        described = pd_filtered.describe(values["controller"])
        experiment = experiment.model_copy(update={"controller": described})
    if source is not None:
        values["simulator"] = _simulator(source, file, given.get("simulator", {}), experiment)
    audit(bag)
    return ReplayPlan(bag, into, source, values, experiment)


def _settings(settings: Sequence[str], into: str) -> dict[str, dict[str, Any]]:
    given = parse_settings(settings)
    for node in given:
        if node not in _PARTS[into]:
            raise InputError(
                f"--set {node}.{next(iter(given[node]))}: no {node} node takes part in a replay "
                f"into the {into}; leave it out."
            )
    return given


def _rig(bag: Path, rig: str | None) -> tuple[str, dict[str, dict[str, Any]]]:
    """Return the name of the simulated rig's parameters, and them by node."""
    if rig == PAPER:
        return PAPER, {}
    file = bag.absolute().parent / CAMPAIGN_FILE if rig is None else Path(rig)
    if rig is None and not file.exists():
        raise InputError(
            f"{bag}: no {CAMPAIGN_FILE} lies beside the bag; name the simulated rig's parameter "
            "file with --rig FILE, or --rig paper."
        )
    return str(file), load_parameter_file(file, groups=GROUPS)


def _controller(
    bag: Path,
    experiment: Experiment,
    file: Mapping[str, Mapping[str, Any]],
    settings: Mapping[str, Any],
) -> dict[str, Value]:
    """Return the controller of the bag's description, else of the file, with the settings."""
    rate, described = experiment.sample_rate_hz, experiment.controller
    if described is not None and described.get("kind") != "pd_filtered":
        raise InputError(
            f"{bag}: its controller is a {described.get('kind')}, which the controller node cannot "
            "play; replay the bag --into plant."
        )
    base: Mapping[str, Any]
    if described is not None:
        base = pd_filtered.from_description(described, rate)
    elif "controller" in file or settings:
        base = {"sample_rate_hz": rate, **file.get("controller", {})}
    else:
        raise InputError(
            f"{bag}: describes no controller; give one with --set controller.p=... and so on, or "
            "replay the bag --into plant."
        )
    return _at_rate(pd_filtered.CONTROLLER.check({**base, **settings}, "controller"), rate)


def _simulator(
    source: str,
    file: Mapping[str, Mapping[str, Any]],
    settings: Mapping[str, Any],
    experiment: Experiment,
) -> dict[str, Value]:
    rate = experiment.sample_rate_hz
    merged = {"sample_rate_hz": rate, **file.get("simulator", {}), **settings}
    values = _at_rate(SIMULATOR.check(merged, f"{source}: simulator"), rate)
    encoder_noise(values, experiment)  # refuses what the node would refuse
    return values


def _at_rate(values: dict[str, Value], rate_hz: float) -> dict[str, Value]:
    if values["sample_rate_hz"] != rate_hz:
        raise InputError(
            f"sample_rate_hz is {values['sample_rate_hz']:g} but the bag's is {rate_hz:g}; a "
            "replay is at the bag's."
        )
    return values
