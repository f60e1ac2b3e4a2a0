"""report.html of a diagnosis: verdict, gates, where, which, how far; one file that opens offline.

Frame, style and plots are those of the BLA report; every text that comes from bags is escaped.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from typing import Any

from bla_analyzer.page import Cell, asset, bullets, figure, page

from .comparison import LevelComparison, compare
from .diagnosis import Diagnosis
from .gap_level_plots import level_plots
from .gap_plots import ranking_plot, sigma_plot, torque_plot, where_plot
from .gap_tables import (
    candidates_table,
    distance_table,
    figures_table,
    gap_table,
    gates_table,
    parameters_table,
    places_table,
)
from .investigation import Investigation
from .misfit import MODEL_ERROR
from .model import Model
from .residual_torque import residual_torque
from .verdict_words import WORDS, headline, summaries


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
    found = compare(investigation.recorded, stages(investigation), investigation.held)
    body = "\n".join(
        [
            _top(investigation),
            _gates(investigation),
            _where(investigation),
            _which(investigation),
            _how_far(investigation, found),
            _next(investigation.diagnosis),
            asset("gap_method.html", "gap_diagnosis").format(model_error=f"{MODEL_ERROR:g}"),
            _origin(investigation, provenance),
        ]
    )
    source = investigation.recorded.source
    return page(f"Sim-to-real gap of {source}", body, _plots(investigation, found))


def _shown_maps(investigation: Investigation) -> dict[str, Any]:
    return {name: investigation.maps[name] for name in stages(investigation)}


def _plots(investigation: Investigation, found: list[LevelComparison]) -> dict[str, Any]:
    """Return all plots: over all levels, and of each level."""
    attribution, maps = investigation.attribution, _shown_maps(investigation)
    overview: dict[str, Any] = {}
    levels: list[dict[str, Any]] = [dict(level_plots(level)) for level in found]
    if attribution is None:
        return {"overview": overview, "levels": levels}
    overview["ranking"] = ranking_plot(attribution, investigation.held_size)
    if investigation.noise is not None:
        overview["where-position"] = where_plot(maps, "position")
        overview["where-torque"] = where_plot(maps, "torque")
        for row, plots in enumerate(levels):
            plots["sigma"] = sigma_plot(maps, row, "position")
    models = stages(investigation)
    recorded, noise = investigation.recorded, investigation.noise
    before = residual_torque(recorded, models["refit"], noise)
    explained = models.get("explained")
    after = None if explained is None else residual_torque(recorded, explained, noise)
    for level, plots in zip(found, levels, strict=True):
        plots["torque"] = torque_plot(before, after, level.level)
    return {"overview": overview, "levels": levels}


def _top(investigation: Investigation) -> str:
    """Return title, verdict in plain words, what to do, and what a reader must see."""
    diagnosis = investigation.diagnosis
    words = WORDS[diagnosis.verdict]
    good = diagnosis.verdict in ("no_gap", "parameters_only", "effect")
    recorded = investigation.recorded
    description = recorded.experiment
    lead = (
        f"{len(recorded.realizations)} bags: {len(recorded.levels)} levels, {description.periods} "
        f"periods of {description.samples_per_period / description.sample_rate_hz:g} s after "
        f"{description.transient_periods}, {description.sample_rate_hz:g} Hz."
    )
    closed = diagnosis.gap_closed
    share = f" Of what the refit left, {closed:.1%} is closed." if closed is not None else ""
    return f"""<header>
<h1>Sim-to-real gap of {escape(recorded.source)}</h1>
<p class="lead">{escape(lead)}</p>
<div class="verdict{"" if good else " bad"}">
<strong>{escape(headline(diagnosis))}</strong> (confidence {diagnosis.confidence:.0%})
<p>{escape(words.meaning)}{share} {escape(words.action)}</p>
{bullets(map(escape, summaries(diagnosis)))}</div>
<div class="findings"><p><b>When not to believe it.</b> {escape(words.doubt)}</p>
{bullets(map(escape, diagnosis.notes))}</div></header>"""


def _gates(investigation: Investigation) -> str:
    return (
        "<section>\n<h2>Is the record fit for a diagnosis?</h2>\n"
        f"{gates_table(investigation.gates)}</section>"
    )


def _where(investigation: Investigation) -> str:
    """Return the maps over all levels and the strongest places."""
    if investigation.attribution is None:
        return ""
    if investigation.noise is None:
        text = "<p>Noise is not known, so no line can be tested; see the plots of each level.</p>"
        return f"<section>\n<h2>Where</h2>\n{text}</section>"
    height = 130 * len(stages(investigation)) + 90
    caption = (
        "<b>Position.</b> Each row is a kind of line at one amplitude (rad); colour is the "
        "residual over noise. Grey is noise alone. The same reference is played to rig and "
        "simulation, so even distortion must agree; a gap at even lines is an effect that depends "
        "on position or direction."
    )
    plots = figure("where-position", height, caption)
    plots += figure("where-torque", height, "<b>Torque.</b> The same of the torque.")
    places = places_table(investigation.diagnosis)
    return f"<section>\n<h2>Where</h2>\n{plots}{places}</section>"


def _which(investigation: Investigation) -> str:
    """Return the ranking as a chart and as a table, and the parameters of the best."""
    if investigation.attribution is None:
        return ""
    count = len(investigation.attribution.candidates) + 1
    caption = (
        "<b>Held-out misfit</b> of each explanation, all base parameters refitted with it. "
        "1 is what noise alone leaves; what lies in the shaded zone is as good as the best."
    )
    chart = figure("ranking", 22 * count + 130, caption)
    return (
        f"<section>\n<h2>Which</h2>\n{chart}{candidates_table(investigation)}"
        f"{parameters_table(investigation)}</section>"
    )


def _how_far(investigation: Investigation, found: list[LevelComparison]) -> str:
    """Return the gap in numbers, and the plots of the chosen level."""
    buttons = "".join(
        f'<button type="button" data-level="{i}" aria-pressed="false">Level {level.level}, '
        f"{level.amplitude_rad:.3g} rad</button>"
        for i, level in enumerate(found)
    )
    choice = f'<nav class="levels" aria-label="Level">{buttons}</nav>\n' if len(found) > 1 else ""
    tables = ""
    if not investigation.recorded.repeatable:
        tables = (
            "<p>Controller or reference are not known, so the simulations are predictions that an "
            "observer holds to the recorded position: they come nearer to the rig than a free run "
            "would.</p>\n"
        )
    if investigation.attribution is not None:
        tables += gap_table(investigation.diagnosis) + figures_table(investigation.diagnosis)
        tables += distance_table(found)
    return f"<section>\n<h2>How far</h2>\n{tables}{choice}{LEVEL_FIGURES}</section>"


LEVEL_FIGURES = (
    figure(
        "bla",
        720,
        "<b>BLA</b> of rig and simulations, by the same method on the same lines. Below: how far "
        "each simulation is from the rig, beside the 95 % disc of the rig's BLA.",
    )
    + figure(
        "distortion",
        480,
        "<b>Distortion at the output</b>, corrected for the loop (Yc = Y \N{MINUS SIGN} G U). "
        "Points: rig; curves: simulations, mean power of neighbours.",
    )
    + figure(
        "time",
        560,
        "<b>One period</b> of a held-out realization, and what each simulation misses of it.",
    )
    + figure("sigma", 620, "<b>Residual over noise</b> at each line of the position.")
    + figure(
        "torque",
        760,
        "<b>Torque that the model lacks</b> on the motor, median over bins of velocity, position "
        "and deflection; dotted: moving backward. Flat at zero is no gap; a curve is a law that "
        "is missing.",
    )
)


def _next(diagnosis: Diagnosis) -> str:
    """Return the next experiment; nothing if none is called for."""
    proposed = diagnosis.next_experiment
    if proposed is None:
        return ""
    settings = bullets(f"{escape(k)}: {escape(str(v))}" for k, v in proposed.settings.items())
    separates = ", ".join(proposed.separates)
    return (
        f"<section>\n<h2>Next experiment</h2>\n<p><b>{escape(proposed.description)}</b> It tells "
        f"{escape(separates)} apart by {proposed.predicted_sigma:.3g} standard deviations of the "
        f"noise and takes {proposed.rig_time_s:.0f} s of rig time.</p>\n{settings}</section>"
    )


def _origin(investigation: Investigation, provenance: Mapping[str, str]) -> str:
    """Return where the numbers come from."""
    recorded = investigation.recorded
    nominal: list[Cell] = [f"{k} {v:.6g}" for k, v in investigation.nominal.plant.items()]
    pairs = {"folder": recorded.source, **provenance, "nominal": ", ".join(map(str, nominal))}
    pairs["controller"] = json.dumps(recorded.experiment.controller, default=str)
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>\n" for k, v in pairs.items())
    names = [r.name for r in recorded.realizations]
    held = {recorded.realizations[i].name for i in investigation.held}
    bags = bullets(f"{escape(n)}{' (held out)' if n in held else ''}" for n in names)
    return (
        f"<section>\n<h2>Provenance</h2>\n<dl>\n{items}</dl>\n"
        f"<details><summary>Bags ({len(names)})</summary>\n{bags}</details></section>"
    )
