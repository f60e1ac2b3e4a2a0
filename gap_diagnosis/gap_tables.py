"""Tables of a diagnosis as HTML."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from math import nan

import numpy as np

from bla_analyzer.page import Cell, table
from bla_analyzer.summary import mean_level_db

from .comparison import LevelComparison, Response, bla_distance_db, bla_distance_sigma
from .diagnosis import Diagnosis, Estimate, Figure
from .gap_level_plots import MODEL_STYLES
from .gates import GateReport
from .investigation import Investigation
from .search_space import Space
from .verdict_words import explanation, unit_of

Row = tuple[int | None, list[Cell]]
MOST_PLACES = 12


def gates_table(report: GateReport) -> str:
    """Return all gates, failed ones first."""
    heads = [("gate", ""), ("", ""), ("value", ""), ("limit", ""), ("finding", "")]
    words = {True: '<span class="pass">passed</span>', False: '<span class="fail">failed</span>'}
    rows: list[Row] = []
    for gate in sorted(report.gates, key=lambda gate: gate.passed):
        word = words[gate.passed] if gate.limit == gate.limit else "not tested"
        rows.append((None, [gate.name, word, gate.value, gate.limit, escape(gate.sentence)]))
    return table(heads, rows, "A value must not exceed its limit.")


def places_table(diagnosis: Diagnosis) -> str:
    """Return the strongest bands of the gap."""
    heads = [("signal", ""), ("lines", ""), ("level", ""), ("from", "Hz"), ("to", "Hz")]
    heads.append(("residual", "rms, in \N{GREEK SMALL LETTER SIGMA} of noise"))
    rows: list[Row] = [
        (None, [p.signal, p.lines, str(p.level), p.band_hz[0], p.band_hz[1], (p.sigma, ".3g")])
        for p in diagnosis.where[:MOST_PLACES]
    ]
    if not rows:
        return "<p>No line differs beyond noise, at a false-discovery rate of 1 %.</p>\n"
    return table(heads, rows, f"The strongest of {len(diagnosis.where)} bands.")


def candidates_table(investigation: Investigation) -> str:
    """Return every explanation with misfit and effect parameters."""
    heads = [("explanation", ""), ("held-out misfit", "per degree of freedom")]
    heads += [("\N{INCREMENT} chi\N{SUPERSCRIPT TWO}", "gain over the refit"), ("", "")]
    heads.append(("parameters", "value, 95 % interval"))
    attribution = investigation.attribution
    assert attribution is not None
    left = attribution.refit.held_chi2 / investigation.held_size
    rows: list[Row] = [
        (None, ["refit alone", left, 0.0, _converged(attribution.refit.converged), ""])
    ]
    for candidate in investigation.diagnosis.ranking:
        misfit = nan if candidate.held_out_chi2 is None else candidate.held_out_chi2
        gain = nan if candidate.delta is None else candidate.delta
        values = "<br>".join(_estimate(n, e) for n, e in candidate.parameters.items())
        cells: list[Cell] = [explanation(candidate.effects), misfit, gain]
        rows.append((None, [*cells, _converged(candidate.converged), values]))
    text = "What has not converged is not ranked. Intervals are widened by what the fit leaves."
    return table(heads, rows, text)


def _converged(converged: bool) -> str:
    return "converged" if converged else '<span class="fail">not converged</span>'


def _estimate(name: str, estimate: Estimate) -> str:
    short = name.split(".", 1)[1]
    return f"{short} {estimate.value:.4g} [{estimate.low:.4g}, {estimate.high:.4g}]"


def parameters_table(investigation: Investigation) -> str:
    """Return base and effect parameters of what is shown, with the nominal values."""
    diagnosis, nominal = investigation.diagnosis, investigation.nominal.plant
    heads = [("parameter", ""), ("unit", ""), ("nominal", ""), ("value", ""), ("low", "95 %")]
    heads += [("high", "95 %"), ("change", "%"), ("", "")]
    bounds = _bounds(investigation)
    rows: list[Row] = []
    for name, e in diagnosis.parameters.items():
        given = nominal.get(name, nan)
        change = 100.0 * (e.value / given - 1.0) if given else nan
        note = '<span class="fail">at its bound</span>' if _at(e.value, bounds.get(name)) else ""
        values: list[Cell] = [(x, ".5g") for x in (given, e.value, e.low, e.high)]
        rows.append((None, [name, unit_of(name), *values, (change, ".2f"), note]))
    if not rows:
        return ""
    return table(heads, rows, "Parameters of updated.yaml, with 95 % intervals.")


def _bounds(investigation: Investigation) -> Mapping[str, tuple[float, float]]:
    attribution = investigation.attribution
    assert attribution is not None
    space: Space = attribution.best.space
    low, high = space.bounds()
    ends = space.model(low), space.model(high)
    return {name: (ends[0].plant[name], ends[1].plant[name]) for name in space.nominal}


def _at(value: float, bounds: tuple[float, float] | None) -> bool:
    if bounds is None or bounds[0] == bounds[1]:
        return False
    return min(abs(value - end) for end in bounds) < 1e-3 * (bounds[1] - bounds[0])


def gap_table(diagnosis: Diagnosis) -> str:
    """Return the held-out gaps of all stages."""
    heads = [("", ""), ("position", "% of its rms"), ("torque", "% of its rms")]
    heads.append(("misfit", "per degree of freedom"))
    named = {"nominal": diagnosis.gap.nominal, "refit": diagnosis.gap.refit}
    if diagnosis.gap_closed is not None:
        named["explained"] = diagnosis.gap.explained
    named["noise_floor"] = diagnosis.gap.noise_floor
    labels = {k: label for k, (label, *_) in MODEL_STYLES.items()} | {"noise_floor": "noise floor"}
    rows: list[Row] = []
    for name, gap in named.items():
        if gap is not None:
            shares = [
                nan if x is None else 100.0 * x for x in (gap.nrmse_position, gap.nrmse_torque)
            ]
            misfit = nan if gap.chi2_per_dof is None else gap.chi2_per_dof
            rows.append((None, [labels[name], *((x, ".3g") for x in shares), (misfit, ".4g")]))
    return table(heads, rows, "Held-out realizations: error of the mean period.")


FIGURES: dict[str, tuple[str, float]] = {
    "position": ("position, % of its rms", 100.0),
    "torque": ("torque, % of its rms", 100.0),
    "bla_sigma": ("BLA, rms in \N{GREEK SMALL LETTER SIGMA}", 1.0),
    "distortion_db": ("distortion level, dB off", 1.0),
}
"""What each of the gap's figures is called, and the factor of what is shown."""


def figures_table(diagnosis: Diagnosis) -> str:
    """Return the gap's figures with their 95 % intervals, a row each."""
    figures = diagnosis.gap_figures
    if figures is None:
        return ""
    stages = ["nominal", "refit", "explained", "noise_floor"]
    if diagnosis.gap_closed is None:
        stages.remove("explained")
    labels = {k: label for k, (label, *_) in MODEL_STYLES.items()} | {"noise_floor": "noise floor"}
    heads = [("", ""), *((labels[stage], "") for stage in stages)]
    heads += [("closed", "of what the refit left, %")] if diagnosis.gap_closed is not None else []
    rows: list[Row] = []
    for name, (label, factor) in FIGURES.items():
        found = getattr(figures, name)
        cells: list[Cell] = [_interval(getattr(found, stage), factor) for stage in stages]
        if diagnosis.gap_closed is not None:
            cells.append(_interval(found.closed, 100.0))
        rows.append((None, [label, *cells]))
    text = (
        "Held-out realizations, with 95 % intervals: bootstrap over the realizations of each "
        "level. BLA and distortion are those of single realizations with the same phases."
    )
    return table(heads, rows, text)


def _interval(figure: Figure | None, factor: float) -> str:
    if figure is None:
        return "-"
    value = f"{factor * figure.value:.3g}"
    if figure.low is None or figure.high is None:
        return value
    return f"{value} [{factor * figure.low:.3g}, {factor * figure.high:.3g}]"


def distance_table(found: list[LevelComparison]) -> str:
    """Return distances of BLA and distortion levels of each simulation from the rig."""
    heads = [
        ("level", ""),
        ("simulation", ""),
        ("BLA", "rms, dB"),
        ("BLA", "rms, \N{GREEK SMALL LETTER SIGMA}"),
    ]
    heads += [
        ("odd distortion", "with noise, dB re rig"),
        ("even distortion", "with noise, dB re rig"),
    ]
    rows: list[Row] = []
    for i, level in enumerate(found):
        for name, response in level.models.items():
            far: list[Cell] = [
                (bla_distance_db(level.rig, response), ".3g"),
                (bla_distance_sigma(level.rig, response), ".3g"),
                (_excess_db(level.rig, response, "odd"), "+.2f"),
                (_excess_db(level.rig, response, "even"), "+.2f"),
            ]
            label = f"{level.level}, {level.amplitude_rad:.3g} rad"
            rows.append((i, [label, MODEL_STYLES[name][0], *far]))
    text = (
        "All realizations. \N{GREEK SMALL LETTER SIGMA}: standard deviation of the rig's BLA by "
        "noise and nonlinearity; the same phases are played, so a good model stays far below 1."
    )
    return table(heads, rows, text)


def _excess_db(rig: Response, model: Response, kind: str) -> float:
    """Return the level of a simulation, with the rig's noise added, over the rig's in dB."""
    measured, simulated = getattr(rig, kind), getattr(model, kind)
    noisy = np.hypot(simulated.corrected, np.nan_to_num(measured.noise))
    return mean_level_db(noisy) - mean_level_db(measured.corrected)
