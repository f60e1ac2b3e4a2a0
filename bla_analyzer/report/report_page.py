"""report.html of an analysis: the values that its template `report.html` shows."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from controller_node.law import acts_on_error
from fjr_kit.page import Cell, Row, check_rows, render_page

from ..results.findings import all_findings
from ..results.loop import what_lacks
from ..results.result import BlaEstimate, OutputBla, Result
from ..results.summary import campaign, failed_checks, headline, level_name, summarize
from ..results.terms import TERMS
from .overview_plots import overview_plots
from .report_plots import level_plots


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
        terms=TERMS,
        lacks=[what_lacks(result, level) for level in result.levels],
        assumed=acts_on_error(result.controller, result.sample_rate_hz) is None,
        link_lines=[_link_lines(one.bla) for one in result.levels],
        lines=[None if one.bla is None else _lines(one.bla) for one in result.levels],
        checks=check_rows(result.checks),
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


def _link_lines(bla: BlaEstimate | None) -> list[Row] | None:
    """Return the BLA of the link position line by line; None where there is none."""
    if bla is None or bla.link is None:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.sqrt(bla.link.var_total * bla.var_total)
        correlation = np.abs(bla.link.cov_total) / size
    return _rows(bla.frequency_hz, bla.link, correlation.tolist())


def _lines(bla: BlaEstimate) -> list[Row]:
    """Return the BLA line by line."""
    words: list[Cell] = ["yes" if flag else "no" for flag in bla.reliable]
    return _rows(bla.frequency_hz, bla, bla.input_relative_variance.tolist(), words)


def _rows(frequency_hz: np.ndarray, one: OutputBla, *more: Sequence[Cell]) -> list[Row]:
    """Return the lines of one output; `more` are further columns."""
    arrays = [frequency_hz, one.g.real, one.g.imag, one.radius_95, one.var_noise]
    arrays += [one.var_nonlinear, one.nonlinear_p_value, one.coherence]
    return list(zip(*(array.tolist() for array in arrays), *more, strict=True))
