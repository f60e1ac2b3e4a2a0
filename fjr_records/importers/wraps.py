"""Angles that an encoder starts anew after each turn."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

_SMOOTH = 0.25 * np.pi  # rad: what an angle moves at the most from sample to sample once unwrapped
_ANGLES = ("position", "link", "reference")


def without_wraps(
    values: Mapping[str, np.ndarray],
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return the signals with angles that go on from turn to turn, and what was done to them.

    An angle wraps if it jumps by more than half a turn between samples, and moves smoothly once
    whole turns are added. The reference may jump as it likes, unless the position wraps.

    Args:
        values: {quantity: float64 (samples,)} in SI; the unit of a jump tells whether it is a turn.
    """
    found: dict[str, np.ndarray] = dict(values)
    notes: list[str] = []
    for quantity in _ANGLES:
        angle = values.get(quantity)
        if angle is None or not np.isfinite(angle).all():
            continue
        jumps = int((np.abs(np.diff(angle)) > np.pi).sum())
        whole = np.unwrap(angle)
        if not jumps or np.abs(np.diff(whole)).max() > _SMOOTH:
            continue
        if quantity == "reference" and not notes:
            continue
        found[quantity] = whole
        notes.append(f"{quantity} starts anew after each turn ({jumps} times): turns were added")
    return found, tuple(notes)
