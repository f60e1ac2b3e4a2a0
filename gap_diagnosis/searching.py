"""The search for causes of one set of records, repeated where the torque acted otherwise.

What was found may tell that a recorded torque was held or not, or came late; then the search is
repeated with a torque that acts so, as long as there is time.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fjr_kit.telling import Progress

from .fits.cell_fits import CellFitter
from .fits.comparison import NOTHING_LEFT, CellFit
from .fits.gains import gain
from .how_far.ledger import Ledger
from .which.found import Found
from .which.late_torque import brought_to_its_time
from .which.stepwise import Stepwise
from .which.torque_timing import Timing

_SEARCHES = 2
"""With a torque that comes late and was brought forward: the first may mistake by how much."""


def at_its_time(
    timing: Timing, names: Sequence[str], progress: Progress, until: float
) -> tuple[Timing, Found]:
    """Search, and once more where what was found tells that the torque acted in another way.

    Args:
        timing: what the search begins with.
        names: identifiers of the effects to look for.
        progress: told what is tried.
        until: when nothing new is begun (s, `time.monotonic`).

    Returns:
        What the last search began with, and what it found.
    """
    found = _searched(timing, names, progress, until)
    if (other := timing.other_if_better(found.best, names)) is not None:
        timing = other
        progress(f"search with a torque that is {'' if timing.held else 'not '}held")
        found = _again(timing, found, names, progress, until)
    for _ in range(_SEARCHES):
        if time.monotonic() > until:
            break
        early = brought_to_its_time(timing, found.best, progress)
        if early is None:
            break
        timing = early
        found = _again(timing, found, names, progress, until)
    return timing, found


def stepwise(
    fitter: CellFitter, names: Sequence[str], progress: Progress, until: float
) -> Stepwise:
    """Return the search over causes, which is told how much of the motion is still missed."""
    missed = partial(misses, fitter, parts=fitter.select_parts)
    return Stepwise(fitter, names, progress, until, missed)


def misses(fitter: CellFitter, fit: CellFit, parts: Sequence[int] | None = None) -> float:
    """Return which share of the motion a fit misses on some parts, by default those that report."""
    return float(np.sqrt(np.mean(Ledger(fitter.evidence, parts).squares(fit.model))))


def _again(
    timing: Timing, before: Found, names: Sequence[str], progress: Progress, until: float
) -> Found:
    """Search anew; what was found before counts where it surely explains more.

    Or explains more at all, where there is no time to find as much again.
    """
    fitter, anew = timing.fitter, None
    if time.monotonic() < until:
        anew = _searched(timing, names, progress, until)
    ended = anew is not None and anew.complete
    steps = [timing.refit, *(fitter.taken_over(fit) for fit in before.steps[1:])]
    carried = replace(before, steps=steps, rivals={}, complete=ended)
    if anew is None:
        return carried
    more = gain(fitter, carried.best, anew.best)
    return carried if more.present or (not ended and more.mean > 0.0) else anew


def _searched(timing: Timing, names: Sequence[str], progress: Progress, until: float) -> Found:
    """Search from the refit; where a twist is known, also from what the motion alone has shown.

    What a transmission lacks may be most of the twist's error, beside which friction and load, that
    move both its ends, hardly show. What ends better counts, if that repeats on unseen parts.
    """
    fitter = timing.fitter
    found = stepwise(fitter, names, progress, until).run(timing.refit)
    seen = fitter.evidence.twist is not None and time.monotonic() < until
    if not seen or fitter.left_in_a_band(found.best) < NOTHING_LEFT:
        return found
    progress("by the motion alone")
    alone = CellFitter(fitter.evidence.of_motion_alone(), fitter.nominal, fitter.tolerance)
    shown = stepwise(alone, names, progress, until).run(alone.refit())
    progress("and then by the twist")
    steps = [timing.refit, *(fitter.taken_over(fit) for fit in shown.steps[1:])]
    begun = replace(shown, steps=steps, rivals={})
    other = stepwise(fitter, names, progress, until).go_on(begun)
    return other if gain(fitter, other.best, found.best).present else found
