"""The request for a rehearsal, checked as a whole before anything starts."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from controller_node.limits import check_hardware
from controller_node.node import PARAMETERS as CONTROLLER
from excitation_node.node import PARAMETERS as EXCITATION
from fjr_interface.experiment import Experiment
from fjr_interface.real_time import REAL_TIME
from fjr_interface.topics import NAMESPACE, NODES, checked_namespace
from fjr_kit.errors import InputError
from fjr_sim_node.drive.faults import NODE, FaultPlan, as_text

from ..campaign.plan import GROUPS, Campaign
from .limits import LimitsFile

SIMULATED, EXTERNAL = "simulated", "external"

_AHEAD_S = 0.5
_MOST_AHEAD = (
    400  # a burst that fits a queue of shared memory; what it drops, DDS repeats after 3 s
)


@dataclass(frozen=True)
class Options:
    """What the user asked for.

    Attributes:
        rig: parameter file of rig and experiment; None for the paper's.
        out: folder; None for a new one below ./rehearsals.
        duration_s: how long; None for one realization as the rig file has it.
        rate_hz: rate of the samples; None for that of the rig file.
        limits: limits file; None for the defaults.
        fault: as `FaultPlan.parse` takes it.
        seed: seed of the fault.
        drive: SIMULATED or EXTERNAL.
        hardware: whether an external drive moves hardware; None if it was not said.
        confirm: name of the joint that the user says is going to move.
        network: whether discovery may leave this machine.
        namespace: where the nodes and their topics are.
        overrides: {node: {parameter: value}} that win over the rig file.
        command: the command line, for the report.
    """

    rig: Path | None = None
    out: Path | None = None
    duration_s: float | None = None
    rate_hz: float | None = None
    limits: Path | None = None
    fault: str = ""
    seed: int = 1
    drive: str = SIMULATED
    hardware: bool | None = None
    confirm: str | None = None
    network: bool = False
    namespace: str = NAMESPACE
    overrides: Mapping[str, Mapping[str, Any]] = dataclasses.field(default_factory=dict)
    command: str | None = None


@dataclass(frozen=True)
class Plan:
    """A rehearsal whose options have been checked.

    Attributes:
        options: as given.
        campaign: one realization at one level.
        limits: from the limits file.
        controller: what the controller is told beside its part of the campaign.
        fault: the fault to rehearse; None for none.
        folder: where everything goes.
    """

    options: Options
    campaign: Campaign
    limits: LimitsFile
    controller: dict[str, Any]
    fault: FaultPlan | None
    folder: Path

    @property
    def experiment(self) -> Experiment:
        """What is played."""
        return self.campaign.experiment(0, 0)

    @property
    def longer(self) -> str:
        """What to say where more is played than was asked for; empty where it is not."""
        experiment, asked_s = self.experiment, self.options.duration_s
        played_s = experiment.samples / experiment.sample_rate_hz
        if asked_s is None or played_s <= asked_s * (1.0 + 1e-9):
            return ""
        period_s = experiment.samples_per_period / experiment.sample_rate_hz
        return (
            f"{played_s:g} s are played instead of {asked_s:g} s: {experiment.transient_periods} "
            f"discarded and {experiment.periods} kept of the whole periods of {period_s:g} s; "
            "excitation.base_frequency_hz sets their length."
        )

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes that are started here."""
        return tuple(n for n in NODES if n != "simulator" or self.options.drive == SIMULATED)

    @property
    def window(self) -> int:
        """How many references are streamed ahead."""
        ahead = round(_AHEAD_S * self.experiment.sample_rate_hz)
        return min(max(ahead, int(EXCITATION["window"].low)), _MOST_AHEAD)

    @property
    def ahead_s(self) -> float:
        """How far references are streamed ahead (s)."""
        return self.window / self.experiment.sample_rate_hz

    @property
    def torque_limit_nm(self) -> float:
        """The torque that the controller may not exceed."""
        limit: Any = self.campaign.values["controller"]["torque_limit_nm"]
        return float(limit)

    @property
    def knows_the_plant(self) -> bool:
        """Whether the rig's parameters are meant to be those of the drive."""
        return self.options.drive == SIMULATED or self.options.rig is not None

    @property
    def fault_data(self) -> dict[str, Any]:
        """Kind and parameters of the fault, empty without one."""
        if self.fault is None:
            return {}
        return {"kind": self.fault.fault.identifier, **self.fault.values}

    @property
    def roles(self) -> dict[str, dict[str, Any]]:
        """What makes a rehearsal of the nodes of a campaign, by node."""
        roles: dict[str, dict[str, Any]] = {
            "controller": {"mode": REAL_TIME, "readers": "recorder", **self.controller},
            "excitation": {
                "readers": "controller,recorder",
                "autostart": False,
                "pace": "recorded",
                "window": self.window,
            },
        }
        if self.options.drive == SIMULATED:
            roles["controller"]["readers"] = "simulator,recorder"
            roles["simulator"] = {"mode": REAL_TIME, "readers": "controller,recorder"}
        return roles


def check_options(options: Options) -> Plan:
    """Check everything.

    Raises:
        InputError: bad options or files; nothing has been written.
    """
    limits = LimitsFile.load(options.limits)
    _check_drive(options)
    options = dataclasses.replace(options, namespace=checked_namespace(options.namespace))
    controller = _controller(options, limits)
    source = f"{options.limits}: controller" if options.limits else ""
    check_hardware(CONTROLLER.check(controller, source))
    fault = FaultPlan.parse(options.fault)
    if fault is not None and options.drive == EXTERNAL:
        _check_fault_of_external(fault)
    folder = options.out or Path("rehearsals") / f"{datetime.now():%Y-%m-%d_%H%M%S}"
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder} exists and is not empty; name another --out folder.")
    return Plan(options, _campaign(options, limits), limits, controller, fault, folder)


def _controller(options: Options, limits: LimitsFile) -> dict[str, Any]:
    """Return the controller's parameters beside those of a campaign."""
    hardware = {"hardware": bool(options.hardware), "confirm": options.confirm or ""}
    return {**limits.controller, **hardware}


def _check_drive(options: Options) -> None:
    if options.drive == SIMULATED:
        if options.hardware:
            raise InputError("--hardware is for --drive external; the simulated drive moves none.")
        return
    if options.hardware is None:
        raise InputError(
            "An external drive may move hardware: say --hardware, or --no-hardware if it does not."
        )
    if not options.hardware:
        return
    if options.limits is None:
        raise InputError("A hardware run needs a limits file: give --limits FILE.")
    if "controller" in options.overrides:
        raise InputError("A hardware run takes the controller from its files: leave --set out.")


def _check_fault_of_external(fault: FaultPlan) -> None:
    if fault.fault.acts_on != NODE or fault.values["node"] == "simulator":
        raise InputError(
            f"Fault {as_text(fault)} lies in the simulated drive; leave --drive external out, or "
            "rehearse node_killed of controller or excitation."
        )


def _campaign(options: Options, limits: LimitsFile) -> Campaign:
    """Return one realization at the greatest amplitude, as long as asked for."""
    overrides = {node: dict(values) for node, values in options.overrides.items()}
    if options.rate_hz is not None:
        for node in NODES:
            overrides.setdefault(node, {})["sample_rate_hz"] = options.rate_hz
    law = {name: v for name, v in limits.controller.items() if name in GROUPS["controller"]}
    overrides["controller"] = {**overrides.get("controller", {}), **law}
    campaign = Campaign.create(options.rig, overrides)
    given: Any = campaign.values["excitation"]
    played = {"realizations": 1, "amplitudes_rad": (max(given["amplitudes_rad"]),)}
    if options.duration_s is not None:
        periods = math.ceil(options.duration_s * given["base_frequency_hz"] - 1e-9)
        played["periods"] = max(periods - given["transient_periods"], 1)
    return Campaign.create(None, {**campaign.values, "excitation": {**given, **played}})
