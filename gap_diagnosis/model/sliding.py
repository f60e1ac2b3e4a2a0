"""Where friction is at its level along a slow motion: not yet where it has just turned round.

Dry friction does not change sign at once. Bristles, or whatever is bent before it, yield first; the
torque of friction goes from one level to the other by 1 - exp(-way / z) (Dahl 1968), and a joint
that sticks creeps forth and back on them without sliding. What friction is there is said neither by
the way nor by its direction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_ROUNDED = 1e-6  # of a play: what rounding leaves of it where it is crossed
_SETTLED = 4.0  # times z: the way after which 2 % of the change is left
_LEFT_OUT = 1.5  # stations from a turn to the middle of the first that is kept
_FAR = 40  # stations to either side of a turn that are compared
_TURNS = 5  # at the least: what differs past a single one may be anything
_WAYS = np.geomspace(0.25, 16.0, 25)  # z, in stations
_UNEXPLAINED = 0.75  # of the squares: the most that is left once such a way is seen
_MISSING = 0.1  # of the change, at the first place: less is not waited for


def behind_play(places: np.ndarray, width: float) -> np.ndarray:
    """Return the places of what is moved through a play of a width to either side, rad.

    Args:
        places: of what moves it, float64 (samples,), rad.
        width: rad.
    """
    followed, at = np.empty(places.size), float(places[0])
    for k, place in enumerate(places.tolist()):
        at = min(max(at, place - width), place + width)
        followed[k] = at
    return followed


def sliding(moves: np.ndarray, way: float) -> np.ndarray:
    """Return the direction of travel at each sample, 0 within a way of where it turned round.

    Where a joint stops without going back, its friction is still the one of its travel.

    Args:
        moves: at each sample, float64 (samples,), rad.
        way: rad.
    """
    half = 0.5 * way
    places = np.cumsum(moves)
    ahead = places - behind_play(places, half)
    return np.where(np.abs(ahead) > (1.0 - _ROUNDED) * half, np.sign(ahead), 0.0)


def yields_over(runs: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> float:
    """Return over how long a way friction goes to its level, in stations; 0 where none is seen.

    By the torque with which a place is passed before a turn and after it: what depends on the angle
    takes the same both times, and the difference is the friction of both, as it is for their speeds
    and for the way since the turn.

    Args:
        runs: of each, the torque (N m), the speed (rad/s) and the direction (1 or -1) at each
            station, float64 (stations,), the first station after each turn left out.
    """
    way, before, change, speed = np.concatenate([_passed_twice(*run) for run in runs], axis=1)
    if np.sum(way == _LEFT_OUT) < _TURNS:
        return 0.0
    plain = np.stack([np.ones(way.size), speed], axis=1)
    least, found = _UNEXPLAINED * _squares_left(plain, change)[0], 0.0
    for z in _WAYS:
        missing = np.exp(-way / z) + np.exp(-before / z)
        left, (whole, _, opened) = _squares_left(np.column_stack([plain, -missing]), change)
        at_first = opened * np.exp(-way.min() / z)
        if left < least and at_first > _MISSING * whole > 0.0:
            least, found = left, float(_SETTLED * z)
    return found


def _squares_left(columns: np.ndarray, values: np.ndarray) -> tuple[float, np.ndarray]:
    solved = np.linalg.lstsq(columns, values, rcond=None)[0]
    return float(np.sum((values - columns @ solved) ** 2)), solved


def _passed_twice(torque: np.ndarray, speed: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return of each place passed before and after a turn four numbers, (4, places).

    The way since that turn (stations), the way since the turn before it when the place was passed
    first (likewise), what the torque has changed and what the speed has, in the new direction.
    """
    turns = np.flatnonzero(np.diff(direction) != 0.0) + 1
    ends = np.array([0, *turns, direction.size])
    rows = [np.empty((4, 0))]
    for begun, turn, end in zip(ends[:-2], ends[1:-1], ends[2:], strict=True):
        k = np.arange(max(min(turn - begun - 1, end - turn, _FAR), 0))
        new, old = turn + k, turn - 2 - k  # the station at the turn itself is passed but once
        before = old - begun + _LEFT_OUT if begun else np.full(k.size, np.inf)
        changes = [direction[turn] * (values[new] - values[old]) for values in (torque, speed)]
        rows.append(np.array([k + _LEFT_OUT, before, *changes]))
    return np.concatenate(rows, axis=1)
