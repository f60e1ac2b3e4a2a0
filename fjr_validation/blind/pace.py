"""PACE's parameters, fitted by CMA-ES to the squared position error.

Bjelonic et al. 2025, "Towards bridging the gap: systematic sim-to-real transfer for diverse legged
robots" (arXiv 2509.06342), fit for each joint its armature, viscous damping, Coulomb friction and
bias, and one delay for all. Here the simulated rig of the diagnosis stands in for their simulator,
with transmission and link as the datasheet has them; so the fit has a simulation with exact
sticking and a flexible joint, which theirs has not. The joint's bias is a constant torque, which is
what a constant error of its target is under a stiff position loop. PACE names nothing: a delay, a
bias, or friction that the datasheet lacks is named if it matters on the validation parts.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gap_diagnosis.model.parts import Purpose
from gap_diagnosis.outcome.diagnosis import Diagnosis, Stage
from gap_diagnosis.outcome.gap_size import Gap

from .baseline_fit import MATTERS, Problem, verdict_of
from .cma_fit import Free, cma_fit, factor_of

_ARMATURE = 3.0  # factor by which it may be off
_MOST_DELAY_S = 0.1
_MOST_SAMPLES = 20.0  # of delay
_FRICTION = 0.5  # Coulomb friction and bias, of the rms torque, at the most or times three
_DRAG = 1.0  # viscous damping over rms torque per rms velocity, likewise
_NAMES = {"delay": "delay.time_s", "torque_bias": "torque_bias.torque_nm"}
_LACKING = {"coulomb_friction": "fsm", "viscous_friction": "fvm"}


def pace(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by PACE's parameter set."""
    problem = Problem(folder, nominal)
    datasheet = {**problem.nominal, **dict.fromkeys(_NAMES.values(), 0.0)}
    runs = problem.runs("fit")

    def cost(values: Mapping[str, float]) -> float:
        return _squared(problem, {**datasheet, **values}, runs, "fit")

    found, _ = cma_fit(cost, _free(problem), 0.9 * problem.seconds_left)
    values = {**datasheet, **found}
    gaps: dict[Stage, Gap] = {
        "nominal": problem.gap_of(datasheet),
        "refit": problem.gap_of(values),
    }
    names = _named(problem, datasheet, values)
    return verdict_of(problem, gaps, values, dict.fromkeys(names, 1.0))


def _free(problem: Problem) -> dict[str, Free]:
    """Return what is fitted and how far it may go."""
    nominal, scales = problem.nominal, problem.scales
    coulomb, drag = _FRICTION * scales.torque_nm, _DRAG * scales.torque_nm / scales.velocity_rad_s
    delay = min(_MOST_DELAY_S, _MOST_SAMPLES * scales.period_s)
    return {
        "jm": factor_of(nominal["jm"], _ARMATURE),
        "fvm": Free(nominal["fvm"], 0.0, max(drag, 3.0 * nominal["fvm"])),
        "fsm": Free(nominal["fsm"], 0.0, max(coulomb, 3.0 * nominal["fsm"])),
        _NAMES["torque_bias"]: Free(0.0, -coulomb, coulomb),
        _NAMES["delay"]: Free(0.0, 0.0, delay),
    }


def _squared(
    problem: Problem, values: Mapping[str, float], runs: list[int], purpose: Purpose
) -> float:
    error = problem.error(problem.play(values, runs), purpose)
    return float(np.mean(error**2))


def _named(
    problem: Problem, datasheet: Mapping[str, float], values: Mapping[str, float]
) -> list[str]:
    """Return the effects without which the validation parts are met worse."""
    lacking = {e: name for e, name in _LACKING.items() if not datasheet[name]}
    runs = problem.runs("select")
    best = _squared(problem, values, runs, "select")
    return [
        effect
        for effect, name in {**_NAMES, **lacking}.items()
        if values[name] != datasheet[name]
        and _squared(problem, {**values, name: datasheet[name]}, runs, "select")
        > (1.0 + MATTERS) ** 2 * best
    ]
