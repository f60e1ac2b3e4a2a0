"""Unknown gains of a known controller, solved from a record of r, u and y.

u is what the controller made of the recorded r and y, whatever the plant did: without noise on u
its gains come out exact. Most of them enter linearly, as does the state in which the controller was
before the first sample; time constants and products of gains are searched, the rest solved within
(variable projection; Golub, Pereyra, Inverse Problems 19, 2003).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from controller_node.gains import FreeGain, free_gains
from controller_node.law import law_as_run
from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError

from .controller_check import clamp_nm
from .gain_search import TIMES, begins, best_point, bounds, solved_linearly, values_at

_LIMIT = "torque_limit_nm"
_CURVED = {"n", "velocity_filter_rad_s", "integral_time_s"}
_MOST_CURVED = 2
_TIGHT = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
_STEP = 1e-5
_BEYOND = 3.0
_SEARCH_SAMPLES = 10_000
_BLOCKS = 60
_SINGULAR = 1e-9


@dataclass(frozen=True)
class IdentifiedGains:
    """Gains of a controller as a record shows them.

    Attributes:
        values: each unknown gain by its name; a torque limit of infinity was not reached.
        standard_errors: of each, from the scatter of blocks, so that a residual that is not white
            counts; infinite where the record does not show the gain, zero for a torque limit.
        explained: fraction of the torque's variance that the law then explains, where it is not
            clamped; 1 is all, 0 and below nothing.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    explained: float


def identify_gains(
    controller: Mapping[str, Any],
    reference: np.ndarray,
    torque: np.ndarray,
    position: np.ndarray,
    sample_rate_hz: float,
) -> IdentifiedGains:
    """Solve for the unknown gains of a `controller` entry by least squares of the torque.

    Args:
        controller: the entry, with gains that are unknown.
        reference: r in rad, float64 (samples,), or (runs, samples) for runs of one controller.
        torque: u in N m, likewise.
        position: y in rad, likewise, as the controller saw it.
        sample_rate_hz: their rate.

    Raises:
        InputError: nothing is unknown, the signals are unfit, or too many gains are searched for.
    """
    r, u, y = (np.atleast_2d(np.asarray(s, float)) for s in (reference, torque, position))
    if not r.shape == u.shape == y.shape or not np.isfinite([r, u, y]).all():
        raise InputError("Gains need reference, torque and position of one length, all finite.")
    if not np.ptp(u) > 0.0:
        raise InputError("Gains need a torque that moves; this record has none.")
    scale = float(np.std(u)), float(np.std(r - y)) or 1.0
    gains = free_gains(controller, sample_rate_hz, *scale)
    if not gains:
        raise InputError("No gain of this controller is unknown, so there is none to identify.")
    known = controller.get(_LIMIT)
    clamp = clamp_nm(u.ravel(), math.inf if known is None else float(known))
    record = _Record(dict(controller), sample_rate_hz, r, u, y, np.abs(u) < clamp)
    solved = _solved(record, gains)
    if all(gain.name != _LIMIT for gain in gains):
        return solved
    limit = clamp if record.reaches(clamp, solved) else math.inf
    return IdentifiedGains(
        {**solved.values, _LIMIT: limit},
        {**solved.standard_errors, _LIMIT: 0.0},
        solved.explained,
    )


@dataclass(frozen=True)
class _Record:
    """Runs of one controller, (runs, samples) each; free: where the torque is not clamped."""

    controller: dict[str, Any]
    rate: float
    r: np.ndarray
    u: np.ndarray
    y: np.ndarray
    free: np.ndarray

    @property
    def measured(self) -> np.ndarray:
        """Torque where it is not clamped, (F,)."""
        return self.u[self.free]

    def thinned(self) -> _Record:
        """Return the record with few enough free samples for a search."""
        every = 1 + self.free.size // _SEARCH_SAMPLES
        return replace(self, free=self.free & (np.arange(self.free.shape[1]) % every == 0))

    def law(self, gains: Mapping[str, float]) -> TransferFunction:
        """Return the law with these gains and any limit."""
        missing = {_LIMIT: math.inf} if _LIMIT in self.controller["unknown"] else {}
        return law_as_run(self.controller, self.rate, {**gains, **missing})

    def torque(self, law: TransferFunction) -> np.ndarray:
        """Return the torque of a law from zero state where the record's is free, (F,)."""
        runs = [law.unlimited(r, y) for r, y in zip(self.r, self.y, strict=True)]
        return np.stack(runs)[self.free]

    def reaches(self, clamp: float, solved: IdentifiedGains) -> bool:
        """Tell whether the law goes beyond a torque at which the record often ends.

        A torque in coarse counts ends there, too, without being clamped.
        """
        law = self.law(solved.values)
        beyond = []
        for r, u, y, free in zip(self.r, self.u, self.y, self.free, strict=True):
            state = law.entering_state(r, y, u, free)
            beyond.append(np.abs(law.unlimited(r, y, state))[~free] - clamp)
        scatter = math.sqrt(max(1.0 - solved.explained, 0.0)) * float(np.std(self.u[self.free]))
        ends = np.concatenate(beyond)
        return bool(ends.size) and float(np.median(ends)) > _BEYOND * scatter

    def equations(
        self, linear: Sequence[str], searched: Mapping[str, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return A (F, linear gains + states) and b (F,): u = A x + b for these searched gains."""
        zero, one = (dict.fromkeys(linear, value) for value in (0.0, 1.0))
        offset = self.torque(self.law({**searched, **zero}))
        columns = [
            self.torque(self.law({**searched, **zero, name: 1.0})) - offset for name in linear
        ]
        entered = self.law({**searched, **one}).free_responses(self.r.shape[1])
        for run, state in itertools.product(range(len(self.r)), entered.T):
            signal = np.zeros_like(self.r)
            signal[run] = state
            columns.append(signal[self.free])
        return np.reshape(columns, (len(columns), offset.size)).T, offset


def _solved(record: _Record, gains: Sequence[FreeGain]) -> IdentifiedGains:
    """Return all gains but a torque limit."""
    names = {gain.name for gain in gains}
    searched = [g for g in gains if g.name in _CURVED or TIMES.get(g.name) in names]
    at = {gain.name for gain in searched}
    linear = [g.name for g in gains if g.name not in at and g.name != _LIMIT]
    curved = sorted(name for name in at & _CURVED if TIMES.get(name) not in linear)
    if len(curved) > _MOST_CURVED:
        raise InputError(
            f"{', '.join(curved)} cannot all be told from one torque; give values for all but "
            f"{_MOST_CURVED}."
        )
    measured = record.measured

    def model(
        point: np.ndarray, weights: np.ndarray | None = None, of: _Record = record
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the modelled torque, its columns and their weights at values of the search."""
        columns, offset = of.equations(linear, values_at(searched, point))
        if weights is None:
            weights = solved_linearly(columns, of.measured - offset)
        weights = np.pad(weights, (0, max(columns.shape[1] - weights.size, 0)))
        return columns @ weights[: columns.shape[1]] + offset, columns, weights

    def errors(point: np.ndarray, of: _Record = record) -> np.ndarray:
        return (model(point, of=of)[0] - of.measured) / np.std(measured)

    point = np.zeros(0)
    if searched:
        thinned = record.thinned()
        points = begins(thinned, searched, linear)
        point = best_point(partial(errors, of=thinned), searched, points)
        point = least_squares(errors, point, bounds=bounds(searched), **_TIGHT).x
    torque, columns, weights = model(point)
    slopes = [(model(point + h, weights)[0] - torque) / h.sum() for h in _STEP * np.eye(point.size)]
    deviations = _standard_errors(np.column_stack([*slopes, columns]), measured - torque)
    # Searched on a logarithm, the error is one of the logarithm.
    values = values_at(searched, point)
    units = [values[gain.name] if gain.logarithmic else 1.0 for gain in searched]
    deviations[: len(units)] *= units
    found = {**values, **dict(zip(linear, weights.tolist(), strict=False))}
    explained = 1.0 - float(np.var(measured - torque) / np.var(measured))
    return IdentifiedGains(found, dict(zip(found, deviations.tolist(), strict=False)), explained)


def _standard_errors(jacobian: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Return the standard errors of a least-squares solution, by blocks of the residual.

    The scores of blocks are nearly independent, whatever the colour of the residual within them
    (the sandwich estimator; White, Econometrica 48, 1980).
    """
    size = np.linalg.norm(jacobian, axis=0)
    size[size == 0.0] = 1.0
    _, s, vt = np.linalg.svd(np.linalg.qr(jacobian / size, mode="r"))
    kept = s > _SINGULAR * s[0]
    inverse = (vt[kept].T / s[kept] ** 2) @ vt[kept]
    scores = (jacobian / size) * left[:, None]
    blocks = np.array([block.sum(axis=0) for block in np.array_split(scores, _BLOCKS)])
    errors = np.sqrt(np.maximum(np.diag(inverse @ (blocks.T @ blocks) @ inverse), 0.0)) / size
    errors[np.abs(vt[~kept]).max(axis=0, initial=0.0) > math.sqrt(_SINGULAR)] = math.inf
    return errors
