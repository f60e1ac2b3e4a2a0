"""Search and judgement by turns: the search goes on beside what is kept, if it never had that."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

from fjr_kit.telling import Progress

from .fits.cell_fits import CellFitter
from .fits.comparison import NOTHING_LEFT, CellFit
from .fits.gains import gain
from .searching import stepwise
from .verdict.contenders import tied_fits
from .verdict.kept_causes import kept
from .verdict.not_named import beyond_named
from .verdict.tested_causes import Tested
from .which.exchange import with_the_better_one
from .which.found import Found


def judged(
    fitter: CellFitter,
    found: Found,
    scatter: Mapping[str, float],
    names: Sequence[str],
    progress: Progress,
    until: float,
) -> tuple[Found, list[Tested], dict[str, list[CellFit]]]:
    """Return what is kept of what was found, its tests, and what does as well in place of each.

    Args:
        fitter: of the search.
        found: what the search found.
        scatter: of parameters from run to run, see `moved_by_scatter`.
        names: identifiers of what may be named.
        progress: told what is done.
        until: when nothing new is begun (s, `time.monotonic`).
    """
    left, tested = kept(fitter, found, scatter, progress, names, until)
    if time.monotonic() < until and _never_searched_beside(fitter, found, left):
        others = [name for name in names if name not in left.doubted]
        progress("search beside what is kept")
        more = stepwise(fitter, others, progress, until).go_on(_begun_with(left))
        if {*more.best.effects} != {*left.best.effects}:
            again, tests = kept(fitter, more, scatter, progress, others, until)
            if gain(fitter, again.best, left.best).present:
                found, left, tested = more, again, tests
    progress("what may stand in for a cause")
    tied = tied_fits(fitter, left, tested, names)
    if (anew := with_the_better_one(left, tied, fitter)) and time.monotonic() < until:
        progress(f"search with {anew.best.effects[-1]}")
        found = stepwise(fitter, names, progress, until).go_on(anew)
        left, tested = kept(fitter, found, scatter, progress, names, until)
        tied = tied_fits(fitter, left, tested, names)
    said = beyond_named(fitter, found.best, left.best, left.doubted)
    return replace(left, notes=(*left.notes, *said)), tested, tied


def _never_searched_beside(fitter: CellFitter, found: Found, left: Found) -> bool:
    """Tell whether a cause that has gone stood between what is kept and what else is there.

    What was added after that cause did well beside it, which says little of what does beside the
    others alone.
    """
    causes = {*left.best.effects}
    if not causes or fitter.left_in_a_band(left.best) < NOTHING_LEFT:
        return False
    return all(causes != {*fit.effects} for fit in found.steps)


def _begun_with(left: Found) -> Found:
    """Return what is kept as a search may go on from it, which changes these lists."""
    return replace(
        left,
        steps=[*left.steps],
        rivals={**left.rivals},
        alternatives={**left.alternatives},
    )
