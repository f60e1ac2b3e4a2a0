"""The parameters of the better simulation, as nodes and campaigns take them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from controller_node.pd_filtered import from_description
from excitation_node import multisine
from fjr_interface.experiment import Experiment
from fjr_records.periodic import RecordedExperiment
from fjr_records.records import RecordSet
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation.simulator import SIMULATOR

from ..outcome.diagnosis import Diagnosis

_LEAST_SAMPLES = 100  # of a period
_HIGHEST = 0.4
"""Highest frequency of a multisine over the sample rate."""


def updated_values(
    recorded: RecordedExperiment | RecordSet, diagnosis: Diagnosis
) -> dict[str, dict[str, Any]]:
    """Return the parameters of the better simulation by node.

    Simulator: refitted base parameters and all named effects, without encoder noise. Controller and
    sample rate: the recorded ones, or the highest rate that nodes take; no rate where the rig was
    recorded too slowly to be simulated.
    Excitation: of steady periods grid, levels and periods, so that a campaign plays the same kind
    of signal, with phases of its own; of records what a multisine needs at their rate.
    """
    rate = min(_rate(recorded), SIMULATOR["sample_rate_hz"].high)
    simulator = simulator_values({name: float(e.value) for name, e in diagnosis.parameters.items()})
    SIMULATOR.check(simulator, "updated.yaml")
    played = {"sample_rate_hz": rate} if diagnosis.compared == "motion" else {}
    values: dict[str, dict[str, Any]] = {"simulator": {**played, **simulator}}
    if isinstance(recorded, RecordedExperiment):
        values["excitation"] = {"sample_rate_hz": rate, **_excitation(recorded)}
    elif played:
        values["excitation"] = {"sample_rate_hz": rate, **_multisine_at(rate)}
    if has_known_law(recorded):
        values["controller"] = from_description(_controller(recorded) or {}, rate)
    return values


def simulator_values(found: Mapping[str, float]) -> dict[str, float]:
    """Return the simulator's parameters from those of a diagnosis.

    What the bare plant lacked is in its own parameters then. A rigid axis is one body, whose
    inertia and friction are the motor's; a held link has neither.
    """
    light = plant.PLANT["j"].low
    rigid = {"j": light, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0}
    held = {"j": math.inf, "fs": 0.0, "fv": 0.0}
    own = plant.with_added({**(rigid if "k0" not in found else held), **found})
    added = [e for e in effects.CATALOGUE if e.of_bare_plant]
    gone = {*plant.PLANT.names, *(name for effect in added for name in effect.names)}
    return {**own, **{name: value for name, value in found.items() if name not in gone}}


def has_known_law(recorded: RecordedExperiment | RecordSet) -> bool:
    """Tell whether the recorded controller is one that nodes and campaigns can run."""
    controller = _controller(recorded)
    return controller is not None and controller.get("kind") == "pd_filtered"


def _rate(recorded: RecordedExperiment | RecordSet) -> float:
    if isinstance(recorded, RecordSet):
        return recorded.sample_rate_hz
    return recorded.experiment.sample_rate_hz


def _controller(recorded: RecordedExperiment | RecordSet) -> dict | None:
    """Return the description of the controller that all runs had; None if they had several."""
    if isinstance(recorded, RecordedExperiment):
        return recorded.experiment.controller
    first = recorded.records[0].controller
    return first if all(r.controller == first for r in recorded.records) else None


def _excitation(recorded: RecordedExperiment) -> dict[str, Any]:
    """Return what the excitation node needs to play such an experiment."""
    description = recorded.experiment
    harmonics = description.excited_harmonics + description.detection_harmonics
    f0 = description.base_frequency_hz
    counts = [sum(r.level == level for r in recorded.realizations) for level in recorded.levels]
    return {
        "base_frequency_hz": f0,
        "f_min_hz": min(harmonics) * f0,
        "f_max_hz": max(harmonics) * f0,
        "grid": _grid(description),
        "amplitudes_rad": tuple(_amplitude(recorded, level) for level in recorded.levels),
        "realizations": max(counts),
        "periods": description.periods,
        "transient_periods": description.transient_periods,
    }


def _multisine_at(rate: float) -> dict[str, float]:
    """Return which parameters of a multisine must differ from their defaults at a sample rate."""
    usual = multisine.EXCITATION.defaults()
    samples = max(round(rate / usual["base_frequency_hz"]), _LEAST_SAMPLES)
    spacing = rate / samples
    fitting = {
        "base_frequency_hz": spacing,
        "f_min_hz": max(usual["f_min_hz"], spacing),
        "f_max_hz": min(usual["f_max_hz"], int(_HIGHEST * samples) * spacing),
    }
    return {name: value for name, value in fitting.items() if not math.isclose(value, usual[name])}


def _amplitude(recorded: RecordedExperiment, level: int) -> float:
    """Return the amplitude of a level as it was set; the rms over lines if lines differ."""
    amplitudes = next(
        r.experiment.amplitudes_rad for r in recorded.realizations if r.level == level
    )
    return float(amplitudes[0] if np.ptp(amplitudes) == 0.0 else np.sqrt(np.mean(amplitudes**2)))


def _grid(description: Experiment) -> str:
    if any(harmonic % 2 == 0 for harmonic in description.excited_harmonics):
        return "full"
    return "odd_random" if description.detection_harmonics else "odd"
