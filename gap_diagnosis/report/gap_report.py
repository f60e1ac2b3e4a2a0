"""report.html of a diagnosis: the values that its template `gap_report.html` shows.

Verdict, gates, where, which, how far; frame, style and plots are those of the BLA report.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fjr_interface.linear_axis import as_linear
from fjr_kit.page import render_page

from ..how_far.bla_comparison import compare
from ..how_far.run_comparison import RunComparison, compare_runs
from ..how_far.steady_view import SteadyView
from ..investigation import Fitted, Investigation
from ..outcome.cause_words import TORQUE
from ..outcome.diagnosis import Diagnosis
from .gap_level_plots import level_plots
from .gap_plots import sigma_plot, torque_plot, where_plot
from .gap_tables import distances, gap_table, gates, parameters, places, tried
from .outcome_values import origin, outcome_plots, outcome_values
from .run_plots import run_level_plots, tried_plot
from .telltales import telltales

Plots = dict[str, Any]
_ABSENT: Mapping[str, Any] = {
    "fitted": False, "noise_known": False, "tried": [], "parameters": [], "method": "",
    "windows_s": "", "steady": False, "gates": [], "maps": False, "stages": 0, "repeatable": True,
    "places": [], "distances": None, "telltales": [], "observer_hz": "",
}  # fmt: skip
"""What the template shows of runs that were not fitted, and of records."""


def compared(investigation: Investigation) -> list[RunComparison]:
    """Return runs and simulations beside each other, on the data that report."""
    fitted = investigation.fitted
    if fitted is None:
        return []
    models = {"nominal": investigation.nominal, **fitted.models}
    return compare_runs(fitted.evidence, fitted.evidence.reporting, models)


def render_gap_report(
    investigation: Investigation, found: Sequence[RunComparison], provenance: Mapping[str, str]
) -> str:
    """Return the whole report.

    Args:
        investigation: the diagnosis with its evidence.
        found: from `compared`.
        provenance: what made the report, by name (versions, command, date), in order.
    """
    recorded, diagnosis = investigation.recorded, investigation.diagnosis
    steady, fitted = investigation.steady, investigation.fitted
    overview, levels = outcome_plots(diagnosis), [f"Level {one.level}, {one.name}" for one in found]
    by_level: list[Plots] = [{} for _ in found]
    values = dict(_ABSENT)
    if fitted is not None:
        known = fitted.evidence.noise.known
        by_level = [run_level_plots(one, known) for one in found]
        plot = tried_plot(diagnosis.ranking)
        overview |= {} if plot is None else {"tried": plot}
        values["telltales"], shown = telltales(investigation)
        overview |= shown
        values |= _fitted_values(investigation, fitted)
    if steady is not None:
        by_level, levels, shown = _steady_plots(steady, by_level, levels)
        overview |= shown
        values |= _steady_values(steady, diagnosis)
    plots = {"overview": overview, "levels": by_level}
    if diagnosis.linear:
        plots, levels, values = (_linear(shown) for shown in (plots, levels, values))
    return render_page(
        "gap_diagnosis.report",
        "gap_report.html",
        title=f"Sim-to-real gap of {recorded.source}",
        plots=plots,
        provenance=origin(
            recorded.source, _controller(investigation), investigation.nominal, provenance
        ),
        lead=_lead(investigation),
        **outcome_values(diagnosis),
        levels=levels,
        compared={"motion": "position", "torque": "torque"}[diagnosis.compared],
        gap=gap_table(diagnosis),
        bags=_bags(investigation),
        **values,
    )


def _linear(shown: Any) -> Any:
    """Return what is shown with all units in its texts as those of a linear axis."""
    if isinstance(shown, str):
        return as_linear(shown)
    if isinstance(shown, Mapping):
        return {key: _linear(each) for key, each in shown.items()}
    return [_linear(each) for each in shown] if isinstance(shown, list) else shown


def _fitted_values(investigation: Investigation, fitted: Fitted) -> dict[str, Any]:
    """Return what only a report with simulations shows."""
    evidence, diagnosis = fitted.evidence, investigation.diagnosis
    space = fitted.found.best.space
    return {
        "fitted": True,
        "noise_known": evidence.noise.known,
        "tried": tried(diagnosis),
        "parameters": parameters(space, diagnosis, investigation.nominal.plant),
        "method": _method(fitted),
        "observer_hz": "" if evidence.slow else f"{evidence.simulator.crossover_hz:.3g}",
        "windows_s": f"{2 * evidence.hop / evidence.records.sample_rate_hz:.3g}",
    }


def _steady_plots(
    view: SteadyView, by_level: list[Plots], levels: list[str]
) -> tuple[list[Plots], list[str], Plots]:
    """Return plots by level with those of steady periods, names of levels, plots of all levels."""
    signals = view.signals if view.models else {}
    found = compare(view.recorded, signals, view.held)
    if not view.models:
        by_level = [{} for _ in found]
    levels = [f"Level {one.level}, {one.amplitude_rad:.3g} rad" for one in found]
    for plots, level in zip(by_level, found, strict=True):
        plots |= level_plots(level)
        if view.models:
            plots.pop("time")  # the runs that were fitted are shown over time already
    if not view.models:
        return by_level, levels, {}
    before, after = view.residual_torques["refit"], view.residual_torques["explained"]
    for row, (plots, level) in enumerate(zip(by_level, found, strict=True)):
        plots.pop("run-torque", None)
        plots["torque"] = torque_plot(before, after, level.level)
        if view.noise is not None:
            plots["sigma"] = sigma_plot(view.maps, row, "position")
    overview: Plots = {}
    if view.noise is not None:
        overview["where-position"] = where_plot(view.maps, "position")
        overview["where-torque"] = where_plot(view.maps, "torque")
    return by_level, levels, overview


def _steady_values(view: SteadyView, diagnosis: Diagnosis) -> dict[str, Any]:
    """Return what only a report of steady periods shows."""
    signals = view.signals if view.models else {}
    return {
        "gates": gates(view.gates),
        "steady": True,
        "maps": bool(view.models) and view.noise is not None,
        "stages": len(view.models),
        "repeatable": view.recorded.repeatable,
        "places": places(diagnosis) if view.models else [],
        "distances": distances(compare(view.recorded, signals, view.held)) if signals else None,
    }


def _controller(investigation: Investigation) -> dict | None:
    if investigation.steady is not None:
        return investigation.steady.recorded.experiment.controller
    assert investigation.fitted is not None
    return investigation.fitted.evidence.records.records[0].controller


def _lead(investigation: Investigation) -> str:
    """Return what was recorded, in a sentence."""
    if investigation.steady is not None:
        recorded = investigation.steady.recorded
        description = recorded.experiment
        period_s = description.samples_per_period / description.sample_rate_hz
        return (
            f"{len(recorded.realizations)} bags: {len(recorded.levels)} levels, "
            f"{description.periods} periods of {period_s:g} s after "
            f"{description.transient_periods}, {description.sample_rate_hz:g} Hz."
        )
    assert investigation.fitted is not None
    evidence = investigation.fitted.evidence
    records = evidence.records
    count, levels = len(records.records), len(records.levels)
    samples = sum(r.samples for r in records.records)
    total = samples / records.sample_rate_hz
    kept = (
        f"averaged over {samples} equal ways" if evidence.slow else f"{records.sample_rate_hz:g} Hz"
    )
    return (
        f"{count} record{'s' if count > 1 else ''} of {levels} level{'s' if levels > 1 else ''}, "
        f"{total:.3g} s in all, {kept}."
    )


def _method(fitted: Fitted) -> str:
    evidence = fitted.evidence
    if evidence.slow:
        return TORQUE
    simulator = evidence.player
    laws = simulator.loop.laws
    loop = "The closed loop is simulated from the true start of each run."
    observed = f"{simulator.driven}."
    if None not in laws:
        return loop
    if not any(laws):
        return f"{observed[0].upper()}{observed[1:]}"
    return f"{loop} In {laws.count(None)} of {len(laws)}, whose controller is not known, {observed}"


def _bags(investigation: Investigation) -> list[str]:
    """Return the names of all runs, with a word for what each is used for."""
    names = [r.name for r in investigation.runs]
    if investigation.fitted is None:
        return names
    evidence = investigation.fitted.evidence
    said = dict.fromkeys(names, "")
    for index, record in enumerate(evidence.records.records):
        uses = {part.purpose for part in evidence.parts if part.record == index}
        words = [word for word in ("fit", "select", "report") if word in uses]
        said[record.name] = f" (to {', '.join(words)})" if words else ""
    return [f"{name}{use}" for name, use in said.items()]
