"""Which of the causes that a search has found are kept: those that pass the tests of presence."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fjr_kit.telling import Progress
from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import gain, left_of
from ..how_far.ledger import Ledger
from ..outcome.cause import LEAST_PRESENT
from ..starts.seen_together import lacked
from ..which.equivalents import founded
from ..which.found import Found
from .judgement import FEWEST_PARTS
from .named_twice import twice
from .not_named import beyond_named, unsure, why_not
from .spoiling import spoils, unspoiled
from .taken_out import in_its_place, one_by_one, taken_out
from .tested_causes import Tested, causes_with_tests

_MAY_BE_UNSURE = 2
SURE = 0.8
"""How surely a cause beyond the two that gain most must be present."""
LEAST_BEARING = 0.2
"""How surely a cause must be there that stays only because sure ones fail without it."""
_TRIED = 3  # of the causes that fail, those that gain least, one of which others do not miss
_TOGETHER = 0.5  # of the squared error: causes that leave less of it are there, if not each surely


@dataclass(frozen=True)
class _Kept:
    """What is kept when some causes have gone.

    Attributes:
        steps: of the search, without these causes.
        tested: the causes of the last step; empty where they are not tested yet.
        notes: sentences on what has gone.
        doubted: how surely what has gone is present nevertheless.
        nearly_named: of that, what passed but is not sure.
    """

    steps: list[CellFit]
    tested: list[Tested]
    notes: list[str]
    doubted: dict[str, float] = field(default_factory=dict)
    nearly_named: frozenset[str] = frozenset()

    @property
    def best(self) -> CellFit:
        """The last step."""
        return self.steps[-1]

    def before(self, cause: Tested) -> list[CellFit]:
        """Return the steps that lack a cause."""
        return [fit for fit in self.steps if cause.effect not in fit.effects]

    def without(self, cause: Tested, passed: bool) -> _Kept:
        """Return the same with a cause that has gone said and doubted.

        Args:
            cause: it.
            passed: whether it passed all tests, but was not sure.
        """
        present = min(cause.present, 1.0 if passed else LEAST_PRESENT)
        return replace(
            self,
            notes=[*self.notes, *why_not(cause)],
            doubted={**self.doubted, cause.effect: present},
            nearly_named=self.nearly_named | ({cause.effect} if passed else set()),
        )


def kept(
    fitter: CellFitter,
    found: Found,
    scatter: Mapping[str, float],
    progress: Progress,
    names: Sequence[str],
    until: float = math.inf,
) -> tuple[Found, list[Tested]]:
    """Take out, one at a time, the causes that do not pass the tests beside the others.

    Another effect may do the same in its place: what it is a part of or nearly equivalent to, or
    what did nearly as well when it was chosen, before other causes were there.

    Of causes that fail that goes first which no other one misses, and of several that which gains
    least. A cause whose size alone is not certain may be blurred by another one: then that goes
    which gains least of all. Of those that pass, what names another one twice goes, and what is not
    sure, but for the two that gain most and for what others cannot do without: a cause that is sure
    is lost where the fit lacks what it acts beside. Friction that the datasheet lacks stays unless
    something is against it: without it all else would bend to do what it does. Where what has gone
    closes most of what is left, and repeats, only not each by itself, what others missed stays.

    Of causes that spoil the runs which report none is kept, and none at all where too little is
    held out.

    Args:
        fitter: of the search.
        found: what the search found.
        scatter: of parameters from run to run, see `moved_by_scatter`.
        progress: told what is tested.
        names: identifiers of what may be named.
        until: when nothing is tried in place of a cause any more (s, `time.monotonic`).

    Returns:
        the steps that are left, and the tests of their causes.
    """
    if len(fitter.evidence.parts_for("select")) < FEWEST_PARTS:
        return replace(found, steps=found.steps[:1]), []
    left = _Keeping(fitter, found, scatter, progress, names, until).run()
    steps, tested = left.steps, left.tested
    doubted = {e: p for e, p in left.doubted.items() if e not in left.best.effects}
    notes = left.notes + unsure({e: p for e, p in doubted.items() if e in left.nearly_named})
    notes += beyond_named(fitter, found.best, left.best, doubted)
    if tested and any(len(fit.effects) != count for count, fit in enumerate(steps)):
        steps = [steps[0], *one_by_one(fitter, left.best, tested)]
    return replace(found, steps=steps, notes=tuple(notes), doubted=doubted), _bearing(tested)


class _Keeping:
    """Takes causes out of what a search found; arguments as those of `kept`."""

    def __init__(
        self,
        fitter: CellFitter,
        found: Found,
        scatter: Mapping[str, float],
        progress: Progress,
        names: Sequence[str],
        until: float,
    ) -> None:
        self._fitter, self._found, self._scatter = fitter, found, scatter
        self._progress, self._names, self._until = progress, names, until
        self._lacking, self._ledger = lacked(fitter.nominal), Ledger(fitter.evidence)
        steps = list(found.steps)
        if steps[-1].effects:
            steps[-1] = fitter.settled(steps[-1])
        self._kept = _Kept(steps, [], list(found.notes))
        self._replaced: set[str] = set()
        self._bearing: set[str] = set()  # stay, since others fail without them...
        self._released: set[str] = set()  # ...until these have gone...
        self._restored: set[str] = set()  # ...unless the fit is much worse without all of them
        self._missed: list[tuple[str, _Kept]] = []

    def run(self) -> _Kept:
        """Return what is kept in the end."""
        while self._goes_on():
            pass
        return self._kept

    def _goes_on(self) -> bool:
        """Decide on one cause, or return False when nothing is to be decided any more."""
        kept = self._kept
        kept = self._kept = replace(kept, tested=kept.tested or self._tests_of(kept.best))
        causes, guessed = self._failing(kept.tested)
        if not causes:
            return self._brings_back() or self._spoils()
        cause, fewer, tests = self._least_missed(causes[: _TRIED if self._in_time else 1])
        if self._replaces(cause):
            return True
        against_little = cause.nearly_passes or cause.gains_beside_size
        nearly = against_little and cause.present >= LEAST_BEARING
        least = LEAST_PRESENT if cause.gains_beside_size and not guessed else SURE
        if (guessed or nearly) and _bears(kept.tested, tests, least):
            self._bearing.add(cause.effect)
            return True
        if cause.gains_more_often and _bears(kept.tested, tests, LEAST_PRESENT):
            self._missed.append((cause.effect, kept))
        left = kept.without(cause, passed=guessed and cause.passed)
        self._kept = replace(left, steps=fewer, tested=tests)
        return True

    @property
    def _in_time(self) -> bool:
        return time.monotonic() < self._until

    def _tests_of(self, fit: CellFit) -> list[Tested]:
        if not fit.effects:
            return []
        self._progress(f"tests of {' + '.join(fit.effects)}")
        return causes_with_tests(self._fitter, fit, self._kept.steps[0], self._scatter)

    def _failing(self, tested: Sequence[Tested]) -> tuple[list[Tested], bool]:
        """Return the causes that may go, in what order; and whether they pass but are not sure."""
        weak = {t.effect for t in tested if t.present < LEAST_BEARING}
        idle = weak & self._bearing - self._released - self._restored
        self._bearing, self._released = self._bearing - idle, self._released | idle
        fitter, names = self._fitter, self._names
        bases, frictions = _bases(fitter, tested, names), _lacked(self._lacking, tested)
        stay = {*self._bearing, *bases, *frictions}
        free, guessed = _without(stay, tested), False
        failed = [t for t in free if not t.passed]
        failed = failed or _without(stay, twice(fitter, self._kept.best, tested))
        if not failed:
            failed = _without(stay, _guesses(tested, self._lacking))
            guessed = bool(failed)
        causes = sorted(failed, key=lambda t: t.gain.mean)
        if any(t.passes_beside_size and not t.certain for t in failed):  # blurred by another one
            least = min(free, key=lambda t: t.gain.mean)
            causes = [least, *(t for t in causes if t is not least)]
        return causes, guessed

    def _least_missed(self, causes: Sequence[Tested]) -> tuple[Tested, list[CellFit], list[Tested]]:
        """Return the first cause without which no other fails, or the very first; steps, tests."""
        trials = []
        for cause in causes:
            fewer = taken_out(self._fitter, self._kept.before(cause), cause)
            trials.append((cause, fewer, self._tests_of(fewer[-1])))
            if not _bears(self._kept.tested, trials[-1][-1], LEAST_PRESENT):
                return trials[-1]
        return trials[0]

    def _replaces(self, cause: Tested) -> bool:
        """Put another effect in the place of a cause, if one does as well and passes."""
        kept = self._kept
        if not self._in_time or cause.effect in self._replaced or len(kept.best.effects) < 2:
            return False
        self._replaced.add(cause.effect)
        other = in_its_place(self._fitter, self._found, kept.best, cause, self._names)
        tested = [] if other is None else self._tests_of(other)
        if other is None or not tested[-1].passes_beside_size:
            return False
        self._replaced.add(other.effects[-1])
        self._kept = replace(kept, steps=[*kept.before(cause), other], tested=tested)
        return True

    def _brings_back(self) -> bool:
        """Go back to a cause that others missed, if all that has gone since belongs together."""
        for effect, whole in self._missed:
            repeats = gain(self._fitter, whole.best, self._kept.best).present
            if repeats and left_of(self._fitter, whole.best, self._kept.best) < _TOGETHER:
                self._bearing.add(effect)
                self._restored.add(effect)
                self._kept, self._missed = whole, []
                return True
        return False

    def _spoils(self) -> bool:
        """Take away the causes that spoil the runs which report, if any does."""
        kept = self._kept
        good = unspoiled(self._ledger, kept.steps)
        if len(good) == len(kept.steps):
            return False
        gone = [e for e in kept.best.effects if e not in good[-1].effects]
        self._kept = replace(kept, steps=good, tested=[], notes=[*kept.notes, spoils(gone)])
        return True


def _without(names: set[str], tested: Sequence[Tested]) -> list[Tested]:
    return [t for t in tested if t.effect not in names]


def _bases(fitter: CellFitter, tested: Sequence[Tested], names: Sequence[str]) -> set[str]:
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


def _bearing(tested: Sequence[Tested]) -> list[Tested]:
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


def _lacked(lacking: Collection[str], tested: Sequence[Tested]) -> set[str]:
    """Return the frictions that the datasheet lacks and every joint has, which may well be there.

    They are told with how sure they are; of few parts hardly any cause repeats surely.
    """
    there = [t for t in tested if t.known_though_it_drifts and t.present >= LEAST_BEARING]
    return {t.effect for t in there if t.effect in lacking}


def _bears(tested: Sequence[Tested], without: Sequence[Tested], least: float = SURE) -> bool:
    """Tell whether a cause bears others: these pass beside it, surely enough, and not without it.

    Args:
        tested: all causes.
        without: the others, tested without it.
        least: how surely the others must be present beside it.
    """
    beside = {t.effect for t in tested if t.passed and t.present >= least}
    return any(t.effect in beside and not t.passed for t in without)


def _guesses(tested: Sequence[Tested], lacking: Collection[str] = ()) -> list[Tested]:
    """Return the causes beyond the two that gain most of which one is not sure.

    Each step tries the whole catalogue on what is left; the more steps, the likelier one of them
    finds what resembles a part of the remainder. Friction that the datasheet lacks is no guess.
    """
    found = [t for t in tested if t.effect not in lacking]
    further = sorted(found, key=lambda t: -t.gain.mean)[_MAY_BE_UNSURE:]
    return [t for t in further if t.present < SURE]
