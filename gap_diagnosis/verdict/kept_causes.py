"""Which of the causes that a search has found are kept: those that pass the tests of presence."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from fjr_kit.telling import Progress

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
from .not_named import unsure, why_not
from .passed_over import beside, passed_over
from .spoiling import spoils, unspoiled
from .staying import LEAST_BEARING, SURE, bases_of, bears, guesses, lacked_frictions, with_borne
from .taken_out import in_its_place, one_by_one, taken_out
from .tested_causes import Tested, causes_with_tests

_TRIED = 3  # of the causes that fail, those that gain least, one of which others do not miss
_TOGETHER = 0.5  # of the squared error: causes that leave less of it are there, if not each surely


@dataclass(frozen=True)
class _Kept:
    """What is kept when some causes have gone.

    Attributes:
        steps: of the search, without these causes.
        tested: the causes of the last step; empty where they are not tested yet.
        notes: sentences of the search, and on what spoils.
        why_not: sentences on what has gone, by its identifier.
        doubted: how surely what has gone is present nevertheless.
        nearly_named: of that, what passed but is not sure.
    """

    steps: list[CellFit]
    tested: list[Tested]
    notes: list[str]
    why_not: dict[str, list[str]] = field(default_factory=dict)
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
            why_not={**self.why_not, cause.effect: why_not(cause)},
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
    What was passed over for the sake of a cause that has gone is added if all pass beside it.

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
    keeping = _Keeping(fitter, found, scatter, progress, names, until)
    left = keeping.run()
    steps, tested = left.steps, left.tested
    doubted = {e: p for e, p in left.doubted.items() if e not in left.best.effects}
    notes = left.notes + [s for e in doubted for s in left.why_not.get(e, [])]
    notes += unsure({e: p for e, p in doubted.items() if e in left.nearly_named})
    if tested and any(len(fit.effects) != count for count, fit in enumerate(steps)):
        steps = [steps[0], *one_by_one(fitter, left.best, tested)]
    alike = {**found.alternatives, **keeping.taken_up}
    told = replace(found, steps=steps, notes=tuple(notes), doubted=doubted, alternatives=alike)
    return told, with_borne(tested)


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
        self._kept = _Kept(steps, [], list(found.notes), doubted=found.doubted)
        self._replaced: set[str] = set()
        self._bearing: set[str] = set()  # stay, since others fail without them...
        self._released: set[str] = set()  # ...until these have gone...
        self._restored: set[str] = set()  # ...unless the fit is much worse without all of them
        self._missed: list[tuple[str, _Kept]] = []
        self._passed_over: list[str] = []
        self._seen: set[frozenset[str]] = set()  # sets of causes that were tested
        self.taken_up: dict[str, list[str]] = {}  # of that, with what else was passed over

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
            return self._brings_back() or self._takes_up() or self._spoils()
        cause, fewer, tests = self._least_missed(causes[: _TRIED if self._in_time else 1])
        if self._replaces(cause):
            return True
        against_little = cause.nearly_passes or cause.gains_beside_size
        nearly = against_little and cause.present >= LEAST_BEARING
        least = LEAST_PRESENT if cause.gains_beside_size and not guessed else SURE
        if (guessed or nearly) and bears(kept.tested, tests, least):
            self._bearing.add(cause.effect)
            return True
        may_be = cause.gains_more_often and cause.present > 0.0
        if may_be and bears(kept.tested, tests, LEAST_PRESENT):
            self._missed.append((cause.effect, kept))
        self._passed_over += passed_over(self._fitter, self._found, kept.best, cause.effect)
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
        self._seen.add(frozenset(fit.effects))
        return causes_with_tests(self._fitter, fit, self._kept.steps[0], self._scatter)

    def _failing(self, tested: Sequence[Tested]) -> tuple[list[Tested], bool]:
        """Return the causes that may go, in what order; and whether they pass but are not sure."""
        weak = {t.effect for t in tested if t.present < LEAST_BEARING}
        idle = weak & self._bearing - self._released - self._restored
        self._bearing, self._released = self._bearing - idle, self._released | idle
        fitter, names = self._fitter, self._names
        bases, frictions = bases_of(fitter, tested, names), lacked_frictions(self._lacking, tested)
        stay = {*self._bearing, *bases, *frictions}
        free, guessed = _without(stay, tested), False
        failed = [t for t in free if not t.passed]
        failed = failed or _without(stay, twice(fitter, self._kept.best, tested))
        if not failed:
            failed = _without(stay, guesses(tested, self._lacking))
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
            if not bears(self._kept.tested, trials[-1][-1], LEAST_PRESENT):
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

    def _takes_up(self) -> bool:
        """Add what was passed over for the sake of a cause that has gone, if all pass beside it.

        Then what has gone may pass as well. No set of causes is tested again.
        """
        kept = self._kept
        gone = kept.doubted if self.taken_up else ()
        over = [e for e in dict.fromkeys((*self._passed_over, *gone)) if e in self._names]
        if not self.taken_up:
            over = [e for e in over if e not in kept.doubted]
        for effect in founded(over, kept.best.effects, self._fitter.nominal, self._names):
            if frozenset((*kept.best.effects, effect)) in self._seen or not self._in_time:
                continue
            fit = beside(self._fitter, kept.best, effect)
            tested = [] if fit is None else self._tests_of(fit)
            if fit is not None and all(t.passed for t in tested):
                self._kept = replace(kept, steps=[*kept.steps, fit], tested=tested)
                self.taken_up[effect] = over
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
