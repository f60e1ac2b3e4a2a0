"""Diagnosis of an experiment of steady periods: gates before it, BLA and next experiment after it.

What is searched are the mean periods (`steady_runs`), by the search over records; whole runs where
the periods do not repeat, or where the loop cannot be simulated by the datasheet alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fjr_records.noise import even_lines_as_noise
from fjr_records.periodic import RecordedExperiment

from .fits.cell_fits import DRIFT
from .gates.bags_gate import bags_gate, friction_follows_time
from .gates.gate_checks import DISCRETISATION_LIMIT, GateReport, check_gates
from .how_far.bla_gap import bla_gap
from .how_far.steady_view import SteadyView
from .investigation import Fitted, Investigation, Order, investigate_runs
from .model.discretisation import discretisation_error
from .model.rig_model import Model
from .model.simulated_rig import Simulator
from .model.steady_runs import compared, steady_runs
from .next_experiment.choice import next_experiment
from .outcome.diagnosis import Diagnosis, NextExperiment
from .starts.catalogue import catalogue
from .verdict.judgement import stopped
from .which.drift_gate import drift_gate

UNSTEADY = (
    "The periods do not repeat as steady ones do, so the whole runs were searched for causes "
    "beside a remainder, which a change within a run is a part of."
)

NOTHING_NAMED = (
    "The whole runs, whose periods need not repeat, were searched all the same; nothing is named, "
    "and the errors are theirs."
)

DRIFTS = (
    "From run to run friction goes one way, so the whole runs were searched for causes beside a "
    "drift of friction."
)

ALONE = (
    "Each level has a single run, so no run is held out of the fits: they are compared block by "
    "block, some of which no fit has seen."
)


def investigate_periods(recorded: RecordedExperiment, order: Order) -> Investigation:
    """Diagnose an experiment of steady periods; what a gate forbids is not fitted.

    Raises:
        InputError: bags of different rigs, a controller of an unknown kind, or an effect of an
            unknown name.
    """
    nominal = Model.nominal(order.nominal)
    catalogue(nominal.plant, order.effects)
    order.progress("gates")
    noise = Simulator(recorded).noise(nominal)
    gates = check_gates(recorded, nominal, noise)
    view = SteadyView(recorded, gates, noise, tuple(range(len(recorded.realizations))), {})
    if gates.only_by_nominal:
        return _swinging(view, nominal, order)
    if gates.only_unsteady:
        return _unsteady(view, nominal, order)
    if gates.hint != "none":
        return _stopped(view, nominal)
    return _viewed(investigate_runs(steady_runs(recorded), order), view, order)


def _stopped(view: SteadyView, nominal: Model) -> Investigation:
    told = stopped("bad_data" if view.gates.hint == "none" else view.gates.hint, view.gates)
    return Investigation(view.recorded, nominal, told, None, view)


def _swinging(view: SteadyView, nominal: Model, order: Order) -> Investigation:
    """Diagnose whole runs whose loop, by the datasheet alone, cannot be simulated well.

    A loop that is damped by a friction which the datasheet lacks is one: it rings, or swings so
    that the recorded torque must drive the model. It stays bad data where nothing is found, or
    where the loop with what was found cannot be simulated any better.
    """
    whole = _whole(view.recorded, order)
    if whole.diagnosis.causes and whole.fitted is not None:
        error = discretisation_error(view.recorded, whole.fitted.found.best.model.smooth)
        if np.max(error) <= DISCRETISATION_LIMIT:
            return whole
    found = _stopped(view, nominal)
    return found if whole.diagnosis.causes else _beside_whole(found, whole)


def _unsteady(view: SteadyView, nominal: Model, order: Order) -> Investigation:
    """Diagnose whole runs of periods that do not repeat; where nothing is named, a drift may be."""
    whole = _beside_drift(view.recorded, order)
    drifts = whole.diagnosis.effects == [DRIFT]
    if whole.fitted is None or (whole.diagnosis.causes and not drifts):
        failed = [gate.sentence for gate in view.gates.failures]
        return _noted(whole, UNSTEADY, *failed, *view.gates.notes)
    order.progress("drift within runs")
    gate = drift_gate(whole.fitted.fitter, whole.fitted.found.steps[0])
    gates = replace(view.gates, gates=(*view.gates.gates, gate))
    found = _stopped(replace(view, gates=gates), nominal)
    if drifts or not gate.passed:
        steadier = [g for g in gates.gates if g.passed or g.hint != "bad_data" or not g.of_periods]
        told = stopped("nonstationary", replace(gates, gates=tuple(steadier)))
        found = replace(found, diagnosis=told)
    return _beside_whole(found, whole)


def _beside_whole(found: Investigation, whole: Investigation) -> Investigation:
    """Return what a gate has stopped with what a search of whole runs has left."""
    seen = {name: getattr(whole.diagnosis, name) for name in ("gap", "steps", "evidence")}
    said = [] if whole.diagnosis.causes else [NOTHING_NAMED]  # a drift alone is the verdict
    notes = [*found.diagnosis.notes, *said, *whole.diagnosis.notes]
    told = found.diagnosis.model_copy(update={**seen, "notes": notes})
    return replace(found, diagnosis=told)


def _beside_drift(recorded: RecordedExperiment, order: Order) -> Investigation:
    """Diagnose whole runs, a drift of friction being one of the causes if it goes with time."""
    whole = _whole(recorded, replace(order, drift=True))
    if whole.fitted is None:
        return whole
    evidence = whole.fitted.evidence
    without = [t.without for t in whole.fitted.tested if t.effect == DRIFT]
    if all(friction_follows_time(evidence, fit.variance, fit.model) for fit in without):
        return whole
    return _whole(recorded, order)


def _whole(recorded: RecordedExperiment, order: Order) -> Investigation:
    """Diagnose whole runs; they stay those of an experiment, whose grid and levels are known."""
    return replace(investigate_runs(recorded.as_records(), order), recorded=recorded)


def _viewed(found: Investigation, view: SteadyView, order: Order) -> Investigation:
    """Return what was found in mean periods with what only steady periods show.

    Where something is left and friction goes one way from run to run, whole runs tell more.
    """
    fitted, told = found.fitted, found.diagnosis
    assert fitted is not None
    recorded, drift = view.recorded, False
    if told.verdict in ("unexplained", "partly_explained"):
        best = fitted.found.best
        if friction_follows_time(fitted.evidence, best.variance, best.model):
            whole = _beside_drift(recorded, order)
            drift = DRIFT in whole.diagnosis.effects
            if drift and len(whole.diagnosis.effects) > 1:
                return _noted(whole, DRIFTS, *view.gates.notes)
    gate = bags_gate(told.bags, recorded)
    gates = GateReport((*view.gates.gates, gate), view.gates.notes)
    models = {
        "nominal": found.nominal,
        "refit": fitted.found.steps[0].model,
        "explained": fitted.found.best.model.smooth,
    }
    view = replace(view, gates=gates, held=_held(fitted, recorded), models=models)
    figures = bla_gap(recorded, view.held, view.signals, closes=bool(told.causes))
    seen = None if told.gap_figures is None else told.gap_figures.model_copy(update=figures)
    drifts = (drift or not gate.passed) and not told.causes
    beyond = view.maps["refit"].places()
    told = told.model_copy(
        update={
            "verdict": "nonstationary" if drifts else told.verdict,
            "gap_figures": seen,
            "where": beyond or view.maps["nominal"].places(),
            "next_experiment": _next(fitted, view, told),
            "notes": [
                *([gate.sentence] if not gate.passed else []),
                *([DRIFTS] if drift else []),
                *([ALONE] if told.reported_on == "blocks" and _alone(recorded) else []),
                *gates.notes,
                *told.notes,
            ],
        }
    )
    return replace(found, recorded=recorded, diagnosis=told, steady=view)


def _alone(recorded: RecordedExperiment) -> bool:
    """Tell whether each level has a single run."""
    return len(recorded.realizations) == len(recorded.levels)


def _held(fitted: Fitted, recorded: RecordedExperiment) -> tuple[int, ...]:
    """Return the realizations that no fit has seen; all, where every one was fitted in part."""
    evidence, shown = fitted.evidence, compared(recorded)
    fit = {evidence.parts[p].record for p in evidence.parts_for("fit")}
    unseen = tuple(shown[i] for i in range(len(shown)) if i not in fit)
    return unseen or tuple(range(len(recorded.realizations)))


def _next(fitted: Fitted, view: SteadyView, told: Diagnosis) -> NextExperiment | None:
    """Return the experiment that separates what is tied."""
    if told.verdict != "ambiguous":
        return None
    noise = (view.noise or even_lines_as_noise(view.recorded)).of_outputs(view.recorded)
    misfit = told.gap.explained.chi2_per_dof if told.gap.explained else None
    fits = [fitted.found.best, *fitted.tied]
    return next_experiment(view.recorded, noise, fits, max(misfit or 1.0, 1.0))


def _noted(found: Investigation, *notes: str) -> Investigation:
    told = found.diagnosis
    said = told.model_copy(update={"notes": [*notes, *told.notes]})
    return replace(found, diagnosis=said)
