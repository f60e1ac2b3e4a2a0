"""Which of the causes that a search has found are kept: those that pass the tests of presence."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from fjr_kit.telling import Progress
from fjr_sim_node import effects as fx

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import NEARLY_ALL, gain, left_of, stands_for
from ..how_far.ledger import Ledger
from ..outcome.cause import LEAST_PRESENT
from ..starts.seen_together import lacked
from ..which.equivalents import founded, partners
from ..which.found import Found
from .judgement import FEWEST_PARTS
from .not_named import beyond_named, unsure, why_not
from .spoiling import spoils, unspoiled
from .tested_causes import Tested, causes_with_tests

_MAY_BE_UNSURE = 2
SURE = 0.8
"""How surely a cause beyond the two that gain most must be present."""
LEAST_BEARING = 0.2
"""How surely a cause must be there that stays only because sure ones fail without it."""
_TWICE = 0.15
"""Of what two near equivalents close: where each closes less beside the other, either alone does
nearly all, and both together are one cause whose law has another form than the catalogue's."""
_TRIED = 3  # of the causes that fail, those that gain least, one of which others do not miss
_RIVALS = 3  # that did best when a cause was chosen, one of which may take its place


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

    A cause whose size alone is not certain may be blurred by another one: then that goes which
    gains least of all. Of those that pass, what names another one twice goes, and what is not sure,
    but for the two that gain most and for what others cannot do without: a cause that is sure is
    lost where the fit lacks what it acts beside. Friction that the datasheet lacks stays unless
    something is against it: without it all else would bend to do what it does. Of causes that spoil
    the runs which report none is kept, and none at all where too little is held out.

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
    steps, notes = list(found.steps), list(found.notes)
    tested: list[Tested] = []
    if steps[-1].effects:
        steps[-1] = fitter.settled(steps[-1])
    lacking, ledger = lacked(fitter.nominal), Ledger(fitter.evidence)
    replaced: set[str] = set()
    bearing: set[str] = set()
    released: set[str] = set()
    doubted: dict[str, float] = {}
    nearly_named: set[str] = set()

    def tests_of(fit: CellFit) -> list[Tested]:
        progress(f"tests of {' + '.join(fit.effects)}")
        return causes_with_tests(fitter, fit, steps[0], scatter) if fit.effects else []

    def least_missed(causes: Sequence[Tested]) -> tuple[Tested, list[CellFit], list[Tested]]:
        """Return the first without which no other fails, or the very first; steps and tests."""
        trials = []
        for cause in causes:
            fewer = _taken_out(fitter, _before(steps, cause), cause)
            trials.append((cause, fewer, tests_of(fewer[-1])))
            if not _bears(tested, trials[-1][-1], LEAST_PRESENT):
                return trials[-1]
        return trials[0]

    while steps[-1].effects:
        tested = tested or tests_of(steps[-1])
        idle = {t.effect for t in tested if t.present < LEAST_BEARING} & bearing - released
        bearing, released = bearing - idle, released | idle  # what it bore may have gone
        stay = {*bearing, *_bases(fitter, tested, names), *_lacked(lacking, tested)}
        free = _without(stay, tested)
        failed = [t for t in free if not t.passed]
        failed = failed or _without(stay, _twice(fitter, steps[-1], tested))
        guessed = [] if failed else _without(stay, _guesses(tested, lacking))
        failed = failed or guessed
        if not failed:
            good = unspoiled(ledger, steps)
            if len(good) == len(steps):
                break
            gone = [e for e in steps[-1].effects if e not in good[-1].effects]
            notes.append(spoils(gone))
            steps, tested = good, []
            continue
        blurred = any(t.passes_beside_size and not t.certain for t in failed)
        least_first = sorted(free if blurred else failed, key=lambda t: t.gain.mean)
        in_time = time.monotonic() < until
        weakest, fewer, tests = least_missed(least_first[: _TRIED if in_time else 1])
        if in_time and weakest.effect not in replaced and len(steps[-1].effects) > 1:
            replaced.add(weakest.effect)
            other = _in_its_place(fitter, found, steps[-1], weakest, names)
            others = [] if other is None else tests_of(other)
            if other is not None and others[-1].passes_beside_size:
                replaced.add(other.effects[-1])
                steps, tested = [*_before(steps, weakest), other], others
                continue
        against_little = weakest.nearly_passes or weakest.gains_beside_size
        nearly = against_little and weakest.present >= LEAST_BEARING
        unsure_alone = weakest.gains_beside_size and not guessed
        least = LEAST_PRESENT if unsure_alone else SURE
        if (guessed or nearly) and _bears(tested, tests, least):
            bearing.add(weakest.effect)
            continue
        passed = bool(guessed) and weakest.passed
        doubted[weakest.effect] = min(weakest.present, 1.0 if passed else LEAST_PRESENT)
        nearly_named |= {weakest.effect} if passed else set()
        notes += [*why_not(weakest)]
        steps, tested = fewer, tests
    doubted = {e: p for e, p in doubted.items() if e not in steps[-1].effects}
    notes += unsure({e: p for e, p in doubted.items() if e in nearly_named})
    notes += beyond_named(fitter, found.best, steps[-1], doubted)
    if tested and any(len(fit.effects) != count for count, fit in enumerate(steps)):
        steps = [steps[0], *_one_by_one(fitter, steps[-1], tested)]
    return replace(found, steps=steps, notes=tuple(notes), doubted=doubted), _bearing(tested)


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


def _in_its_place(
    fitter: CellFitter, found: Found, best: CellFit, tested: Tested, names: Sequence[str]
) -> CellFit | None:
    """Return the best fit with another effect in the place of one; None if none does as well."""
    effect, without = tested.effect, tested.without
    chosen = [
        (gain(fitter, fit, found.steps[0]).mean, fit.effects[-1])
        for fits in found.rivals.values()
        for fit in fits
        if fit.effects[:-1] == best.effects[: best.effects.index(effect)]
    ]
    near = [*partners([effect], set(names), fitter.nominal), fx.EFFECTS[effect].modifies]
    near += [name for _, name in sorted(chosen, reverse=True)[:_RIVALS]]
    others = [e for e in dict.fromkeys(near) if e in names and e not in best.effects]
    fits = []
    for other in founded(others, without.effects, fitter.nominal, names):
        proposals = fitter.screening(without, other).proposals()
        fit = fitter.add(without, other, proposals) if proposals else None
        if fit is not None and gain(fitter, fit, without).present:
            fits.append(fitter.further(fit))
    if not fits:
        return None
    most = max(fits, key=lambda fit: gain(fitter, fit, without).mean)
    return most if stands_for(fitter, most, best, tested.gain.mean) else None


def _taken_out(fitter: CellFitter, before: Sequence[CellFit], weakest: Tested) -> list[CellFit]:
    """Return the steps without a cause.

    Args:
        fitter: of the search.
        before: the steps that lack it.
        weakest: the cause, with the last fit without it.
    """
    last = weakest.without
    if last.effects != before[-1].effects:
        return [*before, _begun_anew(fitter, last, before[-1])]
    better = fitter.gains(last, before[-1]).sum() > 0.0
    return [*before[:-1], last if better else before[-1]]


def _before(steps: Sequence[CellFit], cause: Tested) -> list[CellFit]:
    """Return the steps that lack a cause."""
    return [fit for fit in steps if cause.effect not in fit.effects]


def _bears(tested: Sequence[Tested], without: Sequence[Tested], least: float = SURE) -> bool:
    """Tell whether a cause bears others: these pass beside it, surely enough, and not without it.

    Args:
        tested: all causes.
        without: the others, tested without it.
        least: how surely the others must be present beside it.
    """
    beside = {t.effect for t in tested if t.passed and t.present >= least}
    return any(t.effect in beside and not t.passed for t in without)


def _begun_anew(fitter: CellFitter, fit: CellFit, before: CellFit) -> CellFit:
    """Return a fit that has lost a cause, or the same causes begun from an earlier step, if better.

    A cause that stood for another one leaves the fit where that other one did little.
    """
    added = [effect for effect in fit.effects if effect not in before.effects]
    if len(added) != 1:
        return fit
    proposals = fitter.screening(before, added[0]).proposals()
    anew = fitter.add(before, added[0], proposals) if proposals else None
    if anew is None:
        return fit
    anew = anew if anew.solution.converged else fitter.further(anew)
    return anew if fitter.gains(anew, fit).sum() > 0.0 else fit


def _one_by_one(fitter: CellFitter, fit: CellFit, tested: Sequence[Tested]) -> list[CellFit]:
    """Return a fit reached cause after cause, what gains most first: each has one cause more.

    What changes another cause comes after it, since before it does nothing.
    """
    worth = {t.effect: t.gain.mean for t in tested}
    bases = {effect: fx.EFFECTS[effect].modifies for effect in worth}
    worth |= {e: min(worth[e], worth[base]) for e, base in bases.items() if base in worth}
    order = sorted(worth, key=lambda e: (-worth[e], bases[e] in worth))
    without = {t.effect: t.without for t in tested}
    fits = [fit]
    for effect in order[:0:-1]:
        fewer = without[effect] if fits[0] is fit else fitter.without(fits[0], effect)
        fits.insert(0, fewer)
    return [replace(one, effects=tuple(order[:count])) for count, one in enumerate(fits, 1)]


def _twice(fitter: CellFitter, best: CellFit, tested: Sequence[Tested]) -> list[Tested]:
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


def _guesses(tested: Sequence[Tested], lacking: Collection[str] = ()) -> list[Tested]:
    """Return the causes beyond the two that gain most of which one is not sure.

    Each step tries the whole catalogue on what is left; the more steps, the likelier one of them
    finds what resembles a part of the remainder. Friction that the datasheet lacks is no guess.
    """
    found = [t for t in tested if t.effect not in lacking]
    further = sorted(found, key=lambda t: -t.gain.mean)[_MAY_BE_UNSURE:]
    return [t for t in further if t.present < SURE]
