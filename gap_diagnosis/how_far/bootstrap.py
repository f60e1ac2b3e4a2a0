"""Figures with 95 % intervals: rms over parts, which are drawn with replacement (Efron 1979)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..outcome.gap_size import Figure, StageFigures

_DRAWS = 2000


@dataclass(frozen=True)
class Choice:
    """Indices of what a figure is taken over, and those of each draw, (draws, chosen)."""

    chosen: np.ndarray
    draws: np.ndarray

    @classmethod
    def among(cls, chosen: Sequence[int], groups: np.ndarray) -> Choice:
        """Draw from the chosen ones of each group, or from all of it where a group has one chosen.

        Args:
            chosen: indices.
            groups: (all,), the group of each, such as its level.
        """
        among = np.array(chosen)
        enough = all(np.count_nonzero(groups[among] == group) > 1 for group in set(groups[among]))
        pool = among if enough else np.arange(groups.size)
        rng = np.random.default_rng(0)
        draws = [rng.choice(pool[groups[pool] == groups[i]], _DRAWS) for i in chosen]
        return cls(among, np.stack(draws, axis=1))


def stage_figures(
    squares: Mapping[str, np.ndarray], least: np.ndarray | None, choice: Choice, closes: bool
) -> StageFigures:
    """Return one figure at each stage, and the share of it that the causes close.

    Args:
        squares: of the figure by stage (nominal, refit, explained), (all,) each.
        least: what noise alone leaves of them, (all,); None where that is not known.
        choice: over which the mean is taken.
        closes: whether a cause was added, so that a share of the gap closed can be stated.
    """
    floor = np.zeros(squares["refit"].size) if least is None else least
    return StageFigures(
        **{stage: root(values, choice) for stage, values in squares.items()},
        noise_floor=None if least is None else root(least, choice),
        closed=closed(squares["refit"], squares["explained"], floor, choice) if closes else None,
    )


def root(squares: np.ndarray, choice: Choice) -> Figure | None:
    """Return the root of the mean with its interval; None where a chosen one is not finite."""
    value = float(np.sqrt(squares[choice.chosen].mean()))
    if not np.isfinite(value):
        return None
    return _figure(value, np.sqrt(squares[choice.draws].mean(axis=1)), choice)


def closed(
    before: np.ndarray, after: np.ndarray, least: np.ndarray, choice: Choice
) -> Figure | None:
    """Return 1 - (E_after^2 - N^2)/(E_before^2 - N^2) with its interval.

    None where that means nothing: a motion diverges, what the refit leaves cannot be told from
    noise (its own interval holds zero), or the effect brings the simulation no nearer.

    Args:
        before: squared errors without the causes, (all,).
        after: with them, (all,).
        least: what noise alone leaves of them, (all,).
        choice: over which the mean is taken.
    """
    there, left = before - least, after - least
    value = there[choice.chosen].mean()
    if not (np.isfinite(there).all() and np.isfinite(left).all() and value > 0.0):
        return None
    drawn, open_ = there[choice.draws].mean(1), np.maximum(left[choice.draws].mean(1), 0.0)
    share = float(1.0 - max(left[choice.chosen].mean(), 0.0) / value)
    if share <= 0.0 or np.percentile(drawn, 2.5) <= 0.0:
        return None
    return _figure(share, 1.0 - open_[drawn > 0.0] / drawn[drawn > 0.0], choice)


def ratio(part: np.ndarray, whole: np.ndarray, choice: Choice) -> Figure:
    """Return a sum over another one, with its interval.

    Args:
        part: what is summed, (all,).
        whole: what it is compared with, (all,), none below zero.
        choice: over which both are summed.
    """
    value, drawn = (
        part[i].sum(-1) / np.maximum(whole[i].sum(-1), 1e-300)
        for i in (choice.chosen, choice.draws)
    )
    return _figure(float(value), drawn, choice)


def _figure(value: float, drawn: np.ndarray, choice: Choice) -> Figure:
    known = drawn.size > 0 and np.isfinite(drawn).all()
    if not (known and np.ptp(choice.draws, axis=0).any()):
        return Figure(value=value, low=None, high=None)
    low, high = np.percentile(drawn, [2.5, 97.5])
    return Figure(value=value, low=float(min(low, value)), high=float(max(high, value)))
