"""What each seed of an effect would gain at its linearly best size, all base parameters following.

Seeds that differ only in a phase by a quarter turn count together: their best combination is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_kit.least_squares import Solution
from fjr_sim_node import effects as fx

Costs = Callable[[np.ndarray], np.ndarray]
"""Takes errors, (models, errors) in standard deviations; returns what each costs, (models,)."""


@dataclass(frozen=True)
class Candidate:
    """A seed, how it changes the errors, its linearly best size and what that would gain."""

    seed: Mapping[str, float]
    change: np.ndarray
    size: float
    gain: float


def candidates(
    parent: Solution,
    seeds: Sequence[Mapping[str, float]],
    changes: np.ndarray,
    inverse: np.ndarray,
    costs: Costs,
) -> list[Candidate]:
    """Return one candidate for each seed, or for each pair of seeds a quarter turn apart.

    Args:
        parent: of the seeds.
        seeds: starting values.
        changes: (seeds, errors), what each changes.
        inverse: of the parent's Jacobian.
        costs: what error vectors cost.

    Returns:
        The candidates, descending in gain.
    """
    own = changes - (changes @ inverse.T) @ parent.jacobian.T  # what the parent cannot follow
    found = []
    for members in by_shape(seeds).values():
        weights, *_ = np.linalg.lstsq(own[members].T, -parent.residuals, rcond=1e-9)
        if len(members) == 1 and not any(map(scales, seeds[members[0]])):
            weights = np.ones(1)
        before, after = costs(
            np.array([parent.residuals, parent.residuals + weights @ own[members]])
        )
        gain = float(before - after)
        if len(members) == 1:
            seed, size = seeds[members[0]], float(weights[0])
            if size < 0.0 and not _may_be_negative(seed):
                size, gain = 1.0, 0.0
            found.append(Candidate(seed, changes[members[0]], size, gain))
            continue
        size = float(np.hypot(*weights)) or 1.0
        name = _phase_name(seeds[members[0]])
        assert name is not None  # two seeds of one shape differ in it
        phase = {name: float(np.arctan2(weights[1], weights[0]))}
        change = (weights @ changes[members]) / size
        found.append(Candidate({**seeds[members[0]], **phase}, change, size, gain))
    return sorted(found, key=lambda candidate: -candidate.gain)


def by_shape(seeds: Sequence[Mapping[str, float]]) -> dict[tuple, list[int]]:
    """Group seeds that differ only in the phases 0 and a quarter turn, in this order."""
    groups: dict[tuple, list[int]] = {}
    for index, seed in enumerate(seeds):
        phase = _phase_name(seed)
        quarter = phase is not None and seed[phase] in (0.0, np.pi / 2)
        key = tuple((n, v) for n, v in seed.items() if not (quarter and n == phase))
        groups.setdefault((key, None if quarter else index), []).append(index)
    return groups


def _phase_name(seed: Mapping[str, float]) -> str | None:
    names = [name for name in seed if fx.parameter(name).role == "angle"]
    return names[0] if names else None


def _may_be_negative(seed: Mapping[str, float]) -> bool:
    return all(fx.parameter(name).may_be_negative for name in seed if _is_size(name))


def scales(name: str) -> bool:
    """Tell whether what an effect does grows with a parameter, by its full name."""
    return fx.parameter(name).role in ("size", "harmonic")


def _is_size(name: str) -> bool:
    """Tell whether a parameter, by its full name, switches its effect or a part of it."""
    return fx.parameter(name).role in ("size", "limit", "harmonic")
