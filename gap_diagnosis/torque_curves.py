"""What the residual torque depends on: curves over velocity, position and deflection, and where.

A torque that acts at the motor, at the link or in the transmission appears in the motor's balance
through the linear link between. Undone, it is a function of the state of its own place alone, if it
has no memory; at other places it is not, and rings at the antiresonance. So the share that curves
explain, on realizations they were not made from, tells the places apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .residual_torque import ResidualTorque, taper

Where = Literal["motor", "link", "transmission"]
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
    where = np.broadcast_to(_coordinate(residual, coordinate), chosen.shape)[chosen]
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


def _coordinate(residual: ResidualTorque, coordinate: Coordinate) -> np.ndarray:
    return getattr(residual, coordinate)


def _standard_error(values: np.ndarray, independent: float) -> float:
    spread = _MAD_TO_STD * np.median(np.abs(values - np.median(values)))
    return float(_MEDIAN_EFFICIENCY * spread / np.sqrt(max(independent, 1.0)))


@dataclass(frozen=True)
class Memoryless:
    """How much of the residual torque is a function of the present state of one place.

    Attributes:
        where: motor, link or transmission: the place at which the torque is taken to act.
        coordinate: velocity, position (both of that place) or deflection.
        share: of the variance of the torque of held-out realizations, what the curve of the others
            explains: 1 a function of this coordinate and direction, 0 or less not.
    """

    where: Where
    coordinate: Coordinate
    share: float


def memoryless(residual: ResidualTorque, bins: int = 60) -> list[Memoryless]:
    """Return the shares for all places and their coordinates, the greatest first.

    With a second encoder a torque on the link is not in the motor's balance: it is left out.
    """
    found = []
    places: tuple[Where, ...] = ("motor", "link", "transmission")
    if residual.link_measured:
        places = ("motor", "transmission")
    for where in places:
        torque = torque_at(residual, where)
        torque = torque - torque[residual.moving].mean()
        for coordinate, values, direction in _coordinates_of(residual, where):
            share = _held_out_share(residual, torque, values, direction, bins)
            found.append(Memoryless(where, coordinate, share))
    return sorted(found, key=lambda item: -item.share)


def torque_at(residual: ResidualTorque, where: Where) -> np.ndarray:
    """Return the torque (n, N) at a place that gives tau_res at the motor, by the linear link.

    At the link, tau_res = k w/(J s^2 + fv s + k); in the transmission
    tau_res = w (J s^2 + fv s)/(J s^2 + fv s + k). Where next to nothing of w is seen, noise would
    take over: for those places the band ends at three antiresonances, and in the transmission it
    begins at a tenth of one, as the link follows below. With a second encoder the motor's balance
    shows the transmission as it is.
    """
    if where == "motor" or (where == "transmission" and residual.link_measured):
        return residual.torque
    inertia, damping, stiffness = residual.link
    samples = residual.torque.shape[1]
    s = 2j * np.pi * np.fft.rfftfreq(samples, 1.0 / residual.sample_rate_hz)
    free = inertia * s**2 + damping * s
    ratio = np.abs(s) / (2.0 * np.pi * residual.antiresonance_hz)
    window = taper(ratio, 3.0)
    lines = np.fft.rfft(residual.torque)
    if where == "link":
        return np.fft.irfft(lines * window * (free + stiffness) / stiffness, samples)
    inverse = np.where(ratio > 0.1, (free + stiffness) / np.where(ratio > 0.1, free, 1.0), 0.0)
    return np.fft.irfft(lines * window * inverse, samples)


def _coordinates_of(residual: ResidualTorque, where: Where):
    """Return (name, values, direction) of the coordinates of a place."""
    if where == "motor":
        direction = np.sign(residual.velocity)
        return [
            ("velocity", residual.velocity, direction),
            ("position", residual.position, direction),
        ]
    if where == "link":
        direction = np.sign(residual.link_velocity)
        return [
            ("velocity", residual.link_velocity, direction),
            ("position", residual.link_position, direction),
        ]
    rate = residual.link_velocity - residual.velocity
    return [("deflection", residual.deflection, np.sign(rate)), ("velocity", rate, np.sign(rate))]


def _held_out_share(
    residual: ResidualTorque,
    torque: np.ndarray,
    values: np.ndarray,
    direction: np.ndarray,
    bins: int,
) -> float:
    """Return the share of held-out variance that binned means explain, two folds."""
    fold = _folds(residual)
    error = total = 0.0
    for held_out in (0, 1):
        fit = residual.moving & (fold != held_out)
        test = residual.moving & (fold == held_out)
        for sign in (-1, 1):
            a, b = fit & (direction == sign), test & (direction == sign)
            edges = np.quantile(values[a], np.linspace(0.0, 1.0, bins + 1)[1:-1])
            where = np.searchsorted(edges, values[a])
            count = np.maximum(np.bincount(where, minlength=bins), 1)
            means = np.bincount(where, torque[a], bins) / count
            guess = means[np.searchsorted(edges, values[b])]
            error += float(np.sum((torque[b] - guess) ** 2))
            total += float(np.sum(torque[b] ** 2))
    return 1.0 - error / total if total else 0.0


def _folds(residual: ResidualTorque) -> np.ndarray:
    """Return 0 or 1 for every sample: realizations of a level in turn, halves of a single one."""
    n, samples = residual.torque.shape
    out = np.zeros((n, samples), int)
    for level in np.unique(residual.level):
        members = np.flatnonzero(residual.level == level)
        if members.size > 1:
            out[members[1::2]] = 1
        else:
            out[members, samples // 2 :] = 1
    return out


def ringing(residual: ResidualTorque, width: float = 0.2) -> float:
    """Return the mean power density of tau_res about the antiresonance over that in its band.

    About 1 for a torque that acts at the motor, far above for one behind the spring.

    Args:
        residual: from `residual_torque`.
        width: half width about the antiresonance, relative.
    """
    samples = residual.torque.shape[1]
    frequency = np.fft.rfftfreq(samples, 1.0 / residual.sample_rate_hz)
    power = np.abs(np.fft.rfft(residual.torque)) ** 2
    centre = residual.antiresonance_hz
    near = np.abs(frequency - centre) < width * centre
    band = (frequency > 0) & (frequency < min(4.0 * centre, float(residual.band_hz.min())))
    return float(power[:, near].mean() / power[:, band].mean())
