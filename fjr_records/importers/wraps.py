"""Angles that an encoder starts anew after each turn.

Such an angle stays within whole turns and jumps by them from edge to edge. Once they are added its
steps change smoothly from sample to sample, at the jumps as elsewhere, however large they are. That
tells it from an axis between two stops, runs that were joined, and an encoder that was reset.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from .import_map import Column, is_linear

_TURN = 2.0 * np.pi
_BEYOND = 0.05  # of a turn: the most that an angle reads beyond whole turns
_LARGEST = 0.95 * np.pi  # rad: the most that an angle moves from sample to sample, either way
_SMOOTH = 0.5 * np.pi  # rad: the most by which that changes to the next; for a turn more, thrice it
_AS_ELSEWHERE = 2.0  # times the greatest change elsewhere: the most of one at a jump...
_AS_BESIDE = 1.5  # ... or, at a few jumps, times the step beside it: samples may be lost there
_FEWEST = 3  # samples that have a change of steps
_SAME = 1e-9  # rad: what rounding changes
_FILLS = 0.9  # of a turn: the least range of an angle that seems to wrap
_NEAR = 0.05  # of a turn: how near its edges then are to 0 and a turn, or to half turns
_FOLLOWS = 0.5 * np.pi  # rad: the most that a wrapped reference is from its position


@dataclass(frozen=True)
class _Added:
    """An angle to which turns were added.

    Attributes:
        angle: float64 (samples,), rad.
        jumps: the steps at which it jumped.
        rough: the sample at which it is least smooth; None if it surely is smooth.
    """

    angle: np.ndarray
    jumps: np.ndarray
    rough: int | None


def without_wraps(
    path: Path, values: Mapping[str, np.ndarray], columns: Mapping[str, Column]
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return the signals with angles that go on from turn to turn, and what was done to them.

    The reference may jump as it likes, unless the position wraps. Then it takes the turn that is
    next to the position, where it follows that.

    Args:
        path: the file.
        values: {quantity: float64 (its samples,)} in SI.
        columns: where each quantity stands; a speed, and a linear axis, do not wrap.

    Raises:
        InputError: an angle seems to wrap, but turns cannot be added surely.
    """
    found: dict[str, np.ndarray] = dict(values)
    notes: list[str] = []
    angles = [q for q in ("position", "link", "reference") if q in values]
    for quantity in () if is_linear(columns) else angles:
        angle = values[quantity]
        if angle.size < _FEWEST or not np.isfinite(angle).all():
            continue
        if columns[quantity].is_speed or (quantity == "reference" and not notes):
            continue
        added = _next_to(angle, found["position"]) if quantity == "reference" else None
        added = added or _with_turns(angle)
        jumps = added.jumps.size > 0
        if not jumps and (added.rough is None or quantity == "reference"):
            continue
        if added.rough is None:
            found[quantity] = added.angle
            times = f"{added.jumps.size} times"
            notes.append(f"{quantity} starts anew after each turn ({times}): turns were added")
        elif _seems_to_wrap(angle):
            raise InputError(f"{path}: {_unsure(quantity, angle, added, columns[quantity])}.")
    return found, tuple(notes)


def _with_turns(angle: np.ndarray) -> _Added:
    """Add to an angle the turns within which it stays wherever it jumps by more than half."""
    turns = _TURN * max(math.ceil(np.ptp(angle) / _TURN - _BEYOND), 1)
    raw = np.diff(angle)
    whole = np.rint(raw / turns)
    steps, jumps = raw - turns * whole, whole != 0.0
    before, after = slice(None, -1), slice(1, None)
    changes = np.abs(np.diff(steps))
    most = np.full(changes.size, _SMOOTH)
    beside = jumps[before] | jumps[after]
    if 0 < 2 * beside.sum() <= beside.size:  # rare jumps change the steps no more than others do
        usual = _AS_ELSEWHERE * float(changes[~beside].max(initial=0.0)) + _SAME
        alike = np.full(changes.size, usual)
        if np.median(changes[beside]) <= usual:  # and at a few of them samples may be lost
            own = np.where(jumps, 0.0, np.abs(steps))
            alike = np.maximum(usual, _AS_BESIDE * np.maximum(own[before], own[after]))
        most = np.where(beside, np.minimum(most, alike), most)
    large = np.maximum(np.abs(steps[before]), np.abs(steps[after])) / _LARGEST
    over = np.maximum(changes / most, large)
    rough = int(over.argmax()) + 1 if over.max() > 1.0 else None
    return _Added(angle - turns * np.append(0.0, np.cumsum(whole)), np.flatnonzero(jumps), rough)


def _next_to(reference: np.ndarray, position: np.ndarray) -> _Added | None:
    """Give a wrapped reference the turns next to a position without; None if it does not follow."""
    if reference.size != position.size or np.ptp(reference) > (1.0 + _BEYOND) * _TURN:
        return None
    whole = np.rint((position - reference) / _TURN)
    near = reference + _TURN * whole
    if np.abs(near - position).max() > _FOLLOWS:
        return None
    return _Added(near, np.flatnonzero(np.diff(whole)), None)


def _seems_to_wrap(angle: np.ndarray) -> bool:
    """Tell whether an angle fills one turn from one usual edge to the other."""
    low, high = float(angle.min()) / _TURN, float(angle.max()) / _TURN
    usual = [max(abs(low - edge), abs(high - edge - 1.0)) for edge in (0.0, -0.5)]
    return high - low >= _FILLS and min(usual) <= _NEAR


def _unsure(quantity: str, angle: np.ndarray, added: _Added, column: Column) -> str:
    """Return the clause that says where an angle seems to wrap, and why it is not surely so."""
    unit = "" if column.by_factor else f" {column.unit or 'rad'}"
    turn = _TURN / abs(column.factor)
    half = angle.min() < -0.25 * _TURN
    edges = f"±{0.5 * turn:.4g}{unit}" if half else f"0 and {turn:.4g}{unit}"
    return (
        f"{quantity} seems to wrap at {edges}, but turns cannot be added surely: even with them "
        f"its steps change too much near sample {added.rough}, as where it is too fast for its "
        "rate, or was filtered or resampled across a jump; log the angle on from turn to turn, or "
        "at a higher rate, and of runs that were joined make a file each"
    )
