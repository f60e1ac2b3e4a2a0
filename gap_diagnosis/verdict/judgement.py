"""The judgement: causes that are present, the gap step by step, and the remainder."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fjr_records.driven import goes_backwards

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..fits.estimates import linear_estimates, standard_errors
from ..fits.gains import gain
from ..gates.gate_checks import GateReport
from ..how_far.ledger import Ledger
from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns
from ..outcome.cause import Cause, Doubted
from ..outcome.diagnosis import Bags, Candidate, Diagnosis, EvidenceKind, Step, Verdict
from ..outcome.gap_size import Estimate, Gap, GapFigures, Gaps
from ..starts.other_splits import YIELDS
from ..which.found import Found
from ..which.presence import (
    cell_estimates,
    where_it_acts,
)
from .notes import SCALED, beyond_tolerance
from .tested_causes import Tested

PLAIN = 4.0
"""Misfit below which the refit alone explains the gap, where no effect gains anything..."""
MOST_LEFT = 0.5
"""...and noise explains what it leaves, or it leaves less of the gap over noise than this."""
FORM = 0.01
"""Of the gap over noise, and of the motion: what the form of a right law may leave."""
WITHOUT_CAUSE: dict[Verdict, float] = {
    "no_gap": 0.95, "parameters_only": 0.95, "bad_data": 0.9, "nonstationary": 0.9,
}  # fmt: skip
"""How sure a verdict is that names nothing. Of the closed worlds of the blind checks 313 to 322 all
45 cases without a gap beyond parameters were told as such; of verdicts of a gate 10 of 11 were
right in the check of one rig. That nothing explains a gap is as likely wrong as right."""
FEWEST_PARTS = 6
"""Parts that select, below which the evidence is too thin for any name."""

THIN = (
    "The records are too short or too few to hold anything out of the fits, so nothing is named: "
    "record more or longer runs."
)

RINGS = (
    "The datasheet is that of a rigid axis, beside which a mass behind a spring is looked for "
    "without damping of its own. If fjr analyze shows a resonance, of a frame, a belt or a load, "
    "give the datasheet both inertias and the stiffness (jm, j, k0): its damping is fitted then."
)

_IF_WORSE = 0.75
"""Of its presence, what is left to a cause beside which unseen runs are surely missed by more."""


def stopped(verdict: Verdict, gates: GateReport) -> Diagnosis:
    """Return the diagnosis of an experiment that a gate forbids to fit."""
    nothing = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)
    said = [gate.sentence for gate in gates.failures] + list(gates.notes)
    return Diagnosis(verdict=verdict, confidence=WITHOUT_CAUSE[verdict], gap=nothing, notes=said)


def judge(
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
    verdict = verdict_of(causes, steps, evidence, thin)
    models = {"nominal": nominal, "refit": refit.model, "explained": best.model}
    figures = GapFigures(**ledger.figures(models, closes=bool(causes)))
    main = figures.position or figures.torque
    return Diagnosis(
        verdict=verdict,
        effects=[cause.effect for cause in causes],
        equivalent=[[cause.effect, *cause.others] for cause in causes],
        confidence=min((c.present for c in causes), default=WITHOUT_CAUSE.get(verdict, 0.5)),
        evidence=EvidenceKind(
            noise=evidence.noise.source,
            reported_on=evidence.reported_on,
            controller=evidence.simulator.loop.kind,
            excitation="periodic" if isinstance(evidence.records, SteadyRuns) else "record",
            compared="torque" if evidence.slow else "motion",
            axis="linear" if evidence.records.linear else "rotary",
        ),
        causes=causes,
        doubted=_doubted(found, causes),
        steps=steps,
        remainder=ledger.remainder(best.model, refit.model),
        gap=gaps_of(steps, ledger.noise()),
        gap_closed=None if main is None or main.closed is None else main.closed.value,
        gap_figures=figures,
        where=ledger.places_of_error(refit.model),
        bags=bags,
        ranking=_ranking(fitter, found),
        parameters=estimates,
        notes=[
            *([THIN] if thin else []),
            *([RINGS] if _may_ring(verdict, best) else []),
            *_on_parameters(verdict, best, fitter),
            *notes,
        ],
    )


def _may_ring(verdict: Verdict, best: CellFit) -> bool:
    """Tell whether a mass behind a spring, that was not found, may be what is left of a gap."""
    left = verdict in ("unexplained", "partly_explained")
    return left and best.model.rigid and YIELDS not in best.effects


def reproduced(fitter: CellFitter, fit: CellFit) -> float:
    """Return which share of the squared motion a fit reproduces where it is reported on.

    What it leaves may hide anything, so that no cause of it is surer. It is 1 where noise explains
    all that is left.
    """
    if fitter.misfit(fit) < PLAIN:
        return 1.0
    return max(1.0 - float(np.mean(Ledger(fitter.evidence).squares(fit.model))), 0.0)


def driven_backwards(evidence: Evidence) -> bool:
    """Tell whether the recorded torque, which no described law makes, has the wrong sign."""
    if evidence.slow or evidence.player.loop.commanded or evidence.records.swings_free:
        return False
    against = [goes_backwards(r.torque, r.position) for r in evidence.records.records]
    return sum(against) > len(against) / 2


def _on_parameters(verdict: Verdict, best: CellFit, fitter: CellFitter) -> list[str]:
    """Return what must be said of base parameters that stand in updated.yaml."""
    said = [SCALED] if verdict == "parameters_only" else []
    if verdict not in ("effect", "ambiguous", "parameters_only"):
        return said
    return [*said, *beyond_tolerance(best.model.plant, fitter.nominal, fitter.tolerance)]


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
    refit = found.steps[0].model
    without = tested.without.model if tested.without.effects else refit
    share = ledger.share(without, found.best.model, refit)
    worse = share.high is not None and share.high < 0.0
    return Cause(
        effect=tested.effect,
        others=alternatives.get(tested.effect, []),
        present=min(tested.present, reproduced(fitter, found.best)) * (_IF_WORSE if worse else 1.0),
        share=share,
        invariance_p=tested.invariance_p,
        where=ledger.places(moved),
        parameters=parameters,
    )


def _doubted(found: Found, causes: Sequence[Cause]) -> list[Doubted]:
    """Return what was found and is not named, nor in the set of a named cause."""
    said = {name for cause in causes for name in (cause.effect, *cause.others)}
    left = [Doubted(effect=e, present=p) for e, p in found.doubted.items() if e not in said]
    return sorted(left, key=lambda one: -one.present)


def gaps_of(steps: Sequence[Step], noise_floor: Gap | None) -> Gaps:
    """Return the gaps of the datasheet, of the refit and of all causes, from the steps."""
    ends = {"nominal": steps[0], "refit": steps[1], "explained": steps[-1]}
    gaps = {
        name: Gap(
            nrmse_position=step.nrmse_position,
            nrmse_torque=step.nrmse_torque,
            chi2_per_dof=step.chi2_per_dof,
        )
        for name, step in ends.items()
    }
    return Gaps(**gaps, noise_floor=noise_floor)


def verdict_of(
    causes: Sequence[Cause], steps: Sequence[Step], evidence: Evidence, thin: bool
) -> Verdict:
    """Return the verdict on causes and the gap from step to step.

    Args:
        causes: that are named.
        steps: nominal, refit, and with each cause.
        evidence: the runs.
        thin: whether too little is held out of the fits for any name.
    """
    known = evidence.noise.known
    if causes:
        if known and _nothing_left(steps[1], steps[-1]):
            return "ambiguous" if any(cause.others for cause in causes) else "effect"
        return "partly_explained"
    if known and not thin:
        if steps[0].chi2_per_dof is not None and steps[0].chi2_per_dof < NOTHING_LEFT:
            return "no_gap"
        if parameters_explain(steps[0].chi2_per_dof, steps[1].chi2_per_dof):
            return "parameters_only"
    return "unexplained"


def parameters_explain(nominal: float | None, refit: float | None) -> bool:
    """Tell whether a refit explains the gap of a datasheet that leaves more than noise.

    A small misfit is no proof of that: the datasheet's may be smaller.

    Args:
        nominal: misfit of the datasheet; None where its simulation diverges.
        refit: misfit of the refit.
    """
    if refit is None or refit >= PLAIN:
        return False
    gap = math.inf if nominal is None else nominal - 1.0
    return refit < NOTHING_LEFT or refit - 1.0 < MOST_LEFT * gap


def _nothing_left(refit: Step, best: Step) -> bool:
    """Tell whether noise, or what the laws' forms may be wrong by, explains all that is left.

    No law of a catalogue is quite the rig's: where noise is very low, a right one leaves more.
    """
    left, gap, missed = best.chi2_per_dof, refit.chi2_per_dof, best.nrmse_position
    if left is None or gap is None:
        return False
    if left < NOTHING_LEFT:
        return True
    return left - 1.0 < FORM * (gap - 1.0) and missed is not None and missed < FORM


def _ranking(fitter: CellFitter, found: Found) -> list[Candidate]:
    ranked = []
    for count, fits in found.rivals.items():
        parent = found.steps[min(count, len(found.steps)) - 1]
        for fit in fits:
            solution = fit.solution
            std = standard_errors(solution.jacobian, solution.residuals, fitter.groups)
            estimates = linear_estimates(fit, std)
            ranked.append(
                Candidate(
                    effects=list(fit.effects),
                    held_out_chi2=fitter.misfit(fit),
                    delta=gain(fitter, fit, parent).mean,
                    converged=solution.converged,
                    parameters={name: estimates[name] for name in fit.space.effects},
                )
            )
    return ranked
