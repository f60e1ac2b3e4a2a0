"""One step of the search over causes of records: an explanation with each promising effect more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fjr_kit.telling import Progress
from fjr_sim_node import effects as fx

from ..fits.cell_fits import STICKING, CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..fits.gains import NEARLY_ALL, Gain, gain, left_of, likelihood, stands_for
from ..starts.screening import Proposal, Screening
from ..starts.seen_together import LACKED, lacked
from .equivalents import ONE_CAUSE, founded, holders, loaded, partners, plainness
from .friction_left import FRICTION
from .polish import MOST, MUCH_LESS, OUTDATED, Polish, ranked

_PROPOSED, _FITTED, _STARTS = (7, 5), (5, 3), (2, 1)
"""Effects that are tried at several sizes, those of them that are fitted, and from how many starts:
beside no cause yet, beside others."""
_AGAIN = 8  # effects that are screened beside a cause, and those that depend on others
_LEAST_HOPE = 5.0
"""What the best start of an effect must gain, or be predicted to, to be tried at more sizes."""
_START_LESS = 0.2  # of the greatest gain of a start: an effect whose best one gains less waits


class Extension:
    """Extends explanations of one set of records by one effect.

    Attributes:
        effects: identifiers to try.
    """

    def __init__(self, fitter: CellFitter, effects: Sequence[str], progress: Progress) -> None:
        """Take what to extend.

        Args:
            fitter: fits explanations.
            effects: identifiers to try.
            progress: told what is tried.
        """
        self.effects = effects
        self._fitter, self._progress = fitter, progress
        self._first: tuple[CellFit, dict[str, Screening]] | None = None

    def extended(
        self, parent: CellFit, steps: Sequence[CellFit], tried: Sequence[str] = ()
    ) -> list[CellFit]:
        """Return the parent with each promising effect more, best on unseen parts first.

        Args:
            parent: the explanation to extend.
            steps: of the search, the first one the fit of the base parameters alone.
            tried: effects that are left out, since they were tried.
        """
        names, nominal = self.effects, self._fitter.nominal
        twice = self._one_cause(parent, steps)
        of_one_law = {e for e in twice if not fx.EFFECTS[e].by_its_own_law}
        there = {*parent.effects, *tried, *of_one_law}
        effects = [e for e in names if e not in there]
        effects = founded(effects, parent.effects, nominal, names)
        if self._fitter.evidence.records.swings_free:
            effects = loaded(effects, parent.effects)
        screened = self.screened(parent, effects)
        later = bool(parent.effects)
        proposals = self._proposed(parent, screened, _PROPOSED[later])
        ordered = sorted((e for e in proposals if proposals[e]), key=lambda e: proposals[e][0][0])
        chosen = self._worth_a_fit(parent, proposals, ordered[: _FITTED[later]])
        held = holders(chosen[:2], names, parent.effects)
        held = founded(held, parent.effects, nominal, names)
        alike = {
            *partners(chosen[:2], set(effects), nominal),
            *held,
            *(lacked(nominal) & {*effects}),
        }
        for effect in sorted(alike - set(chosen)):
            if effect not in proposals:
                again = screened.get(effect) or self._fitter.screening(parent, effect)
                proposals[effect] = again.proposals()
            chosen.append(effect)
        fits: list[CellFit] = []
        for number, effect in enumerate(chosen, 1):
            self._progress(f"{' + '.join((*parent.effects, effect))} ({number} of {len(chosen)})")
            parts = [f for f in fits if f.effects[-1] in fx.EFFECTS[effect].contains]
            begun = [p for f in parts for p in self._fitter.from_part(parent, effect, f)]
            begun = sorted([*begun, *proposals[effect]], key=lambda p: p[0])
            fit = self._fitter.add(parent, effect, begun, _STARTS[later])
            if fit is not None:
                fits.append(fit)
        fits = self._halved(parent, effects, fits)
        if (sticking := self._sticking(parent, effects)) is not None:
            fits.append(sticking)
        if not parent.effects and not self._fitter.evidence.slow and set(LACKED) & set(effects):
            self._progress("friction and load together")
            fits += self._fitter.together(parent, self.effects)
        fits = [f for f in fits if f.effects[-1] not in twice or self._closes_the_rest(f, parent)]
        return Polish(self._fitter, self._progress).polished(self.ranked(fits, parent), parent)

    def _halved(
        self, parent: CellFit, effects: Sequence[str], fits: Sequence[CellFit]
    ) -> list[CellFit]:
        """Return fits with those of effects that a cause of the parent stands for in part.

        Of two fits of one explanation the better one.
        """
        chosen = {fit.effects: fit for fit in fits}
        for effect in effects:
            fit = self._fitter.halved(parent, effect)
            known = None if fit is None else chosen.get(fit.effects)
            if fit and (known is None or self._fitter.gains(fit, known).sum() > 0.0):
                chosen[fit.effects] = fit
        return list(chosen.values())

    def _sticking(self, parent: CellFit, effects: Sequence[str]) -> CellFit | None:
        """Return the parent with friction and its bristles, where there is no friction yet."""
        friction, bristles = STICKING
        names, nominal = self.effects, self._fitter.nominal
        if self._fitter.evidence.slow or friction not in effects or bristles not in names:
            return None
        if founded([bristles], parent.effects, nominal, names):
            return None
        self._progress(" + ".join((*parent.effects, *STICKING)))
        return self._fitter.sticking(parent)

    def tied(self, chosen: CellFit, fits: Sequence[CellFit], parent: CellFit) -> list[str]:
        """Return the effects that unseen parts cannot tell from the chosen one."""
        first = self.gain(chosen, parent).mean
        others = [f for f in fits if f is not chosen and f.effects[:-1] == chosen.effects[:-1]]
        return [f.effects[-1] for f in others if stands_for(self._fitter, f, chosen, first)]

    def chosen(self, fits: Sequence[CellFit], parent: CellFit) -> CellFit | None:
        """Return the best fit whose gain repeats, unless another one gains much more.

        What closes nearly all of the squared error goes before what gains more in many bands but
        leaves most of it: a constant torque, say, moves the angle over which others ripple.

        Of those that unseen parts cannot tell from it, one that holds no other as a limit case, the
        one with the fewest parameters, and then the commoner one. None of them is a part of it that
        lacks a law of friction which repeats: where a datasheet lacks all friction, one of two laws
        does most of what both do.
        """
        gains = [gain(self._fitter, fit, parent, fit.acts) for fit in fits]
        present = [fit for fit, found in zip(fits, gains, strict=True) if found.present]
        repeating = [
            fit
            for fit, found in zip(fits, gains, strict=True)
            if found.present and found.mean > MUCH_LESS * gains[0].mean
        ]
        if not repeating:
            return None
        left = [left_of(self._fitter, fit, parent) for fit in present]
        nearly_all = present[int(np.argmin(left))]
        if min(left) < NEARLY_ALL and left_of(self._fitter, repeating[0], parent) > MOST:
            return nearly_all
        first = repeating[0]
        gained = self.gain(first, parent).mean
        alike = [
            f
            for f in repeating
            if f is first
            or (stands_for(self._fitter, f, first, gained) and not self._lacks_friction(f, first))
        ]
        laws = [fit.effects for fit in alike]
        worth = [likelihood(self._fitter, fit, parent) for fit in alike]
        plain = [plainness(fit.effects, fit.space.effects, laws) for fit in alike]
        return alike[min(range(len(alike)), key=lambda k: (*plain[k], -worth[k]))]

    def _lacks_friction(self, fit: CellFit, richer: CellFit) -> bool:
        """Tell whether a fit lacks of a richer one a law of friction, which repeats there."""
        further = {*richer.effects} - {*fit.effects}
        if not {*fit.effects} < {*richer.effects} or not further & {*FRICTION}:
            return False
        return self.gain(richer, fit).surely_present

    def ranked(self, fits: Sequence[CellFit], parent: CellFit) -> list[CellFit]:
        """Return fits by what they gain over their parent, the best first."""
        return ranked(self._fitter, fits, parent)

    def gain(self, after: CellFit, before: CellFit) -> Gain:
        """Return what one fit gains over another on unseen parts."""
        return gain(self._fitter, after, before)

    def _proposed(
        self, parent: CellFit, screened: Mapping[str, Screening], most: int
    ) -> dict[str, list[Proposal]]:
        """Return starts of those that are screened best, so many at a time until one promises.

        Of friction that is small the linear prediction, by which they are ordered, says little.
        What gains and promises next to nothing, or much less than the best, is tried at no more
        sizes, unless it is friction that the datasheet lacks.
        """
        ordered = sorted(screened, key=lambda e: -screened[e].gain)
        begun, proposals = self._fitter.begun(parent), dict[str, list[Proposal]]()
        always = lacked(self._fitter.nominal)
        for first in range(0, len(ordered), most):
            batch = ordered[first : first + most]
            hope = {e: max(screened[e].gain, begun - screened[e].least()) for e in batch}
            enough = max(_START_LESS * max(hope.values()), _LEAST_HOPE)
            proposals |= {
                e: screened[e].proposals(scaled=hope[e] >= enough or e in always) for e in batch
            }
            if any(self._fitter.promises(parent, found) for found in proposals.values()):
                break
        return proposals

    def _worth_a_fit(
        self, parent: CellFit, proposals: Mapping[str, list[Proposal]], ordered: list[str]
    ) -> list[str]:
        """Return the effects whose starts gain enough beside the best start of all.

        What gains much less waits for the next step anyway.
        """
        gains = {e: self._fitter.begun(parent) - proposals[e][0][0] for e in ordered}
        most = max(gains.values(), default=0.0)
        return [e for e in ordered if gains[e] >= _START_LESS * most]

    def _closes_the_rest(self, fit: CellFit, parent: CellFit) -> bool:
        """Tell whether a fit closes nearly all of what its parent leaves over noise.

        Where the law of the parent's cause is a little another one than the catalogue's, a near
        equivalent mends a part of that; what mends nearly all is a cause of its own.
        """
        left, gap = self._fitter.misfit(fit) - 1.0, self._fitter.misfit(parent) - 1.0
        return left < NEARLY_ALL * gap

    def _one_cause(self, parent: CellFit, steps: Sequence[CellFit]) -> set[str]:
        """Return what may only name a cause of the parent twice; see `ONE_CAUSE`.

        A cause that was added to others had but what these left to close; of one that came
        together with what the datasheet lacks it is not known what it closed.
        """
        named = []
        for effect in parent.effects:
            before = next(fit for fit in reversed(steps) if effect not in fit.effects)
            came = next((fit for fit in steps if effect in fit.effects), parent)
            with_it = {*came.effects} - {*before.effects, effect}
            with_lacked = any(fx.EFFECTS[e].of_bare_plant for e in with_it)
            if not with_lacked and self._closes_nearly_all(parent, before):
                named.append(effect)
        return {*partners(named, set(self.effects), self._fitter.nominal)}

    def _closes_nearly_all(self, parent: CellFit, before: CellFit) -> bool:
        """Tell whether a fit leaves hardly anything of what another left.

        Not where a band is left in which it closes little: there another cause acts.
        """
        left, gap = self._fitter.misfit(parent) - 1.0, self._fitter.misfit(before) - 1.0
        if not left < ONE_CAUSE * gap:
            return False
        weights = self._fitter.weights
        over = [fit.left / weights.select_floor - 1.0 for fit in (parent, before)]
        bands = [
            np.sum(weights.counts * each, axis=0) / weights.counts.sum(axis=0) for each in over
        ]
        return not ((bands[0] > NOTHING_LEFT) & (bands[0] > MOST * bands[1])).any()

    def screened(self, parent: CellFit, effects: Sequence[str]) -> dict[str, Screening]:
        """Return screenings beside a fit: of all effects the first time, then of those that count.

        What a seed changes hardly depends on causes beside it, so the first changes say which
        effects may gain beside others; where a cause has closed most of the error, that is not so
        near any more, and all are screened anew. So are effects that depend on others.
        """
        anew = self._first is None or left_of(self._fitter, parent, self._first[0]) < OUTDATED
        if self._first is not None and not anew:
            before, screened = self._first
            promise = {
                e: self._fitter.promise(screened[e], before, parent)
                for e in effects
                if e in screened and not fx.EFFECTS[e].depends_on_others
            }
            best = sorted(promise, key=lambda e: -promise[e])[:_AGAIN]
            effects = [e for e in effects if e in best or e not in promise]
        found = {}
        for effect in effects:
            self._progress(f"{' + '.join((*parent.effects, effect))}, screened")
            found[effect] = self._fitter.screening(parent, effect)
        if anew:
            self._first = parent, found
        return found
