"""Where to start fitting a law of several parts once one of its parts has been fitted.

A law such as LuGre friction has too many parameters to be found from a few seeds; where one of its
parts leads, what that has found is where the whole begins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from fjr_sim_node import effects as fx

from ..model.rig_model import Model
from .candidates import Costs
from .screening import Errors, Proposal
from .search_space import Space


def from_part(
    whole: str,
    part: str,
    fitted: Model,
    seeds: Sequence[Mapping[str, float]],
    space_of: Callable[[Mapping[str, float]], Space],
    errors: Errors,
    costs: Costs,
) -> list[Proposal]:
    """Return starts of a law from the fit of one of its parts.

    Args:
        whole: identifier of the law.
        part: identifier of what it contains and the fit has.
        fitted: the model of that fit.
        seeds: starts of the law, of which the part's fit replaces what it knows.
        space_of: the space in which a seed is fitted.
        errors: error vectors of models.
        costs: what error vectors cost.

    Returns:
        (cost, space, point), ascending in cost; empty if the part says nothing of the law.
    """
    begins = fx.EFFECTS[whole].from_part
    known = begins(fitted.effects, fitted.plant) if begins else {}
    if not known:
        return []
    rest = {n: v for n, v in fitted.effects.items() if not n.startswith(f"{part}.")}
    begun = {tuple({**seed, **known}.items()) for seed in seeds}
    spaces, points = [], []
    for seed in map(dict, sorted(begun)):
        space = space_of(seed)
        point = space.point(Model(fitted.plant, {**rest, **seed}))
        spaces.append(space)
        points.append(np.clip(point, *space.bounds()))
    found = costs(errors([space.model(x) for space, x in zip(spaces, points, strict=True)]))
    order = np.argsort(found)
    return [(float(found[i]), spaces[i], points[i]) for i in order]
