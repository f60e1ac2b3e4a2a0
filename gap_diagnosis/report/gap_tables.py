"""Tables of a diagnosis: the rows that the report's template shows."""

from __future__ import annotations

from collections.abc import Mapping
from math import nan
from typing import Any

import numpy as np

from bla_analyzer.results.summary import mean_level_db
from fjr_kit.page import Cell, Column, Mark, Row
from fjr_sim_node import effects as fx

from ..gates.gate_checks import GateReport
from ..how_far.bla_comparison import LevelComparison, Response, bla_distance_db, bla_distance_sigma
from ..outcome.cause_words import (
    cause_name,
    contender_names,
    digits,
    percent,
    place_words,
    share_words,
)
from ..outcome.diagnosis import Diagnosis
from ..outcome.gap_size import Estimate, Figure, Gap
from ..outcome.verdict_words import explains, explanation, unit_of
from ..starts.search_space import Space
from .gap_level_plots import MODEL_STYLES
from .updated_parameters import simulator_values

MOST_PLACES = 12
MOST_ACTS = 3
"""How many places of one cause are shown."""
LABELS = {k: label for k, (label, *_) in MODEL_STYLES.items()} | {"noise_floor": "noise floor"}


def gates(report: GateReport) -> list[Row]:
    """Return all gates, failed ones first: name, whether it passed, value, limit, sentence."""
    rows: list[Row] = []
    for gate in sorted(report.gates, key=lambda gate: gate.passed):
        word: Cell = Mark.of(gate.passed) if gate.limit == gate.limit else "not tested"
        rows.append((gate.name, word, gate.value, gate.limit, gate.sentence))
    return rows


def places(diagnosis: Diagnosis) -> list[Row]:
    """Return the strongest bands: signal, lines, level, ends (Hz), sigma of noise."""
    return [
        (p.signal, p.lines, str(p.level), *p.band_hz, p.sigma)
        for p in diagnosis.where[:MOST_PLACES]
    ]


def _converged(converged: bool) -> Cell:
    return "converged" if converged else Mark("not converged", "fail")


def _estimate(name: str, estimate: Estimate) -> str:
    value, low, high = digits(estimate)
    between = "" if low == high == "-" else f" [{low}, {high}]"
    return f"{name.split('.', 1)[1]} {value}{between}"


def causes(diagnosis: Diagnosis) -> list[Row]:
    """Return each cause: name, presence, share, parameters, invariance, where it acts."""
    return [
        (
            cause_name(cause),
            percent(cause.present),
            share_words(cause.share),
            [
                f"{_estimate(n, e)} {unit_of(n, linear=diagnosis.linear)}".rstrip()
                for n, e in cause.parameters.items()
            ],
            "-" if cause.invariance_p is None else f"{cause.invariance_p:.2g}",
            [place_words(place) for place in cause.where[:MOST_ACTS]],
        )
        for cause in diagnosis.causes
    ]


def contenders(diagnosis: Diagnosis) -> list[Row]:
    """Return the explanations that the verdict chose among: name, misfit, gain, convergence."""
    if not diagnosis.effects and diagnosis.verdict != "unexplained":
        return []
    return [
        (
            name,
            nan if one.held_out_chi2 is None else one.held_out_chi2,
            nan if one.gain is None else one.gain,
            _converged(one.converged),
        )
        for name, one in zip(contender_names(diagnosis), diagnosis.contenders, strict=True)
    ]


def tried(diagnosis: Diagnosis) -> list[Row]:
    """Return each effect that was tried beside the causes before it: step, effect, gain, values."""
    return [
        (
            str(len(candidate.effects)),
            explanation(candidate.effects[-1:]),
            nan if candidate.delta is None else candidate.delta,
            _converged(candidate.converged),
            [_estimate(n, e) for n, e in candidate.parameters.items()],
        )
        for candidate in diagnosis.ranking
    ]


def parameters(space: Space, diagnosis: Diagnosis, nominal: Mapping[str, float]) -> list[Row]:
    """Return name, unit, nominal value, estimate, interval, change (%) of what is shown.

    After these what `updated.yaml` has, where that is another value or stands at another name.
    """
    bounds = _bounds(space)
    written = simulator_values({name: e.value for name, e in diagnosis.parameters.items()})
    rows: list[Row] = []
    for name, e in diagnosis.parameters.items():
        given = nominal.get(name, nan)
        change = 100.0 * (e.value / given - 1.0) if given else nan
        note: Cell = Mark("at its bound", "fail") if _at(e.value, bounds.get(name)) else ""
        unit = unit_of(name, linear=diagnosis.linear)
        rows.append((name, unit, given, *digits(e), change, _written(name, e, written), note))
    return rows


def _written(name: str, estimate: Estimate, written: Mapping[str, float]) -> str:
    """Return the value of updated.yaml, or where it holds the parameter; empty if as shown."""
    if name in written:
        return "" if written[name] == estimate.value else f"{written[name]:.5g}"
    return f"in {fx.parameter(name).adds_to or 'the parameters above'}"


def _bounds(space: Space) -> Mapping[str, tuple[float, float]]:
    low, high = space.bounds()
    ends = space.model(low), space.model(high)
    return {name: (ends[0].plant[name], ends[1].plant[name]) for name in space.nominal}


def _at(value: float, bounds: tuple[float, float] | None) -> bool:
    if bounds is None or bounds[0] == bounds[1]:
        return False
    return min(abs(value - end) for end in bounds) < 1e-3 * (bounds[1] - bounds[0])


def _shown(diagnosis: Diagnosis) -> list[str]:
    """Return the stages whose gaps are shown: that of no explanation is not."""
    return [stage for stage in LABELS if stage != "explained" or explains(diagnosis)]


FIGURES: dict[str, tuple[str, float]] = {
    "position": ("position, % of its rms", 100.0),
    "torque": ("torque, % of its rms", 100.0),
    "bla_sigma": ("BLA, rms in \N{GREEK SMALL LETTER SIGMA}", 1.0),
    "distortion_db": ("distortion level, dB off", 1.0),
}
"""What each of the gap's figures is called, and the factor of what is shown."""


def gap_table(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """Return columns and rows of the gap: figures with 95 % intervals, misfit of each stage.

    None where nothing was simulated.
    """
    found = diagnosis.gap_figures
    if found is None:
        return None
    stages = _shown(diagnosis)
    columns = [Column(""), *(Column(LABELS[stage]) for stage in stages)]
    known = {name: figure for name in FIGURES if (figure := getattr(found, name)) is not None}
    shares = any(figure.closed is not None for figure in known.values())
    columns += [Column("closed", "of what the refit left, %")] if shares else []
    rows: list[Row] = []
    for name, figure in known.items():
        label, factor = FIGURES[name]
        cells = [_interval(getattr(figure, stage), factor) for stage in stages]
        if shares:
            cells.append(_interval(figure.closed, 100.0))
        rows.append((label, *cells))
    misfits = [_misfit(getattr(diagnosis.gap, stage)) for stage in stages]
    rows.append(("misfit per degree of freedom", *misfits, *(["-"] if shares else [])))
    return {"columns": columns, "rows": rows}


def _misfit(gap: Gap | None) -> str:
    return "-" if gap is None or gap.chi2_per_dof is None else f"{gap.chi2_per_dof:.4g}"


def _interval(figure: Figure | None, factor: float) -> str:
    if figure is None:
        return "-"
    value = f"{factor * figure.value:.3g}"
    if figure.low is None or figure.high is None:
        return value
    return f"{value} [{factor * figure.low:.3g}, {factor * figure.high:.3g}]"


def distances(found: list[LevelComparison]) -> dict[str, list[Any]]:
    """Return how far BLA and distortion of each simulation are from the rig's, by level."""
    rows: list[Row] = []
    levels = []
    for i, level in enumerate(found):
        for name, response in level.models.items():
            far = [
                bla_distance_db(level.rig, response),
                bla_distance_sigma(level.rig, response),
                _excess_db(level.rig, response, "odd"),
                _excess_db(level.rig, response, "even"),
            ]
            label = f"{level.level}, {level.amplitude_rad:.3g} rad"
            rows.append((label, MODEL_STYLES[name][0], *far))
            levels.append(i)
    return {"rows": rows, "levels": levels}


def _excess_db(rig: Response, model: Response, kind: str) -> float:
    """Return the level of a simulation, with the rig's noise added, over the rig's in dB."""
    measured, simulated = getattr(rig, kind), getattr(model, kind)
    noisy = np.hypot(simulated.corrected, np.nan_to_num(measured.noise))
    return mean_level_db(noisy) - mean_level_db(measured.corrected)
