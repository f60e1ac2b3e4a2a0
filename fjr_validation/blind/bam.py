"""BAM's ladder of friction models, fitted by CMA-ES to the mean absolute position error.

The models of `bam_plant`, M1 Coulomb and viscous friction; M2 a Stribeck term beside; M3 instead a
term of the load; M4 both; M5 the load's term other for motor and load; M6 a quadratic load term
beside. Each is fitted to the fitted runs; of the models whose error on the validation runs is
within 10 % of the least, the first of the ladder is chosen. BAM does not name causes: a term of the
chosen model that matters there is taken as the catalogue's entry for it, and Coulomb or viscous
friction as found where the datasheet has none. The quadratic term of M6 is one of the load that
depends on the direction, as `directional_loss` is, and has no entry of its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gap_diagnosis.model.parts import Purpose
from gap_diagnosis.outcome.diagnosis import Diagnosis

from .bam_plant import play
from .baseline_fit import MATTERS, Positions, Problem, verdict_of
from .cma_fit import Free, cma_fit, factor_of

_STRIBECK = ("stribeck", "stribeck_speed", "alpha")
_DIRECTIONAL = ("load_motor", "load_external", "load_motor_stribeck", "load_external_stribeck")
LADDER: Mapping[str, tuple[str, ...]] = {
    "M1": (),
    "M2": _STRIBECK,
    "M3": ("load",),
    "M4": (*_STRIBECK, "load", "load_stribeck"),
    "M5": (*_STRIBECK, *_DIRECTIONAL),
    "M6": (*_STRIBECK, *_DIRECTIONAL, "quadratic_motor", "quadratic_external"),
}
"""What each model has beyond Coulomb and viscous friction."""
NAMES: Mapping[str, tuple[str, ...]] = {
    "stribeck_friction_motor": ("stribeck",),
    "load_friction": ("load", "load_stribeck"),
    "directional_loss": (*_DIRECTIONAL, "quadratic_motor", "quadratic_external"),
}
"""The catalogue's entries, and the terms that stand for them."""

_ARMATURE = 3.0  # factor by which it may be off
_FRICTION = 0.5  # of the rms torque, at the most
_LOAD, _LOAD_STRIBECK = 0.5, 1.0  # at the most
_SPEEDS = (0.005, 0.2, 2.0)  # of Stribeck: least, first, greatest, over the rms speed
_LACKED = 0.005  # of the rms torque: friction of less is none


def bam(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by BAM's ladder."""
    problem = Problem(folder, nominal)
    ladder = _Ladder(problem)
    found: dict[str, dict[str, float]] = {}
    for step, name in enumerate(LADDER):
        known = {k: v for earlier in found.values() for k, v in earlier.items()}
        found[name] = ladder.fit(name, known, 0.95 * problem.seconds_left / (len(LADDER) - step))
    found = {name: ladder.best_of(values, found) for name, values in found.items()}
    errors = {name: ladder.cost(values, "select") for name, values in found.items()}
    chosen = next(name for name in LADDER if errors[name] <= (1.0 + MATTERS) * min(errors.values()))
    values = found[chosen]
    names = [*ladder.lacking(values), *ladder.mattering(values)]
    return verdict_of(
        problem,
        {
            "nominal": problem.gap(ladder.play(ladder.datasheet, problem.reported)),
            "refit": problem.gap(ladder.play(values, problem.reported)),
        },
        values,
        dict.fromkeys(names, 1.0),
        notes=[f"Chosen: {chosen}; {_told(errors)}"],
    )


def _told(errors: Mapping[str, float]) -> str:
    each = ", ".join(f"{name} {error:.3g}" for name, error in errors.items())
    return f"mean absolute errors on the validation runs (rad): {each}."


class _Ladder:
    """Fits of the ladder's models to one problem."""

    def __init__(self, problem: Problem) -> None:
        self._problem, nominal, scales = problem, problem.nominal, problem.scales
        most = _FRICTION * scales.torque_nm
        drag = most / scales.velocity_rad_s
        low, first, high = (share * scales.velocity_rad_s for share in _SPEEDS)
        quadratic = _LOAD / scales.torque_nm
        self.datasheet = {
            "jm": nominal["jm"], "base": nominal["fsm"], "viscous": nominal["fvm"],
        }  # fmt: skip
        self._free = {
            "jm": factor_of(nominal["jm"], _ARMATURE),
            "base": Free(nominal["fsm"], 0.0, max(most, 3.0 * nominal["fsm"])),
            "viscous": Free(nominal["fvm"], 0.0, max(drag, 3.0 * nominal["fvm"])),
            "stribeck": Free(0.05 * most, 0.0, most),
            "stribeck_speed": Free(first, low, high),
            "alpha": Free(1.35, 1.0, 10.0),
            "load": Free(0.02, 0.0, _LOAD),
            "load_stribeck": Free(0.02, 0.0, _LOAD_STRIBECK),
            "load_motor": Free(0.02, 0.0, _LOAD),
            "load_external": Free(0.02, 0.0, _LOAD),
            "load_motor_stribeck": Free(0.02, 0.0, _LOAD_STRIBECK),
            "load_external_stribeck": Free(0.02, 0.0, _LOAD_STRIBECK),
            "quadratic_motor": Free(0.0, 0.0, quadratic),
            "quadratic_external": Free(0.0, 0.0, quadratic),
        }

    def fit(self, name: str, known: Mapping[str, float], seconds: float) -> dict[str, float]:
        """Return the values of a model, fitted from what simpler ones have found."""
        free = {part: self._free[part] for part in ("jm", "base", "viscous", *LADDER[name])}
        for part, one in free.items():
            free[part] = Free(known.get(part, one.start), one.low, one.high)
        return cma_fit(lambda values: self.cost(values, "fit"), free, seconds)[0]

    def best_of(
        self, values: dict[str, float], found: Mapping[str, Mapping[str, float]]
    ) -> dict[str, float]:
        """Return a model's values, or what it shares with another model where that fits better.

        So no model is behind another for want of time alone.
        """
        shared = [{part: other.get(part, values[part]) for part in values} for other in
                  found.values()]  # fmt: skip
        return min([values, *shared], key=lambda own: self.cost(own, "fit"))

    def cost(self, values: Mapping[str, float], purpose: Purpose) -> float:
        """Return the mean absolute position error (rad)."""
        error = self._problem.error(self.play(values, self._problem.runs(purpose)), purpose)
        return float(np.mean(np.abs(error))) if np.isfinite(error).all() else math.inf

    def play(self, values: Mapping[str, float], which: list[int]) -> Positions:
        """Return the positions of some runs."""
        friction = dict(values)
        for one, both in (("load", ""), ("load_stribeck", "_stribeck")):
            if one in values:
                equal = friction.pop(one)
                friction |= {f"load_motor{both}": equal, f"load_external{both}": equal}
        plant = {**self._problem.nominal, "jm": friction.pop("jm")}
        simulator, rate = self._problem.evidence.player, self._problem.sample_rate_hz
        return {i: play(simulator.drive(i), rate, plant, friction) for i in which}

    def mattering(self, values: Mapping[str, float]) -> list[str]:
        """Return the effects whose terms the validation runs call for."""
        most = (1.0 + MATTERS) * self.cost(values, "select")
        named = []
        for effect, terms in NAMES.items():
            own = dict.fromkeys([term for term in terms if term in values], 0.0)
            if own and self.cost({**values, **own}, "select") > most:
                named.append(effect)
        return named

    def lacking(self, values: Mapping[str, float]) -> list[str]:
        """Return the friction that was found where the datasheet has none."""
        scales, nominal = self._problem.scales, self._problem.nominal
        torque = {
            "coulomb_friction": ("fsm", values["base"]),
            "viscous_friction": ("fvm", values["viscous"] * scales.velocity_rad_s),
        }
        return [
            effect
            for effect, (name, felt) in torque.items()
            if not nominal[name] and felt > _LACKED * scales.torque_nm
        ]
