"""Where to begin the search for gains that the torque is not linear in, and the search itself."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np
from scipy.optimize import least_squares

from controller_node.gains import FreeGain
from controller_node.transfer_function import TransferFunction

TIMES = {"k_position": "k_velocity", "integral_time_s": "k_velocity", "setpoint_weight": "p"}
"""A gain, and which one it multiplies; a time by its inverse."""
_OFF = {"integral_time_s": 1e9}
"""What a gain that multiplies by its inverse is where there is no such product."""
_TRIALS = 7  # values of each of several gains at which the search may begin
_FINE = 25  # the same where there is one of them
_BEGIN = 3


class Record(Protocol):
    """Runs of one controller whose gains are searched for."""

    @property
    def measured(self) -> np.ndarray:
        """Torque where it is not clamped, (F,)."""

    def law(self, gains: Mapping[str, float]) -> TransferFunction:
        """Return the law with these gains."""

    def torque(self, law: TransferFunction) -> np.ndarray:
        """Return the torque of a law from zero state where it is not clamped, (F,)."""

    def equations(
        self, linear: Sequence[str], searched: Mapping[str, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return A (F, linear gains + states) and b (F,): u = A x + b for these searched gains."""


def best_point(
    errors: Callable[[np.ndarray], np.ndarray],
    searched: Sequence[FreeGain],
    begins: Sequence[np.ndarray],
) -> np.ndarray:
    """Return the point that fits best, begun at the best of some points.

    Args:
        errors: returns what a point leaves.
        searched: the gains.
        begins: points.
    """
    trials = sorted(begins, key=lambda point: _sum_of_squares(errors(point)))
    fits = [least_squares(errors, point, bounds=bounds(searched)) for point in trials[:_BEGIN]]
    return min(fits, key=lambda fit: fit.cost).x


def _grid(searched: Sequence[FreeGain], trials: int) -> list[np.ndarray]:
    """Return points all over the ranges of the searched gains."""
    low, high = bounds(searched)
    inner = np.linspace(0.0, 1.0, trials + 2)[1:-1]
    return [low + np.array(p) * (high - low) for p in itertools.product(inner, repeat=low.size)]


def _by_products(
    record: Record, searched: Sequence[FreeGain], linear: Sequence[str]
) -> list[np.ndarray]:
    """Return points at which gains that multiply another one are solved with it, none without such.

    The torque is linear in that gain and in its products with those that multiply it, of which an
    integral time is one by its inverse. Ratios of these products are the gains: exactly, whatever
    they are, where a grid of many decades passes a narrow valley by.
    """
    multiply = [gain.name for gain in searched if TIMES.get(gain.name) in linear]
    curved = [gain for gain in searched if gain.name not in multiply]
    if not multiply:
        return []
    base, off = TIMES[multiply[0]], {name: _OFF.get(name, 0.0) for name in multiply}
    sets = [
        frozenset(s) for n in range(len(multiply) + 1) for s in itertools.combinations(multiply, n)
    ]
    points = []
    for at in _grid(curved, _FINE):
        fixed = values_at(curved, at)
        own, offset = record.equations(linear, {**fixed, **off})
        alone = {**fixed, **off, **dict.fromkeys(linear, 0.0), base: 1.0}
        played = {on: record.torque(record.law({**alone, **dict.fromkeys(on, 1.0)})) for on in sets}
        products = [
            sum((-1) ** len(on - part) * played[part] for part in sets if part <= on)
            for on in sets[1:]
        ]
        solved = solved_linearly(np.column_stack([own, *products]), record.measured - offset)
        weights: dict[frozenset[str], float] = {frozenset(): float(solved[linear.index(base)])}
        weights |= dict(zip(sets[1:], solved[own.shape[1] :].tolist(), strict=True))
        for on in sets:
            if len(on) < len(multiply):
                points.append(_of_ratios(weights, on, fixed, searched))
    return points


def _of_ratios(
    weights: Mapping[frozenset[str], float],
    on: frozenset[str],
    fixed: Mapping[str, float],
    searched: Sequence[FreeGain],
) -> np.ndarray:
    """Return the point of the search that the weights of products with and without gains give.

    Args:
        weights: of the product of each set of gains with the one that they multiply.
        on: the gains that are in both products of a ratio, but for their own.
        fixed: values of the gains that multiply nothing.
        searched: all gains of the search.
    """
    point = []
    for gain in searched:
        value = fixed.get(gain.name)
        if value is None:
            within, without = weights[on | {gain.name}], weights[on - {gain.name}]
            ratio = within / without if without else math.inf
            value = 1.0 / ratio if gain.name in _OFF and ratio else ratio
        point.append(_on_scale(gain, float(np.clip(value, gain.low, gain.high))))
    return np.array(point)


def begins(record: Record, searched: Sequence[FreeGain], linear: Sequence[str]) -> list[np.ndarray]:
    """Return points at which the search for gains may begin.

    Args:
        record: of the controller.
        searched: the gains.
        linear: names of the gains that are solved for at each point.
    """
    trials = _FINE if len(searched) == 1 else _TRIALS
    return _by_products(record, searched, linear) or _grid(searched, trials)


def bounds(searched: Sequence[FreeGain]) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest values of a search, (gains,) each."""
    low = np.array([_on_scale(gain, gain.low) for gain in searched])
    return low, np.array([_on_scale(gain, gain.high) for gain in searched])


def _sum_of_squares(errors: np.ndarray) -> float:
    return float(errors @ errors)


def _on_scale(gain: FreeGain, value: float) -> float:
    return math.log(value) if gain.logarithmic else value


def values_at(gains: Sequence[FreeGain], point: np.ndarray) -> dict[str, float]:
    """Return the gains by name at a point of the search."""
    return {
        gain.name: math.exp(at) if gain.logarithmic else float(at)
        for gain, at in zip(gains, point, strict=True)
    }


def solved_linearly(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the least-squares solution, columns of any size."""
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    return np.linalg.lstsq(columns / size, target, rcond=None)[0] / size
