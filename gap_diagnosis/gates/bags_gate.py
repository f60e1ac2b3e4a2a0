"""Does the rig change from bag to bag? The gate that needs a model, so the last one."""

from __future__ import annotations

from scipy.stats import norm

from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment

from ..model.simulated_rig import Model, Simulator
from ..outcome.diagnosis import Bags, BagTrend, Estimate
from .bag_changes import TREND_FALSE_ALARM, BagChanges, bag_changes
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
    changes = bag_changes(recorded, noise, simulator, model) if noise is not None else None
    if changes is None:
        return untested(name, needs)
    worst = min(changes.trends, key=lambda trend: trend.p_value)
    elapsed_s = [r.experiment.elapsed_s for r in recorded.realizations]
    span_s = max(elapsed_s) - min(elapsed_s)
    passed = worst.p_value > TREND_FALSE_ALARM
    scatter = _scattering(changes)
    if passed:
        sentence = "neither friction nor stiffness follows a trend from bag to bag" + scatter
    else:
        sentence = (
            f"{worst.group} follows a trend from bag to bag (by chance in {worst.p_value:.1g} of "
            f"rigs that only scatter), along a line by {worst.slope_per_s * span_s:+.2%} over the "
            "record; let the rig warm up, or record levels interleaved."
        )
    detail = Bags(
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
    z, limit = (float(norm.isf(0.5 * max(p, 1e-300))) for p in (worst.p_value, TREND_FALSE_ALARM))
    return Gate(
        name=name,
        passed=passed,
        value=z,
        limit=limit,
        sentence=sentence,
        hint="nonstationary",
        bags=detail,
        telling=passed and bool(scatter),
    )


def _scattering(changes: BagChanges) -> str:
    """Return the end of a sentence on the parameters that scatter beyond what is uncertain."""
    seen = [
        f"{s.parameter} by {100.0 * s.value:.2g} % ({100.0 * s.low:.2g} to {100.0 * s.high:.2g} %)"
        for s in changes.scatters
        if s.low > SCATTER_SHOWN
    ]
    return f"; without one, {', '.join(seen)} scatters." if seen else "."
