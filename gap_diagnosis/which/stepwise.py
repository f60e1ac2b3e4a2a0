"""Causes beside a remainder: one after the other, each kept only if unseen parts call for it.

An effect is added if it raises the log-likelihood of nearly all parts that no fit has seen, by more
than these parts differ; an effect that the others can do without is taken out again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fjr_sim_node import effects as fx

from .cell_fits import CellFit, CellFitter

MOST_CAUSES = 4
_PROPOSED, _FITTED = 6, 4
LEAST_T = 3.0
LEAST_SHARE = 0.8
LEAST_GAIN = 0.01
TIED_T = 2.0
TIED_SHARE = 0.15

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Gain:
    """What one explanation gains over another on unseen parts.

    Attributes:
        mean: mean over parts of the log-likelihood gained per number.
        t: mean over its standard error.
        share: share of parts that gain.
    """

    mean: float
    t: float
    share: float

    @property
    def present(self) -> bool:
        """Whether it repeats."""
        return self.mean > LEAST_GAIN and self.t > LEAST_T and self.share >= LEAST_SHARE


def gain(after: CellFit, before: CellFit) -> Gain:
    """Return what `after` gains over `before` on the parts that select."""
    difference = after.scores - before.scores
    count = difference.size
    error = float(difference.std(ddof=1) / np.sqrt(count)) if count > 1 else float("inf")
    mean = float(difference.mean())
    t = mean / error if error > 0.0 else float("inf")
    return Gain(mean, t, float(np.mean(difference > 0.0)))


@dataclass
class Found:
    """What the stepwise search found.

    Attributes:
        steps: the refit, then one fit for each cause that was added.
        rivals: fits that were tried at each step, by the number of causes.
        alternatives: for each cause what does as well in its place.
        complete: whether the search ended by itself, not by its budget.
    """

    steps: list[CellFit]
    rivals: dict[int, list[CellFit]] = field(default_factory=dict)
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    gains: dict[str, Gain] = field(default_factory=dict)
    complete: bool = True

    @property
    def best(self) -> CellFit:
        """The last step."""
        return self.steps[-1]


class Stepwise:
    """The search over causes of one set of records."""

    def __init__(
        self,
        fitter: CellFitter,
        effects: Sequence[str],
        progress: Progress = lambda _: None,
        until: float = float("inf"),
    ) -> None:
        """Take what to search.

        Args:
            fitter: fits explanations.
            effects: identifiers to try.
            progress: told what is tried.
            until: instant of `time.monotonic` after which nothing new is begun.
        """
        self._fitter, self._effects, self._progress, self._until = fitter, effects, progress, until

    def run(self) -> Found:
        """Search forward, then drop what is not needed."""
        self._progress("refit of the base parameters")
        found = Found([self._fitter.refit()])
        while len(found.best.effects) < MOST_CAUSES:
            if self._over:
                found.complete = False
                break
            fits = self._extended(found.best)
            found.rivals[len(found.best.effects) + 1] = fits
            if not fits or not gain(fits[0], found.best).present:
                break
            found.gains[fits[0].effects[-1]] = gain(fits[0], found.best)
            found.alternatives[fits[0].effects[-1]] = _tied(fits, found.best)
            found.steps.append(fits[0])
        return found

    @property
    def _over(self) -> bool:
        return time.monotonic() > self._until

    def _extended(self, parent: CellFit) -> list[CellFit]:
        """Return the parent with each promising effect more, best on unseen parts first."""
        effects = [e for e in self._effects if e not in parent.effects]
        screened = {}
        for effect in effects:
            self._progress(f"{' + '.join((*parent.effects, effect))}, screened")
            screened[effect] = self._fitter.screening(parent, effect)
        hopeful = sorted(effects, key=lambda e: -screened[e].gain)[:_PROPOSED]
        proposals = {e: screened[e].proposals() for e in hopeful}
        ordered = sorted((e for e in hopeful if proposals[e]), key=lambda e: proposals[e][0][0])
        chosen = ordered[:_FITTED]
        alike = {p for e in chosen[:2] for p in fx.near_equivalents(e)} & set(effects)
        for effect in sorted(alike - set(chosen)):
            proposals.setdefault(effect, screened[effect].proposals())
            chosen.append(effect)
        fits = []
        for number, effect in enumerate(chosen, 1):
            self._progress(f"{' + '.join((*parent.effects, effect))} ({number} of {len(chosen)})")
            fit = self._fitter.add(parent, effect, proposals[effect])
            if fit is not None:
                fits.append(fit)
        return sorted(fits, key=lambda fit: -float(fit.scores.mean()))


def _tied(fits: Sequence[CellFit], parent: CellFit) -> list[str]:
    """Return the effects that unseen parts cannot tell from the first one."""
    first = gain(fits[0], parent).mean
    tied = []
    for fit in fits[1:]:
        behind = gain(fits[0], fit)
        if behind.mean < TIED_SHARE * first or behind.t < TIED_T:
            tied.append(fit.effects[-1])
    return tied
