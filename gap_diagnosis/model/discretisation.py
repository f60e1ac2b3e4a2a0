"""The simulation's own error: the same loop again with finer integration steps."""

from __future__ import annotations

import numpy as np

from controller_node.law import as_transfer_function, law_of
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedExperiment
from fjr_sim_node.simulation.closed_loop import simulate_law

from .rig_model import Model

SUBSTEPS = 8
"""By how much the finer simulation divides each sample period, at least."""


def discretisation_error(recorded: RecordedExperiment, model: Model) -> np.ndarray:
    """Return rms of the change of y by finer steps over rms of y, one realization a level.

    The torque is held as before; only the plant is integrated in smaller steps. The last of two
    periods from rest is compared. NaN where the motion diverges.

    Returns:
        float64 (levels,).
    """
    first = {r.level: r for r in reversed(recorded.realizations)}
    return np.array([_error(first[level], model) for level in recorded.levels])


def _error(realization, model: Model) -> float:
    description = realization.experiment
    rate = description.sample_rate_hz
    law = as_transfer_function(law_of(description.controller, rate))
    reference = np.tile(realization.reference[-1], 2)
    rig = model.plant_coefficients, law, None, model.effect_coefficients
    try:
        runs = [
            simulate_law(reference, rate, *rig, substeps=substeps).position[reference.size // 2 :]
            for substeps in (1, SUBSTEPS)
        ]
    except InputError:
        return float("nan")
    return float(np.sqrt(np.mean((runs[0] - runs[1]) ** 2) / np.mean(runs[1] ** 2)))
