"""report.html: one file that opens offline, with interactive plots.

Every text that comes from bags is escaped; the frame is that of `page`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape

from .page import Cell, asset, bullets, page, table
from .report_plots import level_plots, overview_plots
from .report_text import FIGURES, OVERVIEW
from .result import Check, LevelResult, Result
from .summary import campaign, failed_checks, findings, headline, level_name, summarize


def render_report(result: Result, provenance: Mapping[str, str]) -> str:
    """Return the whole report.

    Args:
        result: the analysis.
        provenance: what made the report, by name (versions, command, date), in order.
    """
    body = "\n".join(
        [
            _top(result),
            _numbers(result),
            _overview(result),
            _levels(result),
            _checks(result),
            asset("report_method.html"),
            _origin(result, provenance),
        ]
    )
    plots = {
        "overview": overview_plots(result),
        "levels": [level_plots(level) for level in result.levels],
    }
    return page(f"BLA of {result.source}", body, plots)


def _top(result: Result) -> str:
    """Return title, what was analysed, the verdict, failed checks, notes and findings."""
    failed = failed_checks(result)
    says = [
        f"<b>{escape(level_name(level))}.</b> {_join(findings(level))}" for level in result.levels
    ]
    return f"""<header>
<h1>Best linear approximation of {escape(result.source)}</h1>
<p class="lead">{escape(campaign(result))}</p>
<div class="verdict{" bad" if failed else ""}">
<strong>{escape(headline(result))}</strong>
{bullets(escape(check.sentence) for check in failed)}{bullets(map(escape, result.notes))}</div>
<div class="findings">{bullets(says)}</div></header>"""


def _join(sentences: Iterable[str]) -> str:
    return escape(" ".join(sentences))


def _numbers(result: Result) -> str:
    """Return the key numbers and V of every level."""
    return f"<section>\n<h2>Key numbers</h2>\n{_key_table(result)}{_v_table(result)}</section>"


def _key_table(result: Result) -> str:
    heads = [
        ("level", ""),
        ("r rms", "rad"),
        ("u rms", "N m"),
        ("u peak", "N m"),
        ("y rms", "rad"),
        ("y peak", "rad"),
        ("excited", "dB re 1 rad"),
        ("odd", "dB re 1 rad"),
        ("even", "dB re 1 rad"),
        ("noise", "dB re 1 rad"),
        ("radius/|G|", "median, %"),
        ("unreliable", "of lines"),
    ]
    rows: list[tuple[int | None, list[Cell]]] = []
    for i, level in enumerate(result.levels):
        n = summarize(level)
        rms: list[Cell] = [level.reference_rms_rad, level.torque_rms_nm, level.torque_peak_nm]
        rms += [level.position_rms_rad, level.position_peak_rad]
        db: list[Cell] = [(x, ".1f") for x in (n.linear_db, n.odd_db, n.even_db, n.noise_db)]
        unreliable = f"{n.unreliable} of {n.lines}"
        rows.append((i, [escape(n.name), *rms, *db, (n.radius_percent, ".2g"), unreliable]))
    text = (
        "In dB: mean power of the position over the lines of a kind; at odd and even lines "
        "corrected for the loop."
    )
    return table(heads, rows, text)


def _v_table(result: Result) -> str:
    """Return V of every level against every model; nothing if there is no model."""
    heads = [("level", ""), ("model", ""), ("V", "dB²"), ("V, median", "dB²")]
    heads += [("V from 1 Hz", "dB²"), ("V from 1 Hz, median", "dB²")]
    rows: list[tuple[int | None, list[Cell]]] = []
    for i, level in enumerate(result.levels):
        for c in level.comparisons:
            v: list[Cell] = [c.v_mean, c.v_median, c.v_mean_above_1hz, c.v_median_above_1hz]
            rows.append((i, [escape(level_name(level)), escape(c.name), *v]))
    text = "V: mean squared distance of 20 log|G| from the model in dB, over the excited lines."
    models = {c.name: c.description for level in result.levels for c in level.comparisons}
    words = bullets(f"<b>{escape(name)}</b>: {escape(what)}" for name, what in models.items())
    return table(heads, rows, text) + words if rows else ""


def _overview(result: Result) -> str:
    if len(result.levels) < 2:
        return ""
    return f"<section>\n<h2>All levels</h2>\n{OVERVIEW}</section>"


def _levels(result: Result) -> str:
    """Return the plots of the chosen level, the choice, and the lines of every level."""
    buttons = "".join(
        f'<button type="button" data-level="{i}" aria-pressed="false">{escape(level_name(level))}'
        "</button>"
        for i, level in enumerate(result.levels)
    )
    choice = f'<nav class="levels" aria-label="Level">{buttons}</nav>\n'
    lines = "".join(_lines(i, level) for i, level in enumerate(result.levels))
    title = "One level"
    if len(result.levels) == 1:
        title, choice = escape(level_name(result.levels[0])), ""
    return f"<section>\n<h2>{title}</h2>\n{choice}{FIGURES}{lines}</section>"


def _lines(index: int, level: LevelResult) -> str:
    """Return the BLA of a level line by line."""
    bla = level.bla
    if bla is None:
        return ""
    heads = [("frequency", "Hz"), ("Re G", "rad/(N m)"), ("Im G", "rad/(N m)")]
    heads += [("radius", "rad/(N m)"), ("var noise", "(rad/(N m))²")]
    heads += [("var nonlinear", "(rad/(N m))²"), ("p", ""), ("Var(U)/|U|²", ""), ("reliable", "")]
    arrays = [bla.frequency_hz, bla.g.real, bla.g.imag, bla.radius_95, bla.var_noise]
    arrays += [bla.var_nonlinear, bla.nonlinear_p_value, bla.input_relative_variance]
    words = ["yes" if flag else "no" for flag in bla.reliable]
    columns = zip(*(array.tolist() for array in arrays), words, strict=True)
    rows = table(
        heads,
        [(None, list(row)) for row in columns],
        "A negative variance is an estimate below zero; the sign is kept.",
    )
    name = escape(level_name(level))
    return f'<details data-level="{index}"><summary>Lines of {name}</summary>\n{rows}</details>\n'


def _checks(result: Result) -> str:
    """Return all checks, failed ones first."""
    if not result.checks:
        return ""
    heads = [("check", ""), ("", ""), ("value", ""), ("limit", ""), ("finding", "")]
    rows: list[tuple[int | None, list[Cell]]] = [
        (None, _check_cells(check)) for check in sorted(result.checks, key=lambda c: c.passed)
    ]
    shown = table(heads, rows, "A value must not exceed its limit.")
    opened = " open" if failed_checks(result) or len(rows) <= 12 else ""
    return (
        f"<section>\n<h2>Checks of the data</h2>\n<p>{escape(headline(result))}</p>\n"
        f"<details{opened}><summary>All checks ({len(rows)})</summary>\n{shown}</details></section>"
    )


def _check_cells(check: Check) -> list[Cell]:
    word = (
        '<span class="pass">passed</span>' if check.passed else '<span class="fail">failed</span>'
    )
    return [escape(check.name), word, check.value, check.limit, escape(check.sentence)]


def _origin(result: Result, provenance: Mapping[str, str]) -> str:
    """Return where the numbers come from."""
    pairs = {"folder": result.source, **provenance}
    if result.controller is not None:
        pairs["controller"] = json.dumps(result.controller, ensure_ascii=False, default=str)
    items = "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>\n" for k, v in pairs.items())
    bags = bullets(map(escape, result.bags))
    return (
        f"<section>\n<h2>Provenance</h2>\n<dl>\n{items}</dl>\n"
        f"<details><summary>Bags ({len(result.bags)})</summary>\n{bags}</details></section>"
    )
