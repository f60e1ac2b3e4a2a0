"""Fits that end as far from the datasheet as they may go: further looks at what a first one found.

Fits look a few tolerances away from the datasheet. A stiffness that is off by half lies beyond;
then nothing explains the gap, or what has a gain of its own does, such as an eccentric encoder. Or
a datasheet that is right was left, since a cause was missing: an inertia that is twice as great
follows noise and ripple of a recorded torque less, and beside it what is missing shows little.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from fjr_sim_node import effects as fx

from .investigation import Investigation
from .outcome.diagnosis import Diagnosis
from .starts.search_space import farthest
from .verdict.notes import MASSES_AND_SPRING, at_limits

WIDER, CLOSER = 5.0, 0.2
"""How many tolerances a further look takes for one."""
_HALF = 0.5  # of the misfit: what leaves less does clearly better
_LESS = 0.7  # the same where nothing is added, or friction or stiffness that the datasheet lacks
_ALIKE = 1.2  # times the misfit: what leaves less does about as well
_COMMON = 0.2  # range of the logarithms of ratios to the datasheet, within which one gain holds all


def called_for(found: Investigation, nominal: Mapping[str, float]) -> dict[float, str]:
    """Return the further looks to take: how many tolerances for one, and what that supposes.

    None, unless a fit ended as far from the datasheet as it may go, or a gain is named. Where a
    recorded torque drives the model, whose noise an inertia may follow, the datasheet may be right.

    Args:
        found: the first look.
        nominal: bare parameters of the datasheet.
    """
    if found.fitted is None:
        return {}
    evidence = found.fitted.evidence
    driven = not evidence.slow and None in evidence.player.loop.laws
    ended = _ended(found)
    looks = {}
    if ended or _has_gain(found.diagnosis, nominal):
        looks[WIDER] = "is further off"
    if ended and driven:
        looks[CLOSER] = "is right"
    return looks


def says_more(
    other: Investigation, found: Investigation, nominal: Mapping[str, float], times: float
) -> bool:
    """Tell whether a further look explains more, or as much by fewer effects.

    All parameters off by one factor are a gain, and no better than one that is named. Nor is a
    datasheet that is taken for further off and still ends at a limit, or needs more causes besides,
    other than what it lacks itself: then its parameters stand for what no effect explains.

    Args:
        other: of the further look.
        found: of the first one.
        nominal: bare parameters of the datasheet.
        times: how many tolerances the further look took for one.
    """
    second, first = other.diagnosis, found.diagnosis
    left = [_left(diagnosis) for diagnosis in (second, first)]
    if _has_gain(first, nominal) and _one_factor(second, nominal):
        return False
    more_causes = first.effects and len(_beside(first)) < len(_beside(second))
    if times > 1.0 and (more_causes or _ended(other)):
        return False
    if len(second.effects) < len(first.effects):
        return left[0] <= _ALIKE * left[1]
    adds = set(second.effects) - set(first.effects)
    only_lacked = set(first.effects) <= set(second.effects) and not adds & set(_beside(second))
    return left[0] < (_LESS if only_lacked else _HALF) * left[1]


def said(second: Diagnosis, nominal: Mapping[str, float], tolerance: float, times: float) -> str:
    """Return what a further look, which took so many tolerances for one, says of the datasheet."""
    if times < 1.0:
        return (
            f"Fits that may go {farthest(tolerance):.0%} from the datasheet explain less than "
            f"those that keep within {farthest(times * tolerance):.0%} of it; so these count."
        )
    off = {name: ratio - 1.0 for name, ratio in _ratios(second, nominal).items()}
    far = [
        f"{name} is {100.0 * abs(by):.0f} % {'above' if by > 0.0 else 'below'} it"
        for name, by in off.items()
        if abs(by) > tolerance and name in MASSES_AND_SPRING
    ]
    told = f": {', '.join(far)}" if far else ""
    return (
        f"If the datasheet is off by about {tolerance:.0%} at most, less is explained, or more "
        f"effects are needed; so it was taken for further off{told}. Check its units, and the "
        "factor of the torque."
    )


def _ended(found: Investigation) -> bool:
    """Tell whether an inertia or the stiffness lies as far from the datasheet as fits may go."""
    if found.fitted is None:
        return False
    best = found.fitted.found.best
    ended = at_limits(best.space, best.solution.x, best.model.plant, MASSES_AND_SPRING)
    return bool(ended)


def _has_gain(diagnosis: Diagnosis, nominal: Mapping[str, float]) -> bool:
    """Tell whether a cause stands for a gain that the fits have no other parameter for.

    Beside a datasheet of a single value a gain of the torque is one, too: that value, which is then
    far off, does the same.
    """
    given = [name for name, value in nominal.items() if value and math.isfinite(value)]
    gains = ("about one angle", "everywhere") if len(given) == 1 else ("about one angle",)
    return any(fx.EFFECTS[effect].scales in gains for effect in diagnosis.effects)


def _beside(diagnosis: Diagnosis) -> list[str]:
    """Return the causes that are no friction or stiffness which the datasheet lacks."""
    return [effect for effect in diagnosis.effects if not fx.EFFECTS[effect].of_bare_plant]


def _left(diagnosis: Diagnosis) -> float:
    gap = diagnosis.gap.explained or diagnosis.gap.refit
    return math.inf if gap is None or gap.chi2_per_dof is None else gap.chi2_per_dof


def _ratios(diagnosis: Diagnosis, nominal: Mapping[str, float]) -> dict[str, float]:
    return {
        name: diagnosis.parameters[name].value / value
        for name, value in nominal.items()
        if name in diagnosis.parameters and value and math.isfinite(value)
    }


def _one_factor(diagnosis: Diagnosis, nominal: Mapping[str, float]) -> bool:
    ratios = [r for r in _ratios(diagnosis, nominal).values() if r > 0.0]
    return len(ratios) > 1 and math.log(max(ratios) / min(ratios)) < _COMMON
