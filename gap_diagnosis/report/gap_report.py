"""report.html of a diagnosis: the values that its template `gap_report.html` shows.

Verdict, gates, where, which, how far; frame, style and plots are those of the BLA report.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fjr_kit.page import render_page

from ..how_far.comparison import LevelComparison, compare
from ..investigation import Investigation
from ..model.misfit import MODEL_ERROR
from ..model.rig_model import Model
from ..outcome.verdict_words import HELD_OUT
from .gap_level_plots import level_plots
from .gap_plots import ranking_plot, sigma_plot, torque_plot, where_plot
from .gap_tables import candidates, distances, gap_table, gates, parameters, places
from .outcome_values import origin, outcome_plots, outcome_values


def stages(investigation: Investigation) -> dict[str, Model]:
    """Return the models to compare by name: nominal, refit, and explained if it has an effect."""
    attribution = investigation.attribution
    if attribution is None:
        return {}
    models = {"nominal": investigation.nominal, "refit": attribution.refit.model}
    if attribution.best.effects:
        models["explained"] = attribution.best.model
    return models


def render_gap_report(investigation: Investigation, provenance: Mapping[str, str]) -> str:
    """Return the whole report.

    Args:
        investigation: the diagnosis with its evidence.
        provenance: what made the report, by name (versions, command, date), in order.
    """
    recorded, diagnosis = investigation.recorded, investigation.diagnosis
    signals = {name: investigation.signals[name] for name in stages(investigation)}
    found = compare(recorded, signals, investigation.held)
    tested = diagnosis.reported_on == "records"
    return render_page(
        "gap_diagnosis.report",
        "gap_report.html",
        title=f"Sim-to-real gap of {recorded.source}",
        plots=_plots(investigation, found),
        provenance=_origin(investigation, provenance),
        lead=_lead(investigation),
        **outcome_values(diagnosis),
        gates=gates(investigation.gates),
        stages=len(stages(investigation)),
        tested=tested,
        model_error=MODEL_ERROR,
        noise_known=investigation.noise is not None,
        repeatable=recorded.repeatable,
        levels=[f"Level {one.level}, {one.amplitude_rad:.3g} rad" for one in found],
        bags=_bags(investigation, tested),
        **({} if investigation.attribution is None else _explained(investigation, found)),
    )


def _explained(investigation: Investigation, found: list[LevelComparison]) -> dict[str, Any]:
    """Return what only a report with simulations shows."""
    attribution, diagnosis = investigation.attribution, investigation.diagnosis
    assert attribution is not None
    return {
        "places": places(diagnosis),
        "explanations": len(attribution.candidates) + 1,
        "candidates": candidates(attribution, diagnosis, investigation.held_size),
        "parameters": parameters(attribution.best.space, diagnosis, investigation.nominal.plant),
        "gap": gap_table(diagnosis),
        "distances": distances(found),
    }


def _shown_maps(investigation: Investigation) -> dict[str, Any]:
    return {name: investigation.maps[name] for name in stages(investigation)}


def _plots(investigation: Investigation, found: list[LevelComparison]) -> dict[str, Any]:
    """Return all plots: over all levels, and of each level."""
    attribution, maps = investigation.attribution, _shown_maps(investigation)
    data = HELD_OUT[investigation.diagnosis.reported_on]
    overview = outcome_plots(investigation.diagnosis)
    levels: list[dict[str, Any]] = [dict(level_plots(level)) for level in found]
    if attribution is None:
        return {"overview": overview, "levels": levels}
    overview["ranking"] = ranking_plot(attribution, investigation.held_size, data)
    if investigation.noise is not None:
        overview["where-position"] = where_plot(maps, "position")
        overview["where-torque"] = where_plot(maps, "torque")
        for row, plots in enumerate(levels):
            plots["sigma"] = sigma_plot(maps, row, "position")
    before = investigation.residual_torques["refit"]
    after = investigation.residual_torques.get("explained")
    for level, plots in zip(found, levels, strict=True):
        plots["torque"] = torque_plot(before, after, level.level)
    return {"overview": overview, "levels": levels}


def _lead(investigation: Investigation) -> str:
    """Return what was recorded, in a sentence."""
    recorded, description = investigation.recorded, investigation.recorded.experiment
    return (
        f"{len(recorded.realizations)} bags: {len(recorded.levels)} levels, {description.periods} "
        f"periods of {description.samples_per_period / description.sample_rate_hz:g} s after "
        f"{description.transient_periods}, {description.sample_rate_hz:g} Hz."
    )


def _origin(investigation: Investigation, provenance: Mapping[str, str]) -> dict[str, str]:
    """Return where the numbers come from, by name."""
    recorded = investigation.recorded
    return origin(
        recorded.source, recorded.experiment.controller, investigation.nominal, provenance
    )


def _bags(investigation: Investigation, tested: bool) -> list[str]:
    """Return the names of all bags, with a word at those that were held out of every fit."""
    names = [r.name for r in investigation.recorded.realizations]
    held = {names[i] for i in investigation.held if tested}
    return [f"{name} (held out)" if name in held else name for name in names]
