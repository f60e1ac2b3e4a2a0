"""Notes that a reader of a diagnosis must see: failed gates, the remaining gap, untested claims."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from .gates.gate_checks import GateReport
from .outcome.diagnosis import Verdict
from .outcome.verdict_words import OUT_OF_TIME, ROUNDING
from .which.attribution import Attribution
from .which.confidence import UNTESTED
from .which.fits import Fit
from .which.search_space import Space

NOT_HELD_OUT = (
    "Nothing was held out, since every level has one realization: all figures are those of the fit "
    "itself, no prediction was tested, and the confidence is at most "
    f"{UNTESTED:.0%}; record two or more realizations of each level."
)


def notes(
    gates: GateReport,
    attribution: Attribution,
    verdict: Verdict,
    *,
    held_size: int,
    held_out: bool,
    nominal: Mapping[str, float],
    tolerance: float,
) -> list[str]:
    """Return all notes of a diagnosis, failed gates first.

    Args:
        gates: outcome of the gates.
        attribution: what the search found.
        verdict: what is said.
        held_size: degrees of freedom of the data that the fits are judged by.
        held_out: whether these are data that no fit has seen.
        nominal: datasheet values of the base parameters.
        tolerance: how far one may be off, relative.
    """
    found = [gate.sentence for gate in gates.failures] + list(gates.notes)
    if not held_out:
        found.append(NOT_HELD_OUT)
    if not attribution.complete:
        found.append(OUT_OF_TIME)
    failed = [" + ".join(fit.effects) for fit in attribution.candidates if not fit.converged]
    if failed:
        found.append(f"Dropped or not converged, so not ranked: {', '.join(failed)}.")
    if verdict == "unexplained":
        found.append(unexplained(attribution, held_size))
    if verdict == "parameters_only":
        found.append("A torque-constant error is equivalent to scaling all parameters.")
    named = verdict in ("effect", "ambiguous")
    if verdict == "parameters_only" or named:
        chosen = attribution.best if named else attribution.refit
        found += _beyond(chosen, nominal, tolerance)
    return found


def unexplained(attribution: Attribution, held_size: int) -> str:
    """Return what the best explanation and the refit leave, each misfit beside its own name.

    Args:
        attribution: what the search found.
        held_size: degrees of freedom of the data that the fits are judged by.
    """

    def left(fit: Fit) -> str:
        return f"{fit.held_chi2 / held_size:.1f}"

    refit = attribution.refit
    ranked = [fit for fit in (attribution.best, *attribution.candidates) if fit.effects]
    best = next((fit for fit in ranked if fit.converged), None)
    sentence = f"The refit leaves a misfit of {left(refit)} per degree of freedom"
    if best is not None:
        sentence += f", the best explanation, {' + '.join(best.effects)}, one of {left(best)}"
    return f"{sentence}; no effect of the catalogue accounts for all of it."


def _beyond(fit: Fit, nominal: Mapping[str, float], tolerance: float) -> list[str]:
    """Return a note on base parameters that moved beyond the tolerance, if most of them did."""
    values = fit.model.plant
    far = [n for n, v in values.items() if abs(v - nominal[n]) > tolerance * abs(nominal[n])]
    if len(far) <= len(values) // 2:
        return []
    return [
        f"{', '.join(far)} lie beyond the tolerance of the nominal file: look for a gain, "
        "of the torque or of the encoder (an eccentric one has one about its zero)."
    ]


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
