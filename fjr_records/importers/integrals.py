"""Speeds in place of angles: a drive that logs its speed alone, or a tachometer."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .import_map import Column

DRIFTS = "its position is the integral of a speed, which drifts"
_SAME = {"position": "reference", "reference": "position", "link": "position"}
"""The angle from which the integral of a speed begins, where that is recorded as an angle."""


def integrals(
    values: Mapping[str, np.ndarray], columns: Mapping[str, Column], rate_hz: float
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return the signals with the integral in place of every speed, and what was done to them.

    Args:
        values: {quantity: float64 (samples,)} in SI, evenly sampled; a speed in rad/s or m/s.
        columns: where each quantity stood; the unit says what is a speed.
        rate_hz: sample rate.
    """
    found = dict(values)
    notes = []
    for quantity, speed in values.items():
        if not columns[quantity].is_speed:
            continue
        other = _SAME[quantity]
        begins = values[other][0] if other in values and not columns[other].is_speed else 0.0
        steps = 0.5 * (speed[1:] + speed[:-1]) / rate_hz
        found[quantity] = begins + np.concatenate([[0.0], np.cumsum(steps)])
        notes.append(
            f"{quantity} is the integral of {columns[quantity].name}, a speed: where it begins is "
            "not known, and an offset or noise of the speed lets it drift"
        )
    return found, tuple(notes)
