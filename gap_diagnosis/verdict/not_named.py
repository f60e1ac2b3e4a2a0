"""Sentences on causes that are not named though they pass some tests or close much of the gap."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import left_of
from ..outcome.verdict_words import explanation
from .tested_causes import Tested

_MUCH = 0.5
"""Share of the gap that a cause closes, from which on it is said why it is not named."""


def why_not(tested: Tested) -> list[str]:
    """Return why a cause that closes much is not named; nothing of one that closes little."""
    return [*_changing(tested), *_kin(tested), *_bent(tested)]


def unsure(doubted: Mapping[str, float]) -> list[str]:
    """Return the sentence on causes that passed all tests, but not surely enough for a third."""
    if not doubted:
        return []
    shown = ", ".join(f"{explanation([effect])} ({p:.0%})" for effect, p in doubted.items())
    return [
        f"What may be there as well, but is not sure enough to be named beside two others: {shown}."
    ]


def beyond_named(
    fitter: CellFitter, best: CellFit, named: CellFit, doubted: Collection[str]
) -> list[str]:
    """Return the sentence on what was found beside the named causes and leaves much less with them.

    None is said of causes that spoil what no fit has seen.

    Args:
        fitter: of both fits.
        best: all that was found.
        named: the named causes.
        doubted: identifiers of effects that are not named since none is sure.
    """
    more = [effect for effect in best.effects if effect not in named.effects]
    left = left_of(fitter, best, named)
    if not more or not {*more} <= {*doubted} or not left < _MUCH:
        return []
    beside = (" as well", "the named causes leave") if named.effects else ("", "the refit leaves")
    return [
        f"With {', '.join(explanation([effect]) for effect in more)}{beside[0]}, {left:.0%} of the "
        f"squared error would be left that {beside[1]}: the catalogue may account for it, but none "
        "of these effects is sure."
    ]


def _changing(tested: Tested) -> list[str]:
    """Return the sentence on a cause that closes much, but not with the same size at all levels."""
    if tested.invariant or not tested.gain.present or not tested.share.value >= _MUCH:
        return []
    return [
        f"{explanation([tested.effect]).capitalize()} would close {tested.share.value:.0%} of what "
        "the refit left, but not with the same size at all levels "
        f"(p = {tested.invariance_p:.1g}), so it is not named: what is there follows another law."
    ]


def _kin(tested: Tested) -> list[str]:
    """Return the sentence on a cause that is not named since most of the error stays beside it."""
    if not tested.nearest_kin:
        return []
    return [
        f"{explanation([tested.effect]).capitalize()} would close {tested.share.value:.0%} of what "
        "the refit left, and does so on data that no fit has seen, but most of the error stays, so "
        "it is not named: what is there may be of a law whose nearest kin in the catalogue it is."
    ]


def _bent(tested: Tested) -> list[str]:
    """Return the sentence on a cause that is not named since its law ended at a limit."""
    if not tested.of_another_form or not tested.share.value >= _MUCH:
        return []
    parameter = fx.parameter(str(tested.bounded))
    return [
        f"{explanation([tested.effect]).capitalize()} would close {tested.share.value:.0%} of what "
        f"the refit left, but its {parameter.name.split('.')[1]} ended where a fit may go no "
        "further, so it is not named: what is there is akin to it, of another form."
    ]
