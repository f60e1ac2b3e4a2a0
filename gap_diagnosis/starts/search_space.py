"""From which values an effect is fitted: several starting points each, and natural scales.

The table of effects gives starts and bounds of fits relative to `Scales`, those of the record.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT

from ..model.rig_model import Model
from .scales import Scales

TOLERANCE = 0.1
"""How far a datasheet value may be off; fits look further, since a torque constant that is off
scales all values, and an encoder whose gain is off (an eccentric one, locally) once more."""

_SCALE = 2.0
_SCALES = dict.fromkeys(("k1", "fs", "fsm", "fv", "fvm"), 3.0)
"""How many factors of 1 + 3 TOLERANCE fits look away from a nominal value, where not two: k1 goes
with the cube of the position, and friction differs from rig to rig by more than twice. (With four,
the refit bent so far for a cogging of 60 N m that its fit ended beside it.)"""

_ROUNDING = 1e-12
_AT_LIMIT = 0.01  # of the way from the nominal to the bound
_LEAST_LINK = 0.4  # of its inertia that a third mass leaves it at a start

_COARSE_CYCLES = 11
_ANOTHER = 2.0
_OTHERWISE = 0.2 * math.pi  # rad, of a ripple over the travel: a tenth of one more or less


def farthest(tolerance: float, scale: float = _SCALE) -> float:
    """Return how far above a nominal value a fit may go, relative to it, for its tolerance."""
    return float((1.0 + 3.0 * tolerance) ** scale - 1.0)


def possible_effects(nominal: Mapping[str, float]) -> list[str]:
    """Return the effects that a rig with these nominal parameters can have and a fit can find."""
    return [e.identifier for e in fx.CATALOGUE if e.starts and _free(e, nominal)]


def _free(effect: fx.Effect, nominal: Mapping[str, float]) -> list[str]:
    """Return the names that a fit of an effect may set; empty if the rig cannot have it.

    A rigid axis has nothing of transmission and link but what its one body has, and a held link
    has nothing; friction is added only where the nominal has none.
    """
    rigid, held = "k0" not in nominal, "j" not in nominal
    if not (
        effect.on_rigid_axis if rigid else effect.on_held_link if held else effect.on_flexible_axis
    ):
        return []
    free = [
        name
        for name, p in zip(effect.names, effect.parameters, strict=True)
        if not ((rigid or held) and p.of_link) and not (p.adds_to and nominal.get(p.adds_to))
    ]
    return free if set(free) & set(effect.size_names) else []


def starts(
    effect: str,
    scales: Scales,
    cycles: Sequence[float] | None = None,
    nominal: Mapping[str, float] | None = None,
) -> list[dict[str, float]]:
    """Return the starting points of an effect by full parameter name, within the fit's bounds.

    Args:
        effect: identifier.
        scales: of the record.
        cycles: ripples per turn of an angle-periodic effect; None for a coarse grid.
        nominal: bare parameters, which say what of the effect the rig can have; None for all.
    """
    points: list[dict[str, float]] = []
    entry = fx.EFFECTS[effect]
    free = entry.names if nominal is None else _free(entry, nominal)
    if cycles is None and entry.ripple:
        tried = scales.cycles()
        cycles = np.geomspace(tried[0], tried[-1], _COARSE_CYCLES).tolist()
    for start in entry.starts:
        grid: dict[str, tuple[float, ...]] = {}
        for name, parameter in zip(entry.names, entry.parameters, strict=True):
            if name not in free:
                continue
            if parameter.role == "cycles":
                grid[name] = tuple(cycles or ())
            elif parameter.name in start:
                values = np.array(start[parameter.name]) * scales.of(name)
                inside = np.clip(values, *scales.bounds(name))
                grid[name] = tuple(dict.fromkeys(inside.tolist()))
        points += [
            _on_lines(dict(zip(grid, values, strict=True)), scales)
            for values in itertools.product(*grid.values())
        ]
    shown = [p for p in points if any(p.get(name) for name in entry.size_names)]
    return list({tuple(point.items()): point for point in shown}.values())


def _on_lines(point: dict[str, float], scales: Scales) -> dict[str, float]:
    """Return a starting point whose falling limits are measured by those that the record reaches.

    Alone, either number of such a limit may be anything: it shows where both together cut.
    """
    for name, value in point.items():
        if speed := fx.parameter(name).falls_to:
            no_load = point[f"{name.split('.', 1)[0]}.{speed}"]
            reached = value / scales.of(name) * scales.stall_nm(no_load)
            point[name] = float(np.clip(reached, *scales.bounds(name)))
    return point


def beside(model: Model, seed: Mapping[str, float]) -> Model:
    """Return a model with a starting point of an effect more.

    A third mass is taken from the link: what low lines see is the sum.
    """
    mass = seed.get("extra_mode.inertia_kg_m2", 0.0)
    left = max(model.plant.get("j", 0.0) - mass, _LEAST_LINK * model.plant.get("j", 0.0))
    plant = {**model.plant, "j": left} if mass else model.plant
    return Model(plant, {**model.effects, **seed})


@dataclass(frozen=True)
class Space:
    """Free parameters of a model and how they map to numbers near 1.

    Base parameters are free on a logarithmic scale around the nominal value; effect parameters are
    free on a linear scale, in units of `units`.

    Attributes:
        nominal: nominal base parameters.
        effects: full names of the free effect parameters.
        units: scale of each, float64.
        tolerance: how far a nominal value may be off.
        scales: of the record; None: effects have no bounds but their physical limits.
        known: names of base parameters that are not free.
        cycles: ripples per turn, by full parameter name, from which a fit goes no further than by
            a factor of two, nor by a tenth of a ripple over the travel, either way: beyond, a
            ripple would be another one.
    """

    nominal: Mapping[str, float]
    effects: tuple[str, ...] = ()
    units: tuple[float, ...] = ()
    tolerance: float = TOLERANCE
    scales: Scales | None = None
    known: tuple[str, ...] = ()
    cycles: Mapping[str, float] = field(default_factory=dict)

    def model(self, x: np.ndarray) -> Model:
        """Return the model at a point."""
        base = {
            name: value * float(np.exp(step))
            for (name, value), step in zip(self.nominal.items(), x, strict=False)
        }
        values = x[len(self.nominal) :] * np.array(self.units)
        effects = {
            name: value if abs(value) >= least else 0.0
            for name, value, least in zip(self.effects, values.tolist(), self._least, strict=True)
        }
        return Model(base, effects)

    @cached_property
    def _least(self) -> list[float]:
        """Sizes below which the effects count as off."""
        return [self.scales.negligible(n) if self.scales else 0.0 for n in self.effects]

    def point(self, model: Model) -> np.ndarray:
        """Return the point of a model."""
        base = [
            np.log(model.plant[name] / value) if value else 0.0
            for name, value in self.nominal.items()
        ]
        values = [
            model.effects.get(name, fx.parameter(name).default) / unit
            for name, unit in zip(self.effects, self.units, strict=True)
        ]
        return np.array(base + values)

    def at_limits(self, x: np.ndarray) -> np.ndarray:
        """Return which base parameters are as far from the nominal as they may go, bool (base,)."""
        base = slice(len(self.nominal))
        low, high = (bound[base] for bound in self.bounds())
        left = np.minimum(x[base] - low, high - x[base])
        return np.asarray((low < high) & (left < _AT_LIMIT * high))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of a point."""
        low, high = [], []
        for name, value in self.nominal.items():
            free = value and name not in self.known
            far = np.log1p(farthest(self.tolerance, _SCALES.get(name, _SCALE))) if free else 0.0
            down, up = _within(name, value)
            low.append(-min(far, down))
            high.append(min(far, up))
        for name, unit in zip(self.effects, self.units, strict=True):
            parameter = fx.parameter(name)
            least, most = (parameter.low, parameter.high)
            if self.scales is not None:
                least, most = self.scales.bounds(name)
            if near := self.cycles.get(name):
                further = near + _OTHERWISE / self.scales.travel_rad if self.scales else math.inf
                less = 2.0 * near - further
                least, most = max(least, near / _ANOTHER, less), min(most, near * _ANOTHER, further)
            low.append(max(least / unit, -1e6))
            high.append(min(most / unit, 1e6))
        return np.array(low), np.array(high)


def _within(name: str, value: float) -> tuple[float, float]:
    """Return how far below and above a value the simulator takes a base parameter, logarithmic.

    A little less, so that rounding leaves it within; the inertia of a rigid axis, which is a sum,
    may lie above already.
    """
    low, high = PLANT[name].low, PLANT[name].high
    down = np.log(value / low) if value and low else np.inf
    up = np.log(high / value) if value else np.inf
    return max(float(down) - _ROUNDING, 0.0), max(float(up) - _ROUNDING, 0.0)


def space_for(
    nominal: Mapping[str, float],
    start: Mapping[str, float],
    scales: Scales,
    tolerance: float = TOLERANCE,
) -> Space:
    """Return the space in which a start's effect parameters are free, in units of the start.

    A parameter that starts at zero has the unit of its other starts. What the rig cannot have is
    left out.
    """
    own = {name.split(".", 1)[0] for name in start}
    free = {name for effect in own for name in _free(fx.EFFECTS[effect], nominal)}
    start = {name: value for name, value in start.items() if name in free}
    units = []
    for name, value in start.items():
        if fx.parameter(name).role == "angle":
            units.append(1.0)
        else:
            units.append(abs(value) or _usual(name) * scales.of(name))
    return Space(nominal, tuple(start), tuple(units), tolerance, scales)


def _usual(name: str) -> float:
    """Return the greatest relative start of a parameter by its full name, 1 if it has none."""
    effect, _, own = name.partition(".")
    given = [abs(v) for start in fx.EFFECTS[effect].starts for v in start.get(own, ())]
    return max(given, default=0.0) or 1.0
