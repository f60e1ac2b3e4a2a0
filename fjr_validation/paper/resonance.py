"""Resonances of one measured level."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from fjr_kit.tasks import Arrays
from fjr_sim_node.plant import PLANT
from fjr_sim_node.theory.linear import g0

from .two_inertia import NAMES, Resonances, fit_resonances

_RATE_HZ = 1000.0  # of the experiments whose levels are fitted


def two_inertia_frf(
    parameters: dict[str, float], frequency_hz: np.ndarray, rate_hz: float
) -> np.ndarray:
    """Return the zero-order-hold FRF of a linear joint."""
    return g0({**parameters, "fs": 0.0, "fsm": 0.0}, frequency_hz, rate_hz)


def fit_level(level: Arrays) -> Resonances:
    """Fit the two-inertia model to the BLA of a level."""
    paper: dict[str, Any] = dict(PLANT.defaults())
    start = {name: paper[name] for name in NAMES}
    frf = partial(two_inertia_frf, rate_hz=_RATE_HZ)
    variance = np.maximum(level["var_total"], 0.0)
    return fit_resonances(level["frequency_hz"], level["g"], variance, frf, start)
