"""Experiment folders of real bags with a chosen effect, made by batch simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_interface.bags.writer import BagWriter
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.gates.bag_changes import BagChanges
from gap_diagnosis.gates.bags_gate import run_changes
from gap_diagnosis.investigation import Fitted
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.steady_runs import steady_runs
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.starts.search_space import TOLERANCE

LEVELS_RAD = (2e-3, 7e-3, 2e-2)
NOISE_RAD = 2e-5
SHORT = {"base_frequency_hz": 0.5, "levels_rad": (5e-3, 2e-2), "transient_periods": 2}
"""Arguments of `simulate_case` for a case that is quickly fitted."""


@dataclass(frozen=True)
class Case:
    """An experiment and the rig that made it.

    Attributes:
        recorded: what was recorded, in memory.
        rig: checked SIMULATOR values of the rig.
        truth: the rig as a model, effects included.
    """

    recorded: RecordedExperiment
    rig: Mapping[str, float]
    truth: Model

    @property
    def bare(self) -> Model:
        """The rig's true bare parameters without the effect."""
        return Model(self.truth.plant, {})


def true_parameters(seed: int, off: float = 0.08) -> dict[str, float]:
    """Return the paper's parameters, each up to `off` wrong."""
    factors = 1.0 + np.random.default_rng([seed, 77]).uniform(-off, off, len(PLANT.names))
    return {p.name: p.default * f for p, f in zip(PLANT, factors, strict=True)}


def simulate_case(
    effects: Mapping[str, float] | None = None,
    *,
    seed: int = 0,
    off: float = 0.08,
    levels_rad: Sequence[float] = LEVELS_RAD,
    realizations: int = 2,
    periods: int = 2,
    transient_periods: int = 1,
    noise_rad: float = NOISE_RAD,
    with_link: bool = False,
    base_frequency_hz: float = 0.25,
    order: str = "levels",
    grid: str = "odd_random",
    controller: Mapping[str, Any] | None = None,
    plant: Mapping[str, float] | None = None,
    **played: float,
) -> Case:
    """Simulate an experiment as the sealed cases are made, in memory.

    What is not named here, such as the highest frequency, is a parameter of the excitation.
    """
    effects = dict(effects or {})
    rig = SIMULATOR.check(
        {
            **true_parameters(seed, off),
            **(plant or {}),
            **effects,
            "noise_std_rad": noise_rad,
            "noise_seed": seed + 1,
        }
    )
    excitation = multisine.EXCITATION.check(
        {
            "base_frequency_hz": base_frequency_hz,
            "f_min_hz": base_frequency_hz,
            "order": order,
            "grid": grid,
            "amplitudes_rad": tuple(levels_rad),
            "realizations": realizations,
            "periods": periods,
            "transient_periods": transient_periods,
            "seed": seed + 1,
            **played,
        }
    )
    law = dict(controller or {})
    if "kind" not in law:
        law = pd_filtered.describe(pd_filtered.CONTROLLER.check(law))
    done = []
    for level in range(len(levels_rad)):
        for number in range(realizations):
            experiment = multisine.describe(excitation, level, number, law)
            run = run_realization(rig, experiment)
            shape = (-1, experiment.samples_per_period)
            done.append(
                RecordedRealization(
                    f"level_{level}_realization_{number:03d}",
                    experiment,
                    run.reference.reshape(shape),
                    run.torque.reshape(shape),
                    run.position.reshape(shape),
                    run.link.reshape(shape) if with_link else None,
                )
            )
    truth = Model.nominal(rig).with_effects(effects)
    return Case(RecordedExperiment(f"case {seed}", tuple(done)), rig, truth)


def vary(case: Case, factors: Sequence[Mapping[str, float]]) -> RecordedExperiment:
    """Record a case again, each bag with its own factors on the rig's parameters."""
    again = []
    for r, changed in zip(case.recorded.realizations, factors, strict=True):
        rig = dict(case.rig) | {name: f * case.rig[name] for name, f in changed.items()}
        run = run_realization(rig, r.experiment)
        shape = r.position.shape
        again.append(
            replace(r, position=run.position.reshape(shape), torque=run.torque.reshape(shape))
        )
    return RecordedExperiment(case.recorded.source, tuple(again))


def with_other_noise(case: Case, seed: int) -> RecordedExperiment:
    """Record a case again, with other encoder noise in the loop."""
    rig = {**case.rig, "noise_seed": seed}
    again = []
    for r in case.recorded.realizations:
        run = run_realization(rig, r.experiment)
        shape = r.position.shape
        again.append(
            replace(r, position=run.position.reshape(shape), torque=run.torque.reshape(shape))
        )
    return RecordedExperiment(case.recorded.source, tuple(again))


def write_bags(case: Case, folder: Path) -> Path:
    """Write the bags of a case, one for each realization; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for realization in case.recorded.realizations:
        with BagWriter(folder / realization.name, realization.experiment) as writer:
            writer.write_arrays(
                r=realization.reference.ravel(),
                y=realization.position.ravel(),
                u=realization.torque.ravel(),
            )
    return folder


def fitter_of(
    recorded: RecordedExperiment,
    nominal: Mapping[str, float] | None = None,
    tolerance: float = TOLERANCE,
) -> CellFitter:
    """Return what fits an experiment of steady periods, by default from the paper's values."""
    values = PLANT.defaults() if nominal is None else nominal
    bare = Model.nominal(values).plant
    return CellFitter(Evidence(steady_runs(recorded), values), bare, tolerance)


def found_in(
    recorded: RecordedExperiment,
    nominal: Mapping[str, float],
    *effects: str,
    tolerance: float = TOLERANCE,
) -> tuple[Diagnosis, Fitted]:
    """Diagnose an experiment by a few effects; return the outcome and what was fitted."""
    found = investigate(recorded, nominal, effects=effects or None, tolerance=tolerance)
    assert found.fitted is not None
    return found.diagnosis, found.fitted


def changes_of(recorded: RecordedExperiment, model: Model) -> tuple[BagChanges | None, Evidence]:
    """Return what changes from bag to bag beside a model that leaves noise alone."""
    evidence = Evidence(steady_runs(recorded), model.whole_plant)
    variance = evidence.floor(range(len(evidence.parts)))
    return run_changes(evidence, variance, model), evidence
