"""Causes that name another one twice: near equivalents, of which each does what both do."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import NEARLY_ALL, left_of
from .tested_causes import Tested

_TWICE = 0.15
"""Of what two near equivalents close: where each closes less beside the other, either alone does
nearly all, and both together are one cause whose law has another form than the catalogue's."""


def twice(fitter: CellFitter, best: CellFit, tested: Sequence[Tested]) -> list[Tested]:
    """Return the causes that close little beside a near equivalent which closes little as well.

    Little of what both close together; beside others, that may itself be little of the gap. What
    closes nearly all of the rest by a law of its own is there (`CONSTANT_TORQUE`).
    """
    found: set[str] = set()
    little = {t.effect: t for t in tested if t.share.value < _TWICE and not _closes_the_rest(t)}
    for effect, other in itertools.combinations(little, 2):
        if other not in fx.near_equivalents(effect):
            continue
        neither = fitter.without(little[effect].without, other)
        alone = (little[effect].without, little[other].without)
        left, *others = (left_of(fitter, fit, neither) for fit in (best, *alone))
        if max(others) - left < _TWICE * (1.0 - left):
            found |= {effect, other}
    return [t for t in tested if t.effect in found]


def _closes_the_rest(tested: Tested) -> bool:
    by_its_own_law = fx.EFFECTS[tested.effect].by_its_own_law
    return by_its_own_law and tested.over_noise_closed > 1.0 - NEARLY_ALL
