"""Does the rig change from bag to bag? The gate that needs a model, so the last one."""

from __future__ import annotations

import numpy as np
from scipy import stats

from fjr_records.periodic import RecordedExperiment
from fjr_sim_node.plant import PLANT

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.steady_runs import SteadyRuns
from ..outcome.diagnosis import Bags, BagTrend
from ..outcome.gap_size import Estimate
from .bag_changes import TREND_FALSE_ALARM, BagChanges, bag_changes, levels_agree
from .bag_deviations import run_errors
from .gate_checks import Gate, untested

SCATTER_SHOWN = 0.1
"""Least scatter from bag to bag that a sentence mentions, %."""
SCATTER_EXPLAINS = 0.2
"""Share of the best model's misfit from which on its scatter counts as the rig's. Of ten
simulated rigs of known scatter at 0.23 or more all were told it to a half; of seven at 0.13 or
less, whose model lacked a law, four were told two to twenty times what was there. It is no proof:
a lag that a model lacks was taken for 10 % of scatter of the stiffness, at 0.9."""


def bags_gate(bags: Bags | None, recorded: RecordedExperiment) -> Gate:
    """Tell whether friction or stiffness drift from bag to bag of steady periods.

    Scatter without a trend is no drift: it passes.

    Args:
        bags: what changes beside the best model; None where that could not be tested.
        recorded: the experiment.
    """
    name = "stationary over realizations"
    if bags is None:
        return untested(
            name,
            "two bags more than levels, two periods each, and motion that determines friction and "
            "stiffness in each bag",
        )
    group, worst = worst_trend(bags)
    passed = worst.p_value > TREND_FALSE_ALARM
    sentence = (
        "neither friction nor stiffness follows a trend from bag to bag."
        if passed
        else f"{group} follows a trend from bag to bag {_along(worst)} over the record; let the "
        "rig warm up, or record levels interleaved."
    )
    chances = worst.p_value, TREND_FALSE_ALARM
    z, limit = (float(stats.norm.isf(0.5 * max(p, 1e-300))) for p in chances)
    return Gate(
        name=name,
        passed=passed,
        value=z,
        limit=limit,
        sentence=sentence,
        hint="nonstationary",
    )


def run_changes(evidence: Evidence, variance: np.ndarray, model: Model) -> BagChanges | None:
    """Return how parameters scatter and drift from run to run; see `bag_changes`.

    A trend of records is one over their order, since nothing tells when they began.

    Args:
        evidence: the runs.
        variance: (cells,), of an error in each cell, rad2.
        model: the best model.
    """
    levels = np.array([r.level for r in evidence.records.records])
    errors, blocks = run_errors(evidence, variance)
    return bag_changes(errors, levels, _times(evidence), model, blocks)


def friction_follows_time(evidence: Evidence, variance: np.ndarray, model: Model) -> bool:
    """Tell whether friction goes one way in time, from run to run within levels.

    Levels are recorded one after the other, as a rule. What a wrong law leaves is of another size
    at each of them, and looks like a drift from level to level, but not within one.

    Args:
        evidence: the runs.
        variance: (cells,), of an error in each cell, rad2.
        model: the best model without a drift.
    """
    changes = run_changes(evidence, variance, model)
    own = [t for t in changes.trends if t.group == "friction"] if changes else []
    levels = np.array([r.level for r in evidence.records.records])
    return any(levels_agree(t.deviation, t.std, levels, _times(evidence)) for t in own)


def _times(evidence: Evidence) -> np.ndarray:
    """Return when runs began, (runs,): s, or their order where nothing tells."""
    runs = evidence.records.records
    if isinstance(evidence.records, SteadyRuns):
        return np.array([r.elapsed_s for r in runs])
    return np.arange(len(runs), dtype=float)


def worst_trend(bags: Bags) -> tuple[str, BagTrend]:
    """Return the group whose trend chance makes least often, and that trend."""
    return min(bags.trends.items(), key=lambda item: item[1].p_value)


def drift_of_runs(bags: Bags) -> str:
    """Return the sentence on a trend over records in the order of their files; empty without."""
    group, worst = worst_trend(bags)
    if worst.p_value > TREND_FALSE_ALARM:
        return ""
    return (
        f"In the order of the runs {group} follows a trend {_along(worst)} from the first to the "
        "last: if they were recorded in this order, let the rig warm up, or record levels "
        "interleaved."
    )


def _along(trend: BagTrend) -> str:
    return (
        f"(by chance in {trend.p_value:.1g} of rigs that only scatter), along a line by "
        f"{trend.change_percent:+.2f}%"
    )


def as_bags(changes: BagChanges, evidence: Evidence, explained: bool = False) -> Bags:
    """Return changes as the outcome holds them, trends from the first run to the last.

    Args:
        changes: of the parameters of the best model.
        evidence: the runs.
        explained: whether noise explains all that the model leaves.
    """
    span = float(np.ptp(_times(evidence)))
    return Bags(
        trends={
            t.group: BagTrend(change_percent=100.0 * t.slope_per_s * span, p_value=t.p_value)
            for t in changes.trends
        },
        scatter_percent={
            s.parameter: Estimate(value=100.0 * s.value, low=100.0 * s.low, high=100.0 * s.high)
            for s in changes.scatters
        },
        accounted=changes.accounted,
        scatter_known=changes.accounted >= SCATTER_EXPLAINS or explained,
    )


def scattering(bags: Bags) -> str:
    """Return a sentence on what scatters beyond what is uncertain, and how far; empty if nothing.

    Where scatter explains too little of what the best model leaves, it says that instead.
    """
    seen = {n: e for n, e in bags.scatter_percent.items() if e.low > SCATTER_SHOWN}
    if not seen:
        return ""
    if not bags.scatter_known:
        return (
            "How far friction or stiffness scatters from run to run is not known: runs differ by "
            "more than such scatter explains. With values of its own for each run the best model "
            f"would lose only {_percent(100.0 * bags.accounted)} % of its misfit, so a law that it "
            "lacks would be taken for scatter."
        )
    each = ", ".join(
        f"{_named(name)} by {_percent(e.value)} % ({_percent(e.low)} to {_percent(e.high)} %)"
        for name, e in seen.items()
    )
    return f"What scatters from run to run: {each}."


def _named(parameter: str) -> str:
    """Return a parameter of `SCATTERING` in words, such as 'motor viscous friction (fvm)'."""
    if parameter not in PLANT:
        return f"{parameter} of the transmission"
    words = PLANT[parameter].description
    return f"{words[0].lower()}{words[1:]} ({parameter})"


def _percent(percent: float) -> str:
    return f"{percent:.2g}" if percent < 99.5 else f"{percent:.0f}"
