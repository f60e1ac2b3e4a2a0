"""Notes that a reader of a diagnosis must see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..outcome.verdict_words import ROUNDING
from ..which.comparison import NOTHING_LEFT
from ..which.other_splits import YIELDS
from ..which.search_space import Space

SCALED = "A torque-constant error is equivalent to scaling all parameters."


def rounding(
    step: float, left: float, made: float, misfits: tuple[float, float], beside: Sequence[str] = ()
) -> str:
    """Return how a coarse encoder was judged: by the size of its errors, not sample by sample.

    Args:
        step: of the encoder, rad.
        left: rms error that all but the rounding leaves, over the rms of y.
        made: by how much rounding changes the simulation, over the rms of y.
        misfits: of what leaves it per degree of freedom, by noise alone and by noise and rounding.
        beside: effects that are named beside it.
    """
    rest = f"the refit with {' and '.join(beside)}" if beside else "the refit"
    return (
        f"{ROUNDING} is judged by its statistics: every recorded position is a multiple of "
        f"{step:.4g} rad. Rounding to that step changes the simulated position by {made:.2%} of "
        f"its rms, {rest} leaves {left:.2%}: {misfits[0]:.3g} times what noise explains, "
        f"{misfits[1]:.3g} times what noise and rounding explain."
    )


def yielding(effects: Sequence[str], misfit: float) -> list[str]:
    """Return what to do next where a transmission yields that the datasheet has rigid.

    Args:
        effects: that are named.
        misfit: that they leave, per degree of freedom; NaN where noise is not known.
    """
    if YIELDS not in effects or misfit < NOTHING_LEFT:
        return []
    return [
        "A transmission that yields may have backlash, hysteresis or damping, for which a rigid "
        "datasheet has no place: the same command with --nominal updated.yaml (and another --out) "
        "looks for them beside what was found."
    ]


def beyond_tolerance(
    plant: Mapping[str, float], nominal: Mapping[str, float], tolerance: float
) -> list[str]:
    """Return a note on base parameters that moved beyond the tolerance, if most of them did.

    Args:
        plant: the fitted base parameters.
        nominal: their datasheet values.
        tolerance: how far one may be off, relative.
    """
    far = [n for n, v in plant.items() if abs(v - nominal[n]) > tolerance * abs(nominal[n])]
    if len(far) <= len(plant) // 2:
        return []
    return [
        f"{', '.join(far)} lie beyond the tolerance of the nominal file: look for a gain, "
        "of the torque or of the encoder (an eccentric one has one about its zero)."
    ]


def at_limits(space: Space, x: np.ndarray, plant: Mapping[str, float]) -> list[str]:
    """Return a note on inertias and stiffness that ended as far from the datasheet as fits may go.

    Args:
        space: of the fit.
        x: where it ended.
        plant: the base parameters there.
    """
    told = []
    for (name, stated), ended in zip(space.nominal.items(), space.at_limits(x), strict=True):
        if name in ("jm", "j", "k0") and ended:
            off = 100.0 * (plant[name] / stated - 1.0)
            told.append(f"{name} {abs(off):.0f} % {'above' if off > 0.0 else 'below'}")
    if not told:
        return []
    return [
        f"The fit ends as far from the datasheet as it may go ({', '.join(told)} it): check units "
        "of the datasheet and the factor of the torque, or give a greater --tolerance."
    ]
