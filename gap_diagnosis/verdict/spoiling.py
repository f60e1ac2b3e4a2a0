"""Causes that runs which no fit has seen speak against, however much they gain on others."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..fits.comparison import CellFit
from ..how_far.ledger import Ledger
from ..outcome.verdict_words import explanation

_SPOILS = 4.0
"""Times the squared error, and the misfit over noise: twice the error."""


def unspoiled(ledger: Ledger, steps: Sequence[CellFit]) -> list[CellFit]:
    """Return the steps up to the one that reproduces the runs best, where the last spoils them.

    The runs are those that report, which neither fitted nor selected the steps: chance does not
    make them worse by that much, so what the later causes stand for is not in them. These runs may
    only take causes away; of two explanations that do about as well they choose none.

    Args:
        ledger: of the parts that report.
        steps: the refit, then cause after cause.
    """
    found = [ledger.step(fit.model, None, "cause") for fit in steps]
    missed = [
        (one.nrmse_torque if one.nrmse_position is None else one.nrmse_position) or 0.0
        for one in found
    ]
    over_noise = [one.chi2_per_dof or math.nan for one in found]
    best = min(range(len(steps)), key=missed.__getitem__)
    grows = missed[-1] ** 2 > _SPOILS * missed[best] ** 2
    if grows and not over_noise[-1] <= _SPOILS * over_noise[best]:
        return list(steps[: best + 1])
    return list(steps)


def spoils(effects: Sequence[str]) -> str:
    """Return the note on causes that were taken away since they spoil what no fit has seen."""
    what = " and ".join(explanation([effect]) for effect in effects)
    return (
        f"With {what} the model errs more than twice as much on data that no fit has seen as "
        "without, so this is not named: runs may differ by something else, such as the loop, the "
        "load or what is switched on. Diagnose alike ones apart."
    )
