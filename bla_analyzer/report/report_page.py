"""report.html of an analysis: the values that its template `report.html` shows."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fjr_kit.page import Cell, Mark, Row, render_page

from ..results.findings import all_findings
from ..results.result import BlaEstimate, Result
from ..results.summary import campaign, failed_checks, headline, level_name, summarize
from .report_plots import level_plots, overview_plots


def render_report(result: Result, provenance: Mapping[str, str]) -> str:
    """Return the whole report.

    Args:
        result: the analysis.
        provenance: what made the report, by name (versions, command, date), in order.
    """
    plots = {
        "overview": overview_plots(result),
        "levels": [level_plots(level) for level in result.levels],
    }
    origin = {"folder": result.source, **provenance}
    if result.controller is not None:
        origin["controller"] = json.dumps(result.controller, ensure_ascii=False, default=str)
    checks = sorted(result.checks, key=lambda check: check.passed)
    return render_page(
        "bla_analyzer.report",
        "report.html",
        title=f"BLA of {result.source}",
        plots=plots,
        provenance=origin,
        result=result,
        lead=campaign(result),
        headline=headline(result),
        failed=[check.sentence for check in failed_checks(result)],
        names=[level_name(level) for level in result.levels],
        findings=all_findings(result),
        key_numbers=_key_numbers(result),
        distances=_distances(result),
        models={c.name: c.description for level in result.levels for c in level.comparisons},
        lines=[None if one.bla is None else _lines(one.bla) for one in result.levels],
        checks=[(c.name, Mark.of(c.passed), c.value, c.limit, c.sentence) for c in checks],
    )


def _key_numbers(result: Result) -> list[Row]:
    """Return name, amplitudes, mean powers and quality of every level."""
    rows: list[Row] = []
    for level in result.levels:
        n = summarize(level)
        rms = [level.reference_rms_rad, level.torque_rms_nm, level.torque_peak_nm]
        rms += [level.position_rms_rad, level.position_peak_rad]
        powers = [n.linear_db, n.total_db, n.odd_db, n.even_db, n.noise_db]
        unreliable = f"{n.unreliable} of {n.lines}"
        rows.append((n.name, *rms, *powers, n.radius_percent, unreliable))
    return rows


def _distances(result: Result) -> dict[str, list[Any]]:
    """Return V of every level against every model, and the index of the level of each row."""
    found = [(i, level, c) for i, level in enumerate(result.levels) for c in level.comparisons]
    rows = [
        (level_name(level), c.name, c.v_mean, c.v_median, c.v_mean_above_1hz, c.v_median_above_1hz)
        for _, level, c in found
    ]
    return {"rows": rows, "levels": [i for i, _, _ in found]}


def _lines(bla: BlaEstimate) -> list[Row]:
    """Return the BLA line by line."""
    arrays = [bla.frequency_hz, bla.g.real, bla.g.imag, bla.radius_95, bla.var_noise]
    arrays += [bla.var_nonlinear, bla.nonlinear_p_value, bla.coherence]
    arrays += [bla.input_relative_variance]
    words: list[Cell] = ["yes" if flag else "no" for flag in bla.reliable]
    return list(zip(*(array.tolist() for array in arrays), words, strict=True))
