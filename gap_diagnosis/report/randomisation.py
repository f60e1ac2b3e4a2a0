"""Ranges for domain randomisation: how far each parameter of the better simulation may be off.

A policy or a controller that is tried over these ranges meets the rig on any of its days: each
range holds 95 % of runs, by what the fit does not know of a parameter and by what the parameter
scatters from run to run. Where a ripple lies along the motion is laid down in the machine and has
no range.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import yaml

from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT

from ..fits.estimates import run_scatter
from ..gates.bag_deviations import SCATTERING
from ..outcome.diagnosis import Bags
from ..outcome.gap_size import Estimate

_NORMAL_95 = 1.96
_HEAD = """\
# Ranges for domain randomisation, beside updated.yaml.
# {hold}
# uncertainty: standard error of the fit, of what is the same in all runs.
# scatter: standard deviation from run to run; 0 where none shows, null where it is not known.
# Draw all values once for each run, each from a normal distribution about `value` with
# sqrt(uncertainty^2 + scatter^2), cut at `low` and `high`; errors of several parameters that
# the fit cannot tell apart are drawn independently here, which is wider than the rig.
# What is not listed keeps its value of updated.yaml: cycles and phase of a ripple are the
# machine's for good, and drawn apart they would put it in wrong places.
simulator:
"""
_RUNS = "95 % of runs of this rig lie within, as far as the laws of updated.yaml are the rig's."
_FIT = (
    "They hold what the fit does not know, but runs may lie beyond them: how far the rig\n"
    "# scatters from run to run is not known, since the runs are too few or differ by more than\n"
    "# scatter explains."
)


@dataclass(frozen=True)
class Range:
    """What a parameter may be in a run, SI units.

    Attributes:
        value: of the better simulation.
        uncertainty: standard error of the fit.
        scatter: standard deviation from run to run; None where that is not known.
        low, high: hold 95 % of runs; of what the fit does not know where scatter is None.
    """

    value: float
    uncertainty: float
    scatter: float | None
    low: float
    high: float


def ranges(found: Mapping[str, Estimate], bags: Bags | None) -> dict[str, Range]:
    """Return the range of each parameter that the simulator takes.

    What the bare plant lacked counts to the parameter that it adds to. A parameter whose interval
    is not known, such as a limit that no run reaches, has no range, and cycles and phase of a
    ripple have none.

    Args:
        found: parameters with their intervals.
        bags: how far each scatters; None where that is not known.
    """
    scatter = run_scatter(found, bags)
    known = {} if bags is None or not bags.scatter_known else bags.scatter_percent
    told = [parameter for name in known for parameter in SCATTERING[name]]
    parts: dict[str, list[str]] = {}
    fixed = {name for effect in fx.CATALOGUE for name in effect.place_names}
    for name in [name for name in found if name not in fixed]:
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


def randomisation_yaml(found: Mapping[str, Range], group: ParameterGroup) -> str:
    """Return the text of randomisation.yaml, with units from the simulator's parameters."""
    scatters = any(each.scatter is not None for each in found.values())
    lines = [f"  {name}: {_entry(each)}{_unit(group[name])}\n" for name, each in found.items()]
    return _HEAD.format(hold=_RUNS if scatters else _FIT) + "".join(lines)


def _entry(found: Range) -> str:
    entry = {
        "value": _short(found.value),
        "uncertainty": _short(found.uncertainty),
        "scatter": None if found.scatter is None else _short(found.scatter),
        "low": _short(found.low),
        "high": _short(found.high),
    }
    flow = yaml.safe_dump(entry, sort_keys=False, default_flow_style=True, width=math.inf)
    return str(flow).strip()


def _unit(parameter: Parameter) -> str:
    return f"  # {parameter.unit}" if parameter.unit else ""


def _short(value: float) -> float:
    return float(f"{value:.6g}")
