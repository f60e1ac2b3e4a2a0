"""Where a recorded run begins: position and velocity at its first sample, or at rest at zero."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fjr_records.record_noise import RecordNoise
from fjr_records.records import Record

_AT_REST = 5.0  # standard deviations of noise that a record at rest may begin away from zero
_FIRST_SAMPLES, _HIGHEST_DEGREE = 10, 4
_REST_POWERS = 2, 3, 4  # of time, by which a motion from rest begins
_ONLY_NOISE = 1.1  # standard deviations that a fit to the first samples leaves by chance


def start_of(record: Record, noise: RecordNoise) -> tuple[float, float]:
    """Return position (rad) and velocity (rad/s) at the first sample; zero where noise explains.

    The polynomial of lowest degree that leaves no more than noise tells a run that begins to move
    from rest, whose speed grows from zero, from one that moves already. What an encoder of coarse
    steps rounds away is no chance: there a motion that may begin from rest at zero does.
    """
    first = record.position[:_FIRST_SAMPLES]
    std = noise.std_rad if noise.known else 0.0
    if np.abs(first).max() <= _AT_REST * std:
        return 0.0, 0.0
    if np.ptp(first) <= 2.0 * _AT_REST * std:
        return float(first.mean()), 0.0
    time = np.arange(first.size) / record.description.sample_rate_hz
    if noise.rounds and abs(first[0]) < std and _may_begin_from_rest(first, std):
        return 0.0, 0.0
    for degree in range(1, _HIGHEST_DEGREE + 1):
        powers = np.vander(time / time[-1], degree + 1, increasing=True)
        found = np.linalg.lstsq(powers, first, rcond=None)[0]
        left = first - powers @ found
        scatter = float(np.sqrt(left @ left / (first.size - found.size)))
        if scatter <= _ONLY_NOISE * std:
            break
    error = max(scatter, std) * np.sqrt(np.diag(np.linalg.inv(powers.T @ powers)))
    if np.all(np.abs(found[:2]) <= _AT_REST * error[:2]):
        return 0.0, 0.0
    return float(found[0]), float(found[1] / time[-1])


def held_at(
    record: Record, start: tuple[float, float], nominal: Mapping[str, float]
) -> float | None:
    """Return where a link is held (rad), from which the encoder need not count.

    A run that begins at rest begins there; one that moves already does so about it, and so does a
    stretch of a run, which friction may hold elsewhere. None where no link is held.

    Args:
        record: the run.
        start: of it, from `start_of`.
        nominal: datasheet values by the names of PLANT.
    """
    if not math.isinf(nominal["j"]):
        return None
    if start[1] == 0.0 and not record.after_s:
        return start[0]
    return float(record.position.mean() - record.torque.mean() / nominal["k0"])


def _may_begin_from_rest(first: np.ndarray, std: float) -> bool:
    """Tell whether a motion from rest at zero leaves no more than noise of its first samples."""
    time = np.linspace(0.0, 1.0, first.size)
    powers = np.stack([time**power for power in _REST_POWERS], axis=1)
    left = first - powers @ np.linalg.lstsq(powers, first, rcond=None)[0]
    return float(np.sqrt(left @ left / (first.size - len(_REST_POWERS)))) <= _ONLY_NOISE * std
