"""Where to start fitting an effect: every seed tried alone, the best of them scaled and combined.

A seed is an effect of one shape, most often a small one. Where it should go, with the base
parameters following, is predicted linearly (score test with the parent's Jacobian); the prediction
is then tried at several sizes, and the seed with the parameters as they are counts as well, because
neither smallness nor linearity can be relied on. Seeds that differ only in a phase by a quarter
turn span all phases: their best combination is a seed of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np

from fjr_kit.least_squares import Solution

from ..model.rig_model import Model
from .candidates import Candidate, Costs, candidates, scales
from .search_space import Space, beside

_SIZES = (0.1, 0.3, 3.0)  # of the size that the linear prediction asks for, tried after that
_TRIED = 4
_SCALED = 2
LARGEST, LARGEST_OF_TORQUES = 30.0, 1000.0
"""Times a seed: the largest size that is tried, also where a larger one is asked for; the same
where torques along a motion are compared, in which the size of most effects is linear."""
_FOLLOW = 0.1  # how far a parameter of the parent may follow, relative

_Base = Literal["following", "kept", "datasheet"]
"""Base parameters beside a candidate: the parent's, as these would follow it; the parent's as they
are; the datasheet's."""
Errors = Callable[[Sequence[Model]], np.ndarray]
Proposal = tuple[float, Space, np.ndarray]
"""A starting point: what it costs, the space it lies in, the point."""


class Screening:
    """The seeds of one effect beside a fit: what each promises, and starting points from them.

    Attributes:
        gain: by how much the best seed lowers the parent's cost: predicted linearly, or as it is.
    """

    def __init__(
        self,
        parent: Solution,
        model: Model,
        seeds: Sequence[Mapping[str, float]],
        space_of: Callable[[Mapping[str, float]], Space],
        errors: Errors,
        costs: Costs,
        largest: float = LARGEST,
        points: Sequence[tuple[Space, np.ndarray]] = (),
    ) -> None:
        """Evaluate all seeds and points once.

        Args:
            parent: where the parent's fit ended.
            model: the parent's model.
            seeds: starting values of the effect's parameters by full name.
            space_of: the space in which a seed is fitted.
            errors: error vectors of models, as the parent's residuals.
            costs: what error vectors cost.
            largest: the most that a seed is scaled by.
            points: starting points as they are, each with the space it lies in.
        """
        changes = errors([beside(model, seed) for seed in seeds]) - parent.residuals
        inverse = np.linalg.pinv(parent.jacobian, rcond=1e-6)
        self._points = as_they_are(points, parent, errors, costs) if points else []
        self._candidates = candidates(parent, seeds, changes, inverse, costs)
        self._seeds, self._changes = seeds, changes
        self._plain = costs(parent.residuals + changes)
        begun = float(costs(parent.residuals[None])[0])
        self._tries = _Tries(parent, model, inverse, space_of, errors, costs, largest)
        least = min([*self._plain.tolist(), *(cost for cost, *_ in self._points)])
        self.gain = max(self._candidates[0].gain, begun - least)

    def gain_beside(self, other: Solution, ratio: np.ndarray, costs: Costs) -> float:
        """Return what `gain` would be beside another fit, if the seeds changed the motion alike.

        Args:
            other: where the other fit ended.
            ratio: (errors,), weights of the errors of the other's fit over those of the parent's.
            costs: what error vectors of the other fit cost.
        """
        inverse, changes = np.linalg.pinv(other.jacobian, rcond=1e-6), self._changes * ratio
        begun, *plain = costs(np.vstack([other.residuals, other.residuals + changes]))
        linear = candidates(other, self._seeds, changes, inverse, costs)[0].gain
        return max(linear, float(begun - min(plain)))

    def least(self) -> float:
        """Return the least cost of the best seeds, tried at the sizes that promise most."""
        if not self._tries.any:
            chosen = self._candidates[:_TRIED]
            self._tries.run([(c, size) for c in chosen for size in sorted({c.size, 1.0})])
            seeds = {id(seed) for seed in self._seeds}
            combined = [c for c in chosen if id(c.seed) not in seeds]
            self._tries.run([(c, 1.0) for c in combined], "kept")
            order = np.argsort(self._plain, kind="stable")[:_TRIED]
            self._tries.add([(self._seeds[k], self._changes[k]) for k in order], self._plain[order])
        return self._all()[0][0]

    def proposals(self, *, scaled: bool = True) -> list[Proposal]:
        """Return starting points, the most promising first.

        Args:
            scaled: whether the best seeds are tried at several more sizes.

        Returns:
            (cost, space, point), ascending in cost.
        """
        self.least()
        if not scaled:
            return self._all()
        best = self._tries.best(_SCALED)
        self._tries.run([(c, c.size * factor) for c in best for factor in _SIZES])
        self._tries.run_straightened(best)
        return self._all()

    def _all(self) -> list[Proposal]:
        return sorted([*self._tries.proposals(), *self._points], key=lambda one: one[0])


def as_they_are(
    points: Sequence[tuple[Space, np.ndarray]], parent: Solution, errors: Errors, costs: Costs
) -> list[Proposal]:
    """Return points as they are and with the parent's parameters following, ascending in cost.

    Args:
        points: each with the space it lies in, at least one.
        parent: where the parent's fit ended.
        errors: error vectors of models, as the parent's residuals.
        costs: what error vectors cost.
    """
    inverse = np.linalg.pinv(parent.jacobian, rcond=1e-6)
    residuals = errors([space.model(point) for space, point in points])
    followed = []
    for (space, point), left in zip(points, residuals, strict=True):
        step = np.zeros(point.size)
        step[: len(inverse)] = np.clip(inverse @ -left, -_FOLLOW, _FOLLOW)
        followed.append((space, np.clip(point + step, *space.bounds())))
    residuals = np.vstack([residuals, errors([space.model(point) for space, point in followed])])
    tried = zip(costs(residuals).tolist(), [*points, *followed], strict=True)
    return sorted(((cost, *one) for cost, one in tried), key=lambda one: one[0])


class _Tries:
    """Candidates tried at several sizes."""

    def __init__(
        self,
        parent: Solution,
        model: Model,
        inverse: np.ndarray,
        space_of: Callable[[Mapping[str, float]], Space],
        errors: Errors,
        costs: Costs,
        largest: float,
    ) -> None:
        self._parent, self._model, self._inverse = parent, model, inverse
        self._space_of, self._errors, self._costs = space_of, errors, costs
        self._largest = largest
        self._spaces: dict[int, Space] = {}
        self._found: list[tuple[float, Candidate, np.ndarray]] = []
        self._tried: set[tuple[int, float, _Base]] = set()

    def run(self, tries: Sequence[tuple[Candidate, float]], base: _Base = "following") -> None:
        """Evaluate candidates at sizes, with base parameters of some kind."""
        most = self._largest
        within = [(c, float(np.clip(size, -most, most))) for c, size in tries if abs(size) > 1e-3]
        new = {(id(c), size, base): (c, size) for c, size in within}
        tries = [one for key, one in new.items() if key not in self._tried]
        self._tried.update(new)
        if not tries:
            return
        points = [self._point(candidate, size, base) for candidate, size in tries]
        trials = self._errors(
            [self._space(c).model(p) for (c, _), p in zip(tries, points, strict=True)]
        )
        costs = self._costs(trials)
        for (candidate, _), point, cost in zip(tries, points, costs, strict=True):
            self._found.append((float(cost), candidate, point))
        self._found.sort(key=lambda one: one[0])

    def add(
        self, seeds: Sequence[tuple[Mapping[str, float], np.ndarray]], costs: np.ndarray
    ) -> None:
        """Take seeds that were evaluated as they are, with what they change, beside the parent."""
        for (seed, change), cost in zip(seeds, costs, strict=True):
            one = Candidate(seed, change, 1.0, 0.0)
            self._found.append((float(cost), one, self._point(one, 1.0, "kept")))
        self._found.sort(key=lambda one: one[0])

    @property
    def any(self) -> bool:
        """Whether something was tried."""
        return bool(self._found)

    def best(self, most: int) -> list[Candidate]:
        """Return the candidates that did best so far."""
        order: dict[int, Candidate] = {}
        for _, candidate, _ in self._found:
            order.setdefault(id(candidate.seed), candidate)
        return list(order.values())[:most]

    def proposals(self) -> list[Proposal]:
        """Return all that was tried, ascending in cost."""
        return [(cost, self._space(c), point) for cost, c, point in self._found]

    def _space(self, candidate: Candidate) -> Space:
        if id(candidate.seed) not in self._spaces:
            self._spaces[id(candidate.seed)] = self._space_of(candidate.seed)
        return self._spaces[id(candidate.seed)]

    def run_straightened(self, candidates: Sequence[Candidate]) -> None:
        """Evaluate candidates beside the datasheet, where the parent's parameters leave it far.

        A refit bends all parameters to do what a large effect does; the fit would then begin with
        the effect twice, and may never find its way back.
        """
        for candidate in candidates:
            space = self._space(candidate)
            bent = np.abs(self._parent.x[: len(space.nominal)]) > np.log1p(space.tolerance)
            if bent.any():
                sizes = sorted({candidate.size, 1.0, 2.0})
                self.run([(candidate, size) for size in sizes], "datasheet")

    def _point(self, candidate: Candidate, size: float, base: _Base) -> np.ndarray:
        """Return the seed with its sizes scaled, and the parameters of the parent."""
        space, parents = self._space(candidate), self._parent.x.size
        seed = {n: v * size if scales(n) else v for n, v in candidate.seed.items()}
        point = space.point(beside(self._model, seed))
        if base == "datasheet":
            point[: len(space.nominal)] = 0.0
        if base == "following":
            step = self._inverse @ -(self._parent.residuals + size * candidate.change)
            point[:parents] += np.clip(step, -_FOLLOW, _FOLLOW)
        return np.clip(point, *space.bounds())
