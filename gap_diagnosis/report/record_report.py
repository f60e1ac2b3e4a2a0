"""report.html of a diagnosis of records: the values that `record_report.html` shows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fjr_kit.page import render_page

from ..how_far.record_comparison import RecordComparison, compare_records
from ..model.rig_model import Model
from ..outcome.cause_words import TORQUE
from ..record_investigation import RecordInvestigation
from .gap_tables import parameters, tried
from .outcome_values import origin, outcome_plots, outcome_values
from .record_plots import record_level_plots, tried_plot


def step_models(investigation: RecordInvestigation) -> dict[str, Model]:
    """Return the model of each step by name: nominal, refit, then each cause that was added."""
    refit, *causes = investigation.found.steps
    models = {"nominal": investigation.nominal, "refit": refit.model}
    return models | {" + ".join(fit.effects): fit.model for fit in causes}


def compared(investigation: RecordInvestigation) -> list[RecordComparison]:
    """Return records and simulations beside each other, on the data that report."""
    evidence = investigation.evidence
    return compare_records(evidence, evidence.reporting, step_models(investigation))


def render_record_report(
    investigation: RecordInvestigation,
    found: list[RecordComparison],
    provenance: Mapping[str, str],
) -> str:
    """Return the whole report.

    Args:
        investigation: the diagnosis with its evidence.
        found: from `compared`.
        provenance: what made the report, by name (versions, command, date), in order.
    """
    evidence, diagnosis = investigation.evidence, investigation.diagnosis
    records = evidence.records
    best = investigation.found.best
    plots: dict[str, Any] = outcome_plots(diagnosis)
    plot = tried_plot(diagnosis.ranking)
    if plot is not None:
        plots["tried"] = plot
    known = evidence.noise.known
    return render_page(
        "gap_diagnosis.report",
        "record_report.html",
        title=f"Sim-to-real gap of {records.source}",
        plots={"overview": plots, "levels": [record_level_plots(one, known) for one in found]},
        provenance=origin(
            records.source, records.records[0].controller, investigation.nominal, provenance
        ),
        lead=_lead(investigation),
        **outcome_values(diagnosis),
        levels=[f"Level {one.level}, {one.name}" for one in found],
        noise_known=known,
        compared={"motion": "position", "torque": "torque"}[diagnosis.compared],
        tried=tried(diagnosis),
        parameters=parameters(best.space, diagnosis, investigation.nominal.plant),
        method=_method(investigation),
        windows_s=f"{2 * evidence.hop / records.sample_rate_hz:.3g}",
        bags=_bags(investigation),
    )


def _lead(investigation: RecordInvestigation) -> str:
    """Return what was recorded, in a sentence."""
    records = investigation.evidence.records
    count, levels = len(records.records), len(records.levels)
    samples = sum(r.samples for r in records.records)
    total = samples / records.sample_rate_hz
    kept = (
        f"averaged over {samples} equal ways"
        if investigation.evidence.slow
        else f"{records.sample_rate_hz:g} Hz"
    )
    return (
        f"{count} record{'s' if count > 1 else ''} of {levels} level{'s' if levels > 1 else ''}, "
        f"{total:.3g} s in all, {kept}."
    )


def _method(investigation: RecordInvestigation) -> str:
    if investigation.evidence.slow:
        return TORQUE
    simulator = investigation.evidence.simulator
    laws = simulator.loop.laws
    loop = "The closed loop is simulated from the true start of each record."
    observed = (
        "the recorded torque drives the model, and an observer of "
        f"{simulator.crossover_hz:.3g} Hz holds it to the recorded position."
    )
    if None not in laws:
        return loop
    if not any(laws):
        return f"{observed[0].upper()}{observed[1:]}"
    return f"{loop} In {laws.count(None)} of {len(laws)}, whose controller is not known, {observed}"


def _bags(investigation: RecordInvestigation) -> list[str]:
    """Return the names of all records, with a word for what each is used for."""
    evidence = investigation.evidence
    said = []
    for index, record in enumerate(evidence.records.records):
        uses = {part.purpose for part in evidence.parts if part.record == index}
        words = [word for word in ("fit", "select", "report") if word in uses]
        said.append(f"{record.name} (to {', '.join(words)})" if words else record.name)
    return said
