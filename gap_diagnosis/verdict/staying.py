"""Which of the causes with their tests stay though they fail, and which may go though they pass."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..which.equivalents import founded
from .tested_causes import Tested

SURE = 0.8
"""How surely a cause beyond the two that gain most must be present."""
LEAST_BEARING = 0.2
"""How surely a cause must be there that stays only because sure ones fail without it."""
_MAY_BE_UNSURE = 2


def bases_of(fitter: CellFitter, tested: Sequence[Tested], names: Sequence[str]) -> set[str]:
    """Return the causes that others modify which pass, where the datasheet lacks them.

    Left alone, what modifies one would bend to stand in for it (see `founded`): friction that falls
    from breakaway becomes the whole friction, with a velocity that is not its own.
    """
    passed = [t.effect for t in tested if t.passed]
    return {
        t.effect
        for t in tested
        if t.certain and t.invariant
        for e in passed
        if fx.EFFECTS[e].modifies == t.effect and not founded([e], (), fitter.nominal, names)
    }


def with_borne(tested: Sequence[Tested]) -> list[Tested]:
    """Return the causes with the presence of those that modify them, where that is greater."""
    return [
        replace(
            t,
            borne=max(
                (o.present for o in tested if fx.EFFECTS[o.effect].modifies == t.effect),
                default=0.0,
            ),
        )
        for t in tested
    ]


def lacked_frictions(lacking: Collection[str], tested: Sequence[Tested]) -> set[str]:
    """Return the frictions that the datasheet lacks and every joint has, which may well be there.

    They are told with how sure they are; of few parts hardly any cause repeats surely.
    """
    there = [t for t in tested if t.known_though_it_drifts and t.present >= LEAST_BEARING]
    return {t.effect for t in there if t.effect in lacking}


def bears(tested: Sequence[Tested], without: Sequence[Tested], least: float = SURE) -> bool:
    """Tell whether a cause bears others: these pass beside it, surely enough, and not without it.

    Args:
        tested: all causes.
        without: the others, tested without it.
        least: how surely the others must be present beside it.
    """
    beside = {t.effect for t in tested if t.passed and t.present >= least}
    return any(t.effect in beside and not t.passed for t in without)


def guesses(tested: Sequence[Tested], lacking: Collection[str] = ()) -> list[Tested]:
    """Return the causes beyond the two that gain most of which one is not sure.

    Each step tries the whole catalogue on what is left; the more steps, the likelier one of them
    finds what resembles a part of the remainder. Friction that the datasheet lacks is no guess.
    """
    found = [t for t in tested if t.effect not in lacking]
    further = sorted(found, key=lambda t: -t.gain.mean)[_MAY_BE_UNSURE:]
    return [t for t in further if t.present < SURE]
