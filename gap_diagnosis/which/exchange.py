"""Causes that a search has found, put in place of each other while it goes on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import gain, stands_for
from .extension import Extension
from .found import Found
from .presence import at_its_bound

_FEWEST = 3
"""Causes of which one may hinder the others: of two, each was chosen beside the other or none."""


def replace_bounded(found: Found, fitter: CellFitter, extension: Extension) -> None:
    """Put another effect in the place of a former cause whose shape has come to a bound.

    While a further cause is missing, a law may do in part what that does, and beside it end as a
    limit case of another law: a cable that gives way at once is viscous friction.

    Args:
        found: what the search has found, whose steps are changed.
        fitter: fits explanations.
        extension: extends them.
    """
    for effect in found.best.effects[:-1]:
        best = found.best
        if not at_its_bound(best, effect):
            continue
        without = fitter.without(best, effect)
        fits = extension.extended(without, found.steps)
        free = [f for f in fits if not at_its_bound(f, f.effects[-1])]
        other = extension.chosen(free, without)
        worth = extension.gain(best, without).mean
        if other is None or not stands_for(fitter, other, best, worth):
            continue
        before = [fit for fit in found.steps if effect not in fit.effects]
        found.alternatives[other.effects[-1]] = extension.tied(other, fits, without)
        found.steps[:] = [*before, without, other]


def drop_hindering(found: Found, fitter: CellFitter, extension: Extension) -> None:
    """Take out former causes without which the others do better; arguments as `replace_bounded`.

    While further causes are missing, a law may do a part of what they do; beside them it holds
    their sizes away from where they belong. What was added beside it is chosen anew.
    """
    for effect in found.best.effects[:-1]:
        best = found.best
        if len(best.effects) < _FEWEST:
            return
        fewer = fitter.without(best, effect)
        if not extension.gain(fewer, best).present:
            continue
        last = best.effects[-1]
        rest = fitter.without(fewer, last)
        fits = extension.ranked(
            [fewer, *extension.extended(rest, found.steps, [last])], rest
        )  # fmt: skip
        other = extension.chosen(fits, rest) or fewer
        before = [fit for fit in found.steps if not {effect, last} & {*fit.effects}]
        found.alternatives[other.effects[-1]] = extension.tied(other, fits, rest)
        found.steps[:] = [*before, rest, other]


def with_the_better_one(
    found: Found, tied: Mapping[str, Sequence[CellFit]], fitter: CellFitter
) -> Found | None:
    """Return what was found with another effect in the place of a cause that it surely outdoes.

    A near equivalent that lost when the cause was chosen may do better beside all the others.

    Args:
        found: what the search has found and the tests have kept.
        tied: for each cause, fits with another effect in its place.
        fitter: that made all fits.
    """
    best = found.best
    gains = [
        (gain(fitter, fit, best), effect, fit) for effect, fits in tied.items() for fit in fits
    ]
    surely = [one for one in gains if one[0].surely_present]
    if not surely:
        return None
    _, effect, fit = max(surely, key=lambda one: one[0].mean)
    steps = [step for step in found.steps if effect not in step.effects]
    alternatives = {**found.alternatives, fit.effects[-1]: [effect]}
    return replace(found, steps=[*steps, fit], alternatives=alternatives)
