"""The judgement on records: causes that are present, the gap step by step, and the remainder."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from .how_far.record_ledger import Ledger
from .model.evidence import Evidence
from .model.rig_model import Model
from .outcome.diagnosis import (
    Bags,
    Candidate,
    Cause,
    Diagnosis,
    Estimate,
    EvidenceKind,
    Gap,
    Gaps,
    Step,
    Verdict,
)
from .tested_causes import Tested
from .which.cell_fits import CellFitter
from .which.found import Found
from .which.gains import gain
from .which.presence import (
    cell_estimates,
    where_it_acts,
)
from .which.stepwise import NOTHING_LEFT

PLAIN = 4.0
"""The same for the refit where no effect gains anything."""
FEWEST_PARTS = 6
"""Parts that select, below which the evidence is too thin for any name."""

THIN = (
    "The records are too short or too few to hold anything out of the fits, so nothing is named: "
    "record more or longer runs."
)


def judge_records(
    fitter: CellFitter,
    nominal: Model,
    found: Found,
    tested: Sequence[Tested],
    alternatives: dict[str, list[str]],
    bags: Bags | None,
    scatter: Mapping[str, float],
    notes: Sequence[str],
) -> Diagnosis:
    """Return the diagnosis of records whose search has ended.

    Args:
        fitter: of the search.
        nominal: the datasheet's model.
        found: the steps of the search; its last fit holds the causes that are kept.
        tested: these causes with their tests.
        alternatives: for each of them what does as well in its place.
        bags: how far parameters scatter from run to run; None where that cannot be seen.
        scatter: the same, or what is assumed instead, see `moved_by_scatter`.
        notes: sentences on the records.
    """
    evidence, best, refit = fitter.evidence, found.best, found.steps[0]
    ledger = Ledger(evidence)
    thin = len(evidence.parts_for("select")) < FEWEST_PARTS
    estimates = cell_estimates(best, fitter, scatter, {t.effect: t.without for t in tested})
    causes = (
        [] if thin else [_cause(t, fitter, ledger, found, alternatives, estimates) for t in tested]
    )
    causes.sort(key=lambda c: -(c.share.value if c.share else 0.0))
    steps = [
        ledger.step(nominal, None, "nominal"),
        ledger.step(refit.model, None, "refit"),
        *(ledger.step(fit.model, fit.effects[-1], "cause") for fit in found.steps[1:]),
    ]
    verdict = _verdict(causes, steps, evidence, thin)
    ends = {"nominal": steps[0], "refit": steps[1], "explained": steps[-1]}
    gaps = {
        name: Gap(
            nrmse_position=s.nrmse_position,
            nrmse_torque=s.nrmse_torque,
            chi2_per_dof=s.chi2_per_dof,
        )
        for name, s in ends.items()
    }
    return Diagnosis(
        verdict=verdict,
        effects=[cause.effect for cause in causes],
        equivalent=[[cause.effect, *cause.others] for cause in causes],
        confidence=min((c.present for c in causes), default=0.5),
        evidence=EvidenceKind(
            noise=evidence.noise.source,
            reported_on=evidence.reported_on,
            controller=evidence.simulator.loop.kind,
            excitation="record",
            compared="torque" if evidence.slow else "motion",
        ),
        causes=causes,
        steps=steps,
        remainder=ledger.remainder(best.model, refit.model),
        gap=Gaps(**gaps, noise_floor=ledger.noise()),
        gap_closed=_closed(ledger, refit.model, best.model) if causes else None,
        where=ledger.places_of_error(refit.model),
        bags=bags,
        ranking=_ranking(fitter, found),
        parameters=estimates,
        notes=[*([THIN] if thin else []), *notes],
    )


def _closed(ledger: Ledger, refit: Model, best: Model) -> float:
    return 1.0 - float(ledger.squares(best).sum() / max(ledger.squares(refit).sum(), 1e-300))


def _cause(
    tested: Tested,
    fitter: CellFitter,
    ledger: Ledger,
    found: Found,
    alternatives: dict[str, list[str]],
    estimates: dict[str, Estimate],
) -> Cause:
    parameters = {n: e for n, e in estimates.items() if n.startswith(f"{tested.effect}.")}
    moved = where_it_acts(fitter, found.best, tested.without, ledger.parts)
    return Cause(
        effect=tested.effect,
        others=alternatives.get(tested.effect, []),
        present=tested.present,
        share=ledger.share(tested.without.model, found.best.model, found.steps[0].model),
        invariance_p=tested.invariance_p,
        where=ledger.places(moved),
        parameters=parameters,
    )


def _verdict(
    causes: Sequence[Cause], steps: Sequence[Step], evidence: Evidence, thin: bool
) -> Verdict:
    known = evidence.noise.known
    left = steps[-1].chi2_per_dof
    if causes:
        if known and left is not None and left < NOTHING_LEFT:
            return "ambiguous" if any(cause.others for cause in causes) else "effect"
        return "partly_explained"
    if known and not thin:
        if steps[0].chi2_per_dof is not None and steps[0].chi2_per_dof < NOTHING_LEFT:
            return "no_gap"
        if steps[1].chi2_per_dof is not None and steps[1].chi2_per_dof < PLAIN:
            return "parameters_only"
    return "unexplained"


def _ranking(fitter: CellFitter, found: Found) -> list[Candidate]:
    ranked = []
    for count, fits in found.rivals.items():
        parent = found.steps[min(count, len(found.steps)) - 1]
        for fit in fits:
            ranked.append(
                Candidate(
                    effects=list(fit.effects),
                    held_out_chi2=None,
                    delta=gain(fitter, fit, parent).mean,
                    converged=fit.solution.converged,
                    parameters={
                        n: {"value": fit.model.effects[n], "low": math.nan, "high": math.nan}
                        for n in fit.space.effects
                    },
                )
            )
    return ranked
