"""Does the rig change from bag to bag? The gate that needs a model, so the last one."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.simulated_rig import Simulator
from ..outcome.diagnosis import Bags, BagTrend, Estimate
from .bag_changes import TREND_FALSE_ALARM, BagChanges, Trend, bag_changes
from .bag_deviations import periodic_errors, record_errors
from .gate_checks import Gate, GateReport, untested

SCATTER_SHOWN = 1e-3
"""Least relative scatter from bag to bag that a sentence mentions."""


def with_bags_gate(
    report: GateReport,
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    simulator: Simulator,
    model: Model,
) -> GateReport:
    """Return the gates with `bags_gate` as the last one, and all that a reader must see."""
    bags = bags_gate(recorded, noise, simulator, model)
    telling = [bags.sentence] if bags.telling else []
    return GateReport((*report.gates, bags), (*report.notes, *recorded.notes, *telling))


def bags_gate(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    simulator: Simulator,
    model: Model,
) -> Gate:
    """Test whether friction or stiffness drift from bag to bag, with a refit or explained model.

    Scatter without a trend is no drift: it passes, and the sentence and `Gate.bags` tell its size.
    """
    name = "stationary over realizations"
    needs = (
        "two bags more than levels, two periods each, and motion that determines friction and "
        "stiffness in each bag"
    )
    changes = periodic_changes(recorded, noise, simulator, model) if noise is not None else None
    if changes is None:
        return untested(name, needs)
    worst = worst_trend(changes)
    span_s = float(np.ptp([r.experiment.elapsed_s for r in recorded.realizations]))
    passed = worst.p_value > TREND_FALSE_ALARM
    scatter = scattering(changes)
    if passed:
        sentence = "neither friction nor stiffness follows a trend from bag to bag"
        sentence += f"; without one, {scatter} scatters." if scatter else "."
    else:
        sentence = (
            f"{worst.group} follows a trend from bag to bag {_along(worst, span_s)} over the "
            "record; let the rig warm up, or record levels interleaved."
        )
    z, limit = (float(norm.isf(0.5 * max(p, 1e-300))) for p in (worst.p_value, TREND_FALSE_ALARM))
    return Gate(
        name=name,
        passed=passed,
        value=z,
        limit=limit,
        sentence=sentence,
        hint="nonstationary",
        bags=as_bags(changes, span_s),
        telling=passed and bool(scatter),
    )


def periodic_changes(
    recorded: RecordedExperiment, noise: NoiseLevels, simulator: Simulator, model: Model
) -> BagChanges | None:
    """Return what changes from bag to bag of steady periods; see `bag_changes`."""
    levels = np.array([r.level for r in recorded.realizations])
    elapsed_s = np.array([r.experiment.elapsed_s for r in recorded.realizations])
    return bag_changes(periodic_errors(recorded, noise, simulator), levels, elapsed_s, model)


def record_changes(evidence: Evidence, variance: np.ndarray, model: Model) -> BagChanges | None:
    """Return how parameters scatter and drift from record to record; see `bag_changes`.

    A trend is one over the order of the records, since nothing tells when they began.

    Args:
        evidence: the records.
        variance: (cells,), of an error in each cell, rad2.
        model: the best model.
    """
    levels = np.array([r.level for r in evidence.records.records])
    errors, blocks = record_errors(evidence, variance)
    return bag_changes(errors, levels, np.arange(levels.size, dtype=float), model, blocks)


def worst_trend(changes: BagChanges) -> Trend:
    """Return the trend that chance makes least often."""
    return min(changes.trends, key=lambda trend: trend.p_value)


def drift_of_runs(changes: BagChanges, runs: int) -> str:
    """Return the sentence on a trend over runs in the order of their files; empty without one."""
    worst = worst_trend(changes)
    if worst.p_value > TREND_FALSE_ALARM:
        return ""
    return (
        f"In the order of the runs {worst.group} follows a trend {_along(worst, runs - 1.0)} from "
        "the first to the last: if they were recorded in this order, let the rig warm up, or "
        "record levels interleaved."
    )


def _along(trend: Trend, span: float) -> str:
    return (
        f"(by chance in {trend.p_value:.1g} of rigs that only scatter), along a line by "
        f"{trend.slope_per_s * span:+.2%}"
    )


def as_bags(changes: BagChanges, span_s: float) -> Bags:
    """Return changes as the outcome holds them; `span_s` is from the first bag to the last.

    Of records, whose order alone is known, it is their number less one.
    """
    return Bags(
        trends={
            t.group: BagTrend(change_percent=100.0 * t.slope_per_s * span_s, p_value=t.p_value)
            for t in changes.trends
        },
        scatter_percent={
            s.parameter: Estimate(value=100.0 * s.value, low=100.0 * s.low, high=100.0 * s.high)
            for s in changes.scatters
        },
        accounted=changes.accounted,
    )


def scattering(changes: BagChanges) -> str:
    """Return which parameters scatter beyond what is uncertain, each by how much; empty if none."""
    seen = [
        f"{s.parameter} by {_percent(s.value)} % ({_percent(s.low)} to {_percent(s.high)} %)"
        for s in changes.scatters
        if s.low > SCATTER_SHOWN
    ]
    return ", ".join(seen)


def _percent(share: float) -> str:
    percent = 100.0 * share
    return f"{percent:.2g}" if percent < 99.5 else f"{percent:.0f}"
