"""Distance of a BLA from a reference model (paper eq. 14)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..results.result import BlaEstimate, Comparison

LOW_LINES_HZ = 1.0
"""Few lines below this frequency dominate V, so V is also given without them."""


@dataclass(frozen=True)
class ReferenceModel:
    """A model to compare the BLA with.

    Attributes:
        name: such as G0_viscous.
        description: what it is, one line.
        frf: (frequencies in Hz of shape (F,), sample rate in Hz) -> complex (F,) in rad/(N m).
    """

    name: str
    description: str
    frf: Callable[[np.ndarray, float], np.ndarray]


def squared_error_db(g: np.ndarray, g0: np.ndarray) -> np.ndarray:
    """Return (20 log10|G0| - 20 log10|G|)^2 in dB^2, of the shape of g."""
    return (20.0 * np.log10(np.abs(g0) / np.abs(g))) ** 2


def compare(bla: BlaEstimate, model: ReferenceModel, sample_rate_hz: float) -> Comparison:
    """Return V of eq. 14 and its variants, all in dB^2."""
    g0 = np.asarray(model.frf(bla.frequency_hz, sample_rate_hz), complex)
    error = squared_error_db(bla.g, g0)
    above = error[bla.frequency_hz >= LOW_LINES_HZ * (1.0 - 1e-9)]
    return Comparison(
        name=model.name,
        description=model.description,
        g0=g0,
        v_mean=float(error.mean()),
        v_median=float(np.median(error)),
        v_mean_above_1hz=float(above.mean()) if above.size else float("nan"),
        v_median_above_1hz=float(np.median(above)) if above.size else float("nan"),
    )
