"""The judgement: what gates, search and held-out gap say together, as a `Diagnosis`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from fjr_records.periodic import RecordedExperiment

from .gates.gate_checks import GateReport
from .how_far.held_out_gap import held_out_gap
from .how_far.steps import causes, evidence_kind, steps
from .model.simulated_rig import Signals
from .next_experiment.choice import next_experiment
from .notes import notes, rounding
from .outcome.diagnosis import Candidate, Diagnosis, Figure, Gaps, NextExperiment, Verdict
from .outcome.verdict_words import ROUNDING
from .where.residual_map import ResidualMap
from .which.attribution import Attribution
from .which.confidence import confidence
from .which.estimates import estimates, moved_by_scatter, relative_scatter
from .which.fits import Fit, Fitter
from .which.presence import at_its_bound
from .which.ripples_passed import doubt_of_shape, ripples_passed

NO_GAP = 2.0
"""Held-out misfit of the nominal model per degree of freedom below which there is no gap."""


def judge(
    recorded: RecordedExperiment,
    noise_std: np.ndarray,
    gates: GateReport,
    fitter: Fitter,
    attribution: Attribution,
    signals: Mapping[str, Signals],
    maps: Mapping[str, ResidualMap],
    *,
    held_out: bool,
    known_noise: bool,
    nominal_misfit: float,
    rounded: Signals | None,
) -> Diagnosis:
    """Return the diagnosis of an experiment whose search has ended.

    Args:
        recorded: the experiment.
        noise_std: `NoiseLevels.of_outputs`, or an upper bound of it.
        gates: outcome of all gates.
        fitter: of the search.
        attribution: what the search found.
        signals: simulated by each stage's model: nominal, refit, explained.
        maps: residual map of each stage.
        held_out: whether the data that the fits are judged by are such that no fit has seen.
        known_noise: whether the noise was seen between periods.
        nominal_misfit: of the held-out data per degree of freedom, by noise alone where the
            rounding of the encoder is named.
        rounded: simulated with the rounding of the encoder where that is named; None elsewhere.
    """
    best, refit = attribution.best, attribution.refit
    held, size = fitter.held.which, fitter.held.size
    misfits = {
        "nominal": nominal_misfit,
        "refit": refit.held_chi2 / size,
        "explained": best.held_chi2 / size,
    }
    verdict = _verdict(attribution, misfits, gates)
    named = list(best.effects) if verdict in ("effect", "ambiguous") else []
    shown = best if named or verdict == "parameters_only" else refit
    groups = fitter.train.groups()
    closes = bool(set(best.effects) - {ROUNDING})
    gaps, figures = held_out_gap(recorded, held, signals, misfits, closes)
    said = notes(
        gates, attribution, verdict, held_size=size, held_out=held_out, nominal=fitter.nominal,
        tolerance=fitter.tolerance,
    )  # fmt: skip
    if rounded is not None:
        before = "explained" if closes else "refit"
        left = figures.position.explained if closes else figures.position.refit
        by = attribution.by_noise_alone or 0.0, misfits["explained"]
        said.append(_rounding(recorded, held, best, (signals[before], rounded), by, left))
    closed, bags = figures.position.closed, gates.gates[-1].bags
    moved = moved_by_scatter(shown, fitter.train.runs(), relative_scatter(bags))
    doubts = {
        effect: doubt_of_shape(
            ripples_passed(best.model, effect, fitter.scales), at_its_bound(best, effect)
        )
        for effect in named
    }
    return _sure(
        Diagnosis(
            verdict=verdict,
            effects=named,
            equivalent=_equivalents(attribution) if named else [],
            confidence=0.0,
            evidence=evidence_kind(recorded, known_noise=known_noise, held_out=held_out),
            steps=steps(gaps, named),
            gap=gaps,
            gap_closed=None if closed is None else closed.value,
            gap_figures=figures,
            bags=bags,
            where=maps["refit" if misfits["refit"] > NO_GAP else "nominal"].places(),
            ranking=[_candidate(fit, size, refit, groups) for fit in attribution.candidates],
            parameters=estimates(shown, groups, moved),
            next_experiment=_next(recorded, noise_std, attribution, verdict),
            notes=said,
        ),
        doubts,
    )


def stopped(verdict: Verdict, gates: GateReport) -> Diagnosis:
    """Return the diagnosis of an experiment that a gate forbids to fit."""
    nothing = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)
    said = [gate.sentence for gate in gates.failures] + list(gates.notes)
    return _sure(Diagnosis(verdict=verdict, confidence=0.0, gap=nothing, notes=said))


def _sure(diagnosis: Diagnosis, doubts: Mapping[str, float] = MappingProxyType({})) -> Diagnosis:
    """Return a diagnosis with its confidence and causes, which follow from its other fields.

    Args:
        diagnosis: without them.
        doubts: factor of the presence of each named effect, see `doubt_of_shape`.
    """
    found = confidence(diagnosis)
    present = {effect: doubts.get(effect, 1.0) * found for effect in diagnosis.effects}
    told = {
        "confidence": min(present.values(), default=found),
        "causes": causes(diagnosis, present),
    }
    return diagnosis.model_copy(update=told)


def _next(
    recorded: RecordedExperiment,
    noise_std: np.ndarray,
    attribution: Attribution,
    verdict: Verdict,
) -> NextExperiment | None:
    """Return the experiment that separates what is tied.

    Where nothing explains the gap the whole runs are searched next, by which no experiment is
    chosen.
    """
    if verdict != "ambiguous":
        return None
    return next_experiment(recorded, noise_std, [attribution.best, *attribution.tied])


def _verdict(attribution: Attribution, misfits: Mapping[str, float], gates: GateReport) -> Verdict:
    if gates.hint != "none":
        return gates.hint
    best = attribution.best
    if best.effects:
        if not attribution.explained:
            return "unexplained"
        return "ambiguous" if attribution.tied else "effect"
    if not attribution.explained:
        return "unexplained"
    return "no_gap" if misfits["nominal"] < NO_GAP else "parameters_only"


def _rounding(
    recorded: RecordedExperiment,
    held: tuple[int, ...],
    best: Fit,
    simulated: tuple[Signals, Signals],
    misfits: tuple[float, float],
    left: Figure | None,
) -> str:
    """Return the note on a coarse encoder: what all else leaves beside what rounding makes."""
    changes = [
        np.mean((simulated[1][0][i] - simulated[0][0][i]) ** 2)
        / np.mean(recorded.realizations[i].kept(recorded.realizations[i].position).mean(0) ** 2)
        for i in held
    ]
    step = best.model.effects[f"{ROUNDING}.resolution_rad"]
    made = float(np.sqrt(np.mean(changes)))
    beside = [effect for effect in best.effects if effect != ROUNDING]
    return rounding(step, 0.0 if left is None else left.value, made, misfits, beside)


def _equivalents(attribution: Attribution) -> list[list[str]]:
    """Return for each effect of the best explanation what may stand in its place."""
    sets = []
    for effect in attribution.best.effects:
        rest = set(attribution.best.effects) - {effect}
        others = {
            name
            for fit in attribution.tied
            if rest <= set(fit.effects)
            for name in set(fit.effects) - rest
        }
        sets.append([effect, *sorted(others - {effect})])
    return sets


def _candidate(fit: Fit, size: int, refit: Fit, groups: np.ndarray) -> Candidate:
    found = estimates(fit, groups)
    return Candidate(
        effects=list(fit.effects),
        held_out_chi2=fit.held_chi2 / size if fit.converged else None,
        delta=refit.held_chi2 - fit.held_chi2 if fit.converged else None,
        converged=fit.converged,
        parameters={name: found[name] for name in fit.space.effects},
    )
