"""Fits with one effect less: what is left when an effect is taken out of an explanation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fjr_sim_node import effects as fx

from ..model.rig_model import Model
from .fits import MORE_STEPS, Fit, Fitter
from .least_squares import Solution

_ANY_SCALE = 1.0  # as a tolerance: base parameters within a factor of 16, k1 of 64


def without(fitter: Fitter, fit: Fit, effect: str) -> Fit:
    """Return a fit with one of its effects off and all else as it was: not a minimum."""
    base = len(fit.space.nominal)
    names = [n for n in fit.space.effects if not n.startswith(f"{effect}.")]
    chosen = [base + fit.space.effects.index(name) for name in names]
    units = tuple(fit.space.units[index - base] for index in chosen)
    space = replace(fit.space, effects=tuple(names), units=units)
    columns = [*range(base), *chosen]
    x = fit.solution.x[columns]
    errors = fitter.errors([space.model(x)])[0]
    cost = float(errors @ errors)
    solution = Solution(x, cost, fit.solution.jacobian[:, columns], errors, False)
    rest = tuple(name for name in fit.effects if name != effect)
    return Fit(rest, space.model(x), space, solution, cost, float("inf"))


def without_scale(fitter: Fitter, fit: Fit, effect: str) -> Fit:
    """Return a fit without an effect that scales the parameters, which may go as far as it did.

    A gain of the torque is the same as all torques, stiffnesses, dampings and inertias divided
    by it; so that is where the fit starts, with no bound of the tolerance in its way.
    """
    rest = without(fitter, fit, effect)
    gain = 1.0 + fit.model.effects.get("torque_gain.relative_error", 0.0)
    gain /= 1.0 + rest.model.effects.get("torque_gain.relative_error", 0.0)
    scaled = Model(
        {name: value / gain for name, value in rest.model.plant.items()},
        {n: v / gain if _is_torque(n) else v for n, v in rest.model.effects.items()},
    )
    space = replace(rest.space, tolerance=_ANY_SCALE)
    start = np.clip(space.point(scaled), *space.bounds())
    return fitter.solve(rest.effects, space, start, most_steps=MORE_STEPS)


def _is_torque(name: str) -> bool:
    """Tell whether a parameter of an effect, by its full name, scales with the torque."""
    parameter = next(p for p in fx.PARAMETERS if p.name == name)
    return parameter.unit.startswith(("N m", "kg"))
