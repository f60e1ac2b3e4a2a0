"""What friction that scatters from run to run adds to the errors of a run that no fit has seen.

A fit knows the friction of the runs that it saw. That of the next run is one to five percent off,
and what this moves says nothing of a cause: it may hide an offset that closes nine tenths of the
slow error, or lend a gain to what it resembles. So the errors of a run that was not fitted are
compared beside what its own friction explains: a deviation of the Coulomb and one of the viscous
friction, each with its scatter as prior (random effects: Laird, Ware 1982, Biometrics 38(4)).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_sim_node import effects as fx

from ..model.rig_model import Model

SCATTER = 0.03
"""Standard deviation of friction from run to run where the runs cannot show it, relative: that of
drives is one to five percent."""
_STEP = 0.01  # relative, of a one-sided difference
_MOST = 3.0  # standard deviations
_TOGETHER: tuple[tuple[str, ...], ...] = (("fs", "fsm"), ("fv", "fvm"))


def deviated(model: Model) -> list[Model]:
    """Return a model with its Coulomb friction a little greater, and with its viscous friction.

    What the bare plant lacks and an effect adds deviates with the parameter that it adds to. A
    friction that the model has not at all is left out.
    """
    found = []
    for names in _TOGETHER:
        plant = {n: model.plant[n] * (1.0 + _STEP) for n in names if model.plant.get(n)}
        added = {
            n: value * (1.0 + _STEP)
            for n, value in model.effects.items()
            if value and fx.parameter(n).adds_to in names
        }
        if plant or added:
            found.append(Model({**model.plant, **plant}, {**model.effects, **added}))
    return found


def beside_scatter(
    errors: np.ndarray, weight: np.ndarray, runs: Sequence[np.ndarray]
) -> np.ndarray:
    """Return the errors of a model without what the friction of each run explains.

    Args:
        errors: (1 + deviations, errors), of the model and of its `deviated` ones.
        weight: (errors,), over standard deviations.
        runs: bool (errors,) each, the errors of one run that was not fitted.

    Returns:
        (errors,).
    """
    left, slopes = errors[0].copy(), (errors[1:] - errors[0]) / _STEP
    if not len(slopes) or not np.isfinite(errors).all():
        return left
    for rows in runs:
        moved = slopes[:, rows] * weight[rows]
        normal = moved @ moved.T + np.eye(len(slopes)) / SCATTER**2
        deviation = np.linalg.solve(normal, -moved @ (left[rows] * weight[rows]))
        left[rows] += np.clip(deviation, -_MOST * SCATTER, _MOST * SCATTER) @ slopes[:, rows]
    return left
