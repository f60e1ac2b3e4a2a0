"""How well an experiment would know the bare parameters: their Fisher information."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fjr_kit.errors import InputError
from fjr_kit.showing import BareRefit
from fjr_sim_node.plant import PLANT

from ..model.rig_model import Model
from .foreseen import ForeseenParameter, Known
from .sight import Sight

_STEP = 1e-3
_TIED = 0.3  # of the greatest share that a parameter has in the combination that is known worst
_NOTHING = 1e-9  # of the greatest information: less is rounding
_DIVERGED = 1e5
_FAR = 0.03  # relative change of a parameter from which slopes are taken anew
_RENEWED = 3  # times at the most


def bare_refit(sight: Sight, nominal: Model) -> BareRefit:
    """Return what the bare parameters can take over, with their slopes at the nominal ones.

    Raises:
        InputError: the nominal simulation diverges.
    """
    names = [name for name, value in nominal.plant.items() if value]
    models = [
        Model({**nominal.plant, name: nominal.plant[name] * (1.0 + step)}, {})
        for name in names
        for step in (_STEP, -_STEP)
    ]
    runs = sight.errors([nominal, *models])
    if np.abs(runs).max() > _DIVERGED:
        raise InputError(
            "The nominal simulation diverges in this experiment; check its values and units."
        )
    return BareRefit(nominal.plant, names, ((runs[1::2] - runs[2::2]) / (2.0 * _STEP)).T)


def left_by_refit(sight: Sight, refit: BareRefit, target: np.ndarray) -> np.ndarray:
    """Return what a refit leaves of the way from its bare plant to a target, (errors,).

    Its slopes are taken anew where it ends too far away for them to hold.

    Args:
        sight: of the experiment.
        refit: of the nominal plant.
        target: errors of a rig, (errors,).
    """
    ends: list[tuple[float, dict[str, float]]] = []

    def change_from(plant: Mapping[str, float]) -> np.ndarray:
        change = target - sight.errors([Model(plant, {})])[0]
        ends.append((_size(change), dict(plant)))
        return change

    left = refit.left_by_refit(change_from, _size)
    for _ in range(_RENEWED):
        end = min(ends, key=lambda end: end[0])[1]
        if all(abs(end[name] - value) <= _FAR * abs(value) for name, value in refit.plant.items()):
            break
        refit = bare_refit(sight, Model(end, {}))
        left = min(left, refit.left_by_refit(change_from, _size), key=_size)
    return left


def _size(change: np.ndarray) -> float:
    return float(np.linalg.norm(change))


def parameters(sight: Sight, refit: BareRefit, tolerance: float) -> list[ForeseenParameter]:
    """Return how well each bare parameter would be known; those at zero are not fitted.

    Args:
        sight: of the experiment.
        refit: from `bare_refit`.
        tolerance: relative standard error below which a parameter counts as identifiable.
    """
    weighed = refit.slopes * np.sqrt(sight.fit_weights(len(refit.slopes)))[:, None]
    information = weighed.T @ weighed
    own = np.diag(information)
    shown = own > _NOTHING * own.max()
    covariance = np.zeros_like(information)
    covariance[np.ix_(shown, shown)] = np.linalg.pinv(
        information[np.ix_(shown, shown)], rcond=1e-14, hermitian=True
    )
    found = []
    for i, name in enumerate(refit.names):
        error = math.sqrt(covariance[i, i]) if shown[i] else math.inf
        alone = 1.0 / math.sqrt(own[i]) if shown[i] else math.inf
        known: Known = (
            "alone" if error < tolerance else "in combination" if alone < tolerance else "no"
        )
        found.append(
            ForeseenParameter(
                name=name,
                unit=PLANT[name].unit,
                nominal=refit.plant[name],
                error_percent=100.0 * error,
                others_known_percent=100.0 * alone,
                identifiable=known,
                tied_to=_tied(covariance, i, refit.names) if known == "in combination" else [],
            )
        )
    return found


def _tied(covariance: np.ndarray, index: int, names: Sequence[str]) -> list[str]:
    """Return which parameters trade with one.

    These are the large entries of that eigenvector of the covariance which adds most to the
    variance of the parameter.
    """
    values, vectors = np.linalg.eigh(covariance)
    worst = vectors[:, int(np.argmax(values * vectors[index] ** 2))]
    shares = np.abs(worst) / np.abs(worst).max()
    order = np.argsort(-shares)
    return [names[i] for i in order if i != index and shares[i] >= _TIED]
