"""The residual torque over velocity, position and deflection, as binned curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .residual_torque import ResidualTorque

Coordinate = Literal["velocity", "position", "deflection"]
COORDINATES: tuple[Coordinate, ...] = ("velocity", "position", "deflection")

_MEDIAN_EFFICIENCY = 1.2533  # std of a median over that of a mean, Gaussian
_MAD_TO_STD = 1.4826


@dataclass(frozen=True)
class Curve:
    """Residual torque over one coordinate; arrays (bins,).

    Attributes:
        coordinate: velocity (rad/s), position or deflection (rad).
        direction: +1 or -1, sign of the motor's velocity; 0 for both.
        level: the level; None for all.
        center: median of the coordinate in the bin.
        torque: median of tau_res, N m.
        std: standard error of that, N m.
        count: samples in the bin.
    """

    coordinate: Coordinate
    direction: int
    level: int | None
    center: np.ndarray
    torque: np.ndarray
    std: np.ndarray
    count: np.ndarray


def curve(
    residual: ResidualTorque,
    coordinate: Coordinate,
    direction: int = 0,
    level: int | None = None,
    bins: int = 40,
) -> Curve:
    """Return tau_res over a coordinate, in bins of equally many samples.

    Medians, as reversals leave outliers. The standard error counts samples as independent at twice
    the band's limit.
    """
    chosen = _chosen(residual, direction, level)
    where = getattr(residual, coordinate)[chosen]
    torque = residual.torque[chosen]
    band = np.broadcast_to(residual.band_hz[:, None], chosen.shape)[chosen]
    independent = np.minimum(2.0 * band / residual.sample_rate_hz, 1.0)
    parts = np.array_split(np.argsort(where, kind="stable"), bins)
    parts = [part for part in parts if part.size]
    return Curve(
        coordinate,
        direction,
        level,
        np.array([np.median(where[part]) for part in parts]),
        np.array([np.median(torque[part]) for part in parts]),
        np.array([_standard_error(torque[part], independent[part].sum()) for part in parts]),
        np.array([part.size for part in parts]),
    )


def _chosen(residual: ResidualTorque, direction: int, level: int | None) -> np.ndarray:
    chosen = residual.moving.copy()
    if direction:
        chosen &= np.sign(residual.velocity) == direction
    if level is not None:
        chosen &= residual.level[:, None] == level
    return chosen


def _standard_error(values: np.ndarray, independent: float) -> float:
    spread = _MAD_TO_STD * np.median(np.abs(values - np.median(values)))
    return float(_MEDIAN_EFFICIENCY * spread / np.sqrt(max(independent, 1.0)))
