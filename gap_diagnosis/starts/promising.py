"""Which of very many numbers of ripples are worth a calculation of their own.

A ripple gains the square of what pulls at it by what it moves. The pull costs little for each
number. What it moves goes evenly from number to number, but for those that beat with the motion.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Container, Sequence

import numpy as np

from .over_angle import peaks

ALL = 120
"""Numbers of which each is calculated."""
_SPREAD = 60  # of more than that, calculated wherever they lie
_ROUNDS = 3  # in which those are added that promise most:
_NEXT = 10  # on all lines, and as many on those from one of the bands upwards
_HIDDEN = 20.0  # gain (twice the nats) that slow lines hide
_MOST_HIDDEN = 2  # numbers that gain so


def promising(
    tried: np.ndarray, pulls: np.ndarray, squares: Callable[[float], np.ndarray]
) -> np.ndarray:
    """Return the numbers that promise most, ascending, `ALL` of them at the most.

    What they move is calculated for some, and taken between them for all; then it is calculated for
    those that promise most by it, which corrects it there, and so on.

    Args:
        tried: (numbers,), ascending in even steps.
        pulls: (bands, harmonics, numbers), the squares of what pulls at each harmonic of a number
            on the lines from each band upwards.
        squares: returns what a ripple of size 1 moves on these lines, (bands,).
    """
    new = (np.unique(np.geomspace(1, len(tried), _SPREAD).astype(int)) - 1).tolist()
    numbers = np.log([h * tried for h in range(1, pulls.shape[1] + 1)])
    known: dict[int, np.ndarray] = {}
    for _ in range(_ROUNDS):
        known.update({i: np.log(squares(float(tried[i]))) for i in new})
        at = sorted(known)
        moved = np.array([known[i] for i in at]).T
        falls = [np.exp(-np.interp(numbers, numbers[0, at], row)) for row in moved]
        new = _next((pulls * falls).sum(axis=1), known)
    return np.asarray(tried[sorted({*known, *new})])


def leading(falls: np.ndarray, most: int) -> list[tuple[int, int]]:
    """Return which numbers gain most, and from which band upwards lines are then counted.

    On all lines first; then those that gain far more where some slow lines don't count.

    Args:
        falls: (numbers, bands), what each gains on the lines from each band upwards.
        most: numbers on all lines.
    """
    on_all = [(int(i), 0) for i in peaks(falls[:, 0])[:most]]
    greatest, lowest = falls.max(axis=1), falls.argmax(axis=1)
    hidden = greatest - falls[:, 0] > _HIDDEN
    above = [(int(i), int(lowest[i])) for i in peaks(greatest) if hidden[i]]
    return on_all + above[:_MOST_HIDDEN]


def _next(gains: np.ndarray, known: Container[int]) -> list[int]:
    """Return which numbers promise most and are not known: on all lines, and from some band up.

    Args:
        gains: (bands, numbers), on the lines from each band upwards.
        known: indices of numbers.
    """
    best: list[Sequence[int]] = [
        [i for i in peaks(row).tolist() if i not in known][:_NEXT] for row in gains
    ]
    in_turn = [i for rank in itertools.zip_longest(*best[1:]) for i in rank if i is not None]
    return list(dict.fromkeys([*best[0], *in_turn]))[: 2 * _NEXT]
