"""What one explanation gains over another on parts that no fit has seen, and whether it repeats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from .cell_fits import CellFitter
from .comparison import CellFit

LEAST_GAIN = 1.0
"""Least mean gain of log-likelihood of an unseen part (nats)."""
LEAST_SHARE = 0.75
"""Least share of the ranks that the parts which gain must hold."""
MOST_P = 0.05
"""Greatest p-value of the signed-rank test that parts gain as often and as much as they lose."""
TIED_SHARE = 0.15
"""An effect stands for another if it is behind by less than this share of the other's gain..."""
TOLD_APART = 2.0
"""How many times as much over noise an explanation must leave to be told from another for that."""
TIED_P = 0.1
"""...or by less than half of it and unseen parts do not show the difference."""


_FEW = 5  # parts: of fewer no rank test is sure
_COARSE = 8  # parts: of fewer a rank test is not sure as soon as one loses more than the least gain
_COUNTED = 5.0  # nats, the most that one of few parts counts
_NEUTRAL = 0.02  # of the greatest gain of a part: parts that change by less say nothing
NEARLY_ALL = 0.1
"""Of the squared error: what an explanation leaves that closes nearly all."""
_GROWN = 1.1  # of the squared error: more is left than before, beyond what a refit moves
_HELD = 0.02  # of the squared error of the part that holds most: less is not what is closed


@dataclass(frozen=True)
class Gain:
    """What one explanation gains over another on unseen parts.

    Attributes:
        mean: mean over unseen parts of the log-likelihood gained (nats).
        without_best: the same without the part that gains most.
        share: of the parts that gain in the sum of ranks, ranked by how much each changes: a part
            at rest shows little but where friction happened to stop the motion.
        p: p-value of these parts against no gain, see `_p_value`.
        but_one: whether all but one of a few parts gain so much that this one may lose.
    """

    mean: float
    without_best: float
    share: float
    p: float
    but_one: bool = False

    @property
    def present(self) -> bool:
        """Whether it repeats, and is not the sum by one part."""
        repeats = self.share >= LEAST_SHARE and (self.p <= MOST_P or self.but_one)
        return min(self.mean, 3.0 * self.without_best) > LEAST_GAIN and repeats

    @property
    def surely_present(self) -> bool:
        """Whether it repeats so surely that two explanations are told apart by it."""
        return self.present and self.p <= MOST_P


def gain(
    fitter: CellFitter, after: CellFit, before: CellFit, acts: np.ndarray | None = None
) -> Gain:
    """Return what `after` gains over `before` on the parts that select.

    What closes nearly all of the squared error must repeat where that is: a chirp shows a delay in
    its fast half alone, and what the fit makes worse where hardly any error was says little.

    Args:
        fitter: that made both.
        after: the fit that may be better.
        before: the other one.
        acts: bool (parts,), where it must repeat; None for all parts in which anything changes.
    """
    difference = fitter.gains(after, before)
    tells = np.abs(difference) >= _NEUTRAL * np.abs(difference).max() if acts is None else acts
    if left_of(fitter, after, before) < NEARLY_ALL:
        held = np.sum(fitter.weights.counts * before.left, axis=1)
        tells = tells & (held >= _HELD * held.max())
    telling = difference[tells]
    if difference.size < 2 or not telling.any():
        return Gain(float(difference.mean()), 0.0, 0.0, 1.0)
    most = int(np.argmax(difference))
    ranks = stats.rankdata(np.abs(telling))
    return Gain(
        float(difference.mean()),
        float(np.delete(difference, most).mean()),
        float(ranks[telling > 0.0].sum() / ranks.sum()),
        _p_value(telling),
        _but_one(telling),
    )


def fall(fitter: CellFitter, fit: CellFit, without: CellFit) -> float:
    """Return by how much twice the negative log-likelihood of the fitted parts falls.

    Args:
        fitter: that made both.
        fit: with an effect.
        without: the fit that lacks it.
    """
    ratio = np.log(without.variance / fit.variance)
    return max(float(fitter.weights.numbers(fit.variance) @ ratio), 0.0)


def likelihood(fitter: CellFitter, after: CellFit, before: CellFit) -> float:
    """Return the log-likelihood that one fit gains over another on all parts, fitted and unseen.

    Args:
        fitter: that made both.
        after: one of some fits that unseen parts cannot tell apart.
        before: the fit beside which all of them are seen.
    """
    return float(fitter.gains(after, before).sum()) + 0.5 * fall(fitter, after, before)


def left_of(fitter: CellFitter, after: CellFit, before: CellFit) -> float:
    """Return how much of the squared error on unseen parts one fit leaves of another's."""
    left = [float(np.sum(fitter.weights.counts * fit.left)) for fit in (after, before)]
    return left[0] / left[1]


def closed(fitter: CellFitter, after: CellFit, before: CellFit) -> float:
    """Return how much of what one fit leaves on unseen parts another closes, in a band or a level.

    In the band in which it gains most log-likelihood: a delay shows at high frequencies, where
    little of the motion is. Or in the level in which it gains most, the geometric mean over all
    bands: friction shows in small motions, where little of the error is; unless the error of all
    grows by it. Of the torque of a slow motion it may be all bands together.
    """
    weights = fitter.weights
    left = [np.sum(weights.counts * fit.left, axis=0) for fit in (before, after)]
    gained = weights.gained(after.left, before.left)
    most = int(np.argmax(gained.sum(axis=0)))
    in_band = float(1.0 - left[1][most] / left[0][most])
    all_left = left_of(fitter, after, before)
    if all_left < _GROWN:
        in_band = max(in_band, _closed_in_level(fitter, gained, after, before))
    return max(in_band, 1.0 - all_left) if fitter.evidence.slow else in_band


def beside_others(
    fitter: CellFitter, fit: CellFit, without: CellFit, others: Sequence[CellFit]
) -> float:
    """Return what a cause closes of the squared error over the most that another cause does.

    In the band in which it gains most log-likelihood, on unseen parts.

    Args:
        fitter: that made all fits.
        fit: with all causes.
        without: the fit that lacks the cause.
        others: the fits that each lack one of the others.

    Returns:
        Infinity where no other cause does anything there.
    """
    most = int(np.argmax(fitter.weights.gained(fit.left, without.left).sum(axis=0)))
    own, *rest = (
        float(np.sum((fitter.weights.counts * (each.left - fit.left))[:, most]))
        for each in (without, *others)
    )
    most_of_rest = max(rest, default=0.0)
    return own / most_of_rest if most_of_rest > 0.0 else math.inf


def _closed_in_level(
    fitter: CellFitter, gained: np.ndarray, after: CellFit, before: CellFit
) -> float:
    weights = fitter.weights
    most = int(np.argmax(np.bincount(weights.select_levels, gained.sum(axis=1))))
    own = weights.select_levels == most
    numbers = weights.compared(after.left, before.left)[own].sum(axis=0)
    left = [np.sum((weights.counts * fit.left)[own], axis=0) for fit in (before, after)]
    there = numbers > 0.0
    fallen = np.log(left[1][there] / left[0][there])
    return float(1.0 - np.exp(numbers[there] @ fallen / numbers[there].sum()))


def _p_value(gains: np.ndarray) -> float:
    """Return how often chance makes unseen parts gain as often and as much as they do.

    By Wilcoxon's signed-rank test. An effect that acts in few parts, such as a limit that is
    reached twice, cannot pass that however much these gain: all of them must gain then, and the
    likelihood ratio bounds the p-value.

    Args:
        gains: of log-likelihood, nats.
    """
    if gains.size >= _FEW:
        return float(stats.wilcoxon(gains, alternative="greater").pvalue)
    return _of_ratio(gains) if gains.min() > 0.0 else 1.0


def _but_one(gains: np.ndarray) -> bool:
    """Tell whether all but one of a few parts gain so much that the one does not count.

    A rank test of five to seven parts is not sure as soon as one of them loses more than another
    gains, as it may where friction happens to stop the motion.

    Args:
        gains: of log-likelihood, nats.
    """
    one_loses = _FEW <= gains.size < _COARSE and np.sum(gains <= 0.0) == 1
    return bool(one_loses) and _of_ratio(gains) <= MOST_P


def _of_ratio(gains: np.ndarray) -> float:
    """Return the p-value by the likelihood ratio on unseen parts.

    A part that gains adds a bounded amount, one that loses all of it, so the ratio is an e-value,
    whose inverse bounds the p-value (Vovk, Wang 2021, Annals of Statistics 49(3)).

    Args:
        gains: of log-likelihood, nats.
    """
    return math.exp(min(-float(np.minimum(gains, _COUNTED).sum()), 0.0))


def stands_for(
    fitter: CellFitter, other: CellFit, best: CellFit, first: float, near: bool = False
) -> bool:
    """Tell whether unseen parts cannot tell an explanation from a better one.

    They do where it is far behind, and where what it leaves over noise is twice as much in nearly
    all of them: of a cause that closes nearly all of a gap, every other one is little behind.

    Args:
        fitter: that made both.
        other: the explanation.
        best: the better one.
        first: mean gain of the better one's cause.
        near: whether it is a near equivalent, which must be told as surely as a cause is shown.
    """
    behind = gain(fitter, best, other)
    if near and not behind.surely_present:
        return True
    left, least = fitter.misfit(other) - 1.0, max(fitter.misfit(best) - 1.0, 1.0)
    if behind.surely_present and left > TOLD_APART * least:
        return False
    if behind.mean < TIED_SHARE * first:
        return True
    return behind.p > TIED_P and behind.mean < 0.5 * first
