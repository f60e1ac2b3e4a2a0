"""Notes that a reader of a diagnosis must see."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from fjr_records.driven import opposes, wrong_sign
from fjr_sim_node import effects as fx

from ..fits.comparison import NOTHING_LEFT
from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.twist import doubt_of, goes_along
from ..outcome.verdict_words import OUT_OF_TIME, ROUNDING, SWINGS_FREE, TWISTS
from ..starts.other_splits import YIELDS
from ..starts.search_space import Space
from ..which.found import Found
from ..which.presence import over_usual

MASSES_AND_SPRING = ("jm", "j", "k0")
_TOLD = (*MASSES_AND_SPRING, "fs", "fsm", "fv", "fvm")

_SHOWN = 3
"""Most runs of which the same is said."""

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


def of_records(evidence: Evidence, nominal: Mapping[str, float]) -> list[str]:
    """Return what a reader must know of the records and of how they were compared.

    Args:
        evidence: the records.
        nominal: datasheet values by the names of PLANT.
    """
    if evidence.slow:
        return []
    loop, player = evidence.player.loop, evidence.player
    notes = list(loop.notes)
    if not loop.commanded:  # a controller that makes the torque has its sign
        doubted = [(r.name, wrong_sign(r.torque, r.position)) for r in evidence.records.records]
        doubted += [
            (r.name, opposes(r.reference, r.position))
            for r in evidence.records.records
            if r.reference is not None
        ]
        notes += [f"{name}: {doubt}." for name, doubt in doubted if doubt is not None][:_SHOWN]
    if evidence.records.swings_free:
        notes.append(SWINGS_FREE)
    if evidence.twist is not None:
        notes.append(TWISTS)
    elif ratio := goes_along(evidence.records, nominal, evidence.hop):
        notes.append(doubt_of(ratio))
    step = evidence.noise.step_rad
    if step is not None and evidence.noise.std_rad <= 1.01 * step / math.sqrt(12.0):
        notes.append(
            f"The encoder counts in steps of {step:.3g} rad; what it rounds away counts as noise."
        )
    if not evidence.noise.known:
        notes.append(
            "The noise of the position is not known: no repeats, no standstill, and the highest "
            "lines are not flat; so nothing is said of significance."
        )
    if None in loop.laws:
        where = f" for {loop.laws.count(None)} of {len(loop.laws)} runs" if any(loop.laws) else ""
        notes.append(f"The loop is not known{where}, so there {player.driven}{player.loses}.")
    return notes


def of_fit(found: Found) -> list[str]:
    """Return what a reader must know of the search and of the fit in which it ended."""
    best = found.best
    notes = [*found.notes, *at_limits(best.space, best.solution.x, best.model.plant, _TOLD)]
    notes += [
        unusual(best.model, effect)
        for effect in best.effects
        if over_usual(best.model, effect) > 1.0
    ]
    if best.effects and not best.solution.converged:
        notes.append(
            f"The fit of {' + '.join(best.effects)} has not converged: the sizes, and their "
            "intervals, are those of where it was ended."
        )
    if not found.complete:
        notes.append(OUT_OF_TIME)
    return notes


def unusual(model: Model, effect: str) -> str:
    """Return what to think of an effect whose size is greater than machines have."""
    name = next(n for n in fx.EFFECTS[effect].size_names if math.isfinite(fx.parameter(n).usual))
    unit, most = fx.parameter(name).unit, fx.parameter(name).usual
    return (
        f"{effect} of {abs(model.effects[name]):.2g} {unit} is more than machines have (up to some "
        f"{most:g} {unit}): something that acts alike and is in no catalogue may stand behind it, "
        "such as an inertia or a gear ratio that changes with the angle."
    )


def at_limits(
    space: Space, x: np.ndarray, plant: Mapping[str, float], names: Collection[str]
) -> list[str]:
    """Return a note on parameters that ended as far from the datasheet as fits may go.

    Args:
        space: of the fit.
        x: where it ended.
        plant: the base parameters there.
        names: of the parameters to tell of.
    """
    told = []
    for (name, stated), ended in zip(space.nominal.items(), space.at_limits(x), strict=True):
        if name in names and ended:
            off = 100.0 * (plant[name] / stated - 1.0)
            told.append(f"{name} {abs(off):.0f} % {'above' if off > 0.0 else 'below'}")
    if not told:
        return []
    return [
        f"The fit ends as far from the datasheet as it may go ({', '.join(told)} it): check units "
        "of the datasheet and the factor of the torque, or give a greater --tolerance. Noise of "
        "the torque, or what no effect explains, may take a parameter there as well."
    ]
