"""Ranges for domain randomisation: how far each parameter of the better simulation may be off.

A policy or a controller that is tried over these ranges meets the rig on any of its days: each
range holds 95 % of runs, by what the fit does not know of a parameter and by what the parameter
scatters from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from fjr_interface.parameters import Parameter
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT

from ..gates.bag_deviations import SCATTERING
from ..outcome.diagnosis import Bags, Estimate
from ..which.estimates import run_scatter

_NORMAL_95 = 1.96
_HEAD = """\
# Ranges for domain randomisation, beside updated.yaml: 95 % of runs of this rig lie within.
# uncertainty: standard error of the fit, of what is the same in all runs.
# scatter: standard deviation from run to run; 0 where none shows, null where it was not looked for.
# Draw all values once for each run, each from a normal distribution about `value` with
# sqrt(uncertainty^2 + scatter^2), cut at `low` and `high`; errors of several parameters that
# the fit cannot tell apart are drawn independently here, which is wider than the rig.
"""


@dataclass(frozen=True)
class Range:
    """What a parameter may be in a run, SI units.

    Attributes:
        value: of the better simulation.
        uncertainty: standard error of the fit.
        scatter: standard deviation from run to run; None where that is not known.
        low, high: hold 95 % of runs.
    """

    value: float
    uncertainty: float
    scatter: float | None
    low: float
    high: float


def ranges(found: Mapping[str, Estimate], bags: Bags | None) -> dict[str, Range]:
    """Return the range of each parameter that the simulator takes.

    What the bare plant lacked counts to the parameter that it adds to. A parameter whose interval
    is not known, such as a limit that no run reaches, has no range.

    Args:
        found: parameters with their intervals.
        bags: how far each scatters; None where that is not known.
    """
    scatter = run_scatter(found, bags)
    told = () if bags is None else [p for n in bags.scatter_percent for p in SCATTERING[n]]
    parts: dict[str, list[str]] = {}
    for name in found:
        whole = fx.parameter(name).adds_to or name if "." in name else name
        parts.setdefault(whole, []).append(name)
    ranged = {}
    for name, members in parts.items():
        value = sum(found[m].value for m in members)
        errors = [(found[m].high - found[m].low) / (2.0 * _NORMAL_95) for m in members]
        uncertainty = math.hypot(*errors)
        own = sum(scatter.get(m, 0.0) for m in members)
        spread = _NORMAL_95 * math.hypot(uncertainty, own)
        if not math.isfinite(value + spread):
            continue
        limits: Parameter | fx.EffectParameter = fx.parameter(name) if "." in name else PLANT[name]
        ranged[name] = Range(
            value,
            uncertainty,
            own if name in told else None,
            max(value - spread, float(limits.low)),
            min(value + spread, float(limits.high)),
        )
    return ranged


def randomisation_yaml(found: Mapping[str, Range]) -> str:
    """Return the text of randomisation.yaml."""
    entries = {
        name: {
            "value": _short(r.value),
            "uncertainty": _short(r.uncertainty),
            "scatter": None if r.scatter is None else _short(r.scatter),
            "low": _short(r.low),
            "high": _short(r.high),
        }
        for name, r in found.items()
    }
    return _HEAD + yaml.safe_dump({"simulator": entries}, sort_keys=False, default_flow_style=None)


def _short(value: float) -> float:
    return float(f"{value:.6g}")
