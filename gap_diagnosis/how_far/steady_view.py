"""What only steady periods show: residual maps line by line, and residual torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment

from ..gates.gate_checks import GateReport
from ..model.rig_model import Model
from ..model.simulated_rig import Signals, Simulator
from ..where.residual_map import ResidualMap, residual_map
from ..where.residual_torque import ResidualTorque, residual_torque


@dataclass(frozen=True)
class SteadyView:
    """An experiment of steady periods beside simulations of it.

    Attributes:
        recorded: the experiment.
        gates: outcome of the gates.
        noise: noise of the lines; None where only one period was kept.
        held: indices of the realizations that no fit has seen; all, where there is none.
        models: by stage: nominal, refit, explained; none where a gate forbids simulations.
    """

    recorded: RecordedExperiment
    gates: GateReport
    noise: NoiseLevels | None
    held: tuple[int, ...]
    models: Mapping[str, Model]

    @cached_property
    def signals(self) -> Mapping[str, Signals]:
        """Simulated steady period of each realization by stage."""
        simulator = Simulator(self.recorded)
        return {name: simulator.signals(model) for name, model in self.models.items()}

    @cached_property
    def maps(self) -> Mapping[str, ResidualMap]:
        """Residual map of each stage."""
        return {
            name: residual_map(self.recorded, self.noise, *signals)
            for name, signals in self.signals.items()
        }

    @cached_property
    def residual_torques(self) -> Mapping[str, ResidualTorque]:
        """Residual torque of the refit and of the best explanation."""
        return {
            name: residual_torque(self.recorded, model, self.noise)
            for name, model in self.models.items()
            if name != "nominal"
        }
