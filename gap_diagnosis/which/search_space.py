"""From which values an effect is fitted: several starting points each, and natural scales."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_sim_node import effects as fx

from ..model.simulated_rig import Model

TOLERANCE = 0.1
"""How far a datasheet value may be off; fits look further, since a torque constant that is off
scales all values, and an encoder whose gain is off (an eccentric one, locally) once more."""

_SCALES = {"k1": 3.0}
"""How many factors of 1 + 3 TOLERANCE fits look away from a nominal value, where not two: k1 goes
with the cube of the position."""

_LEAST_LINK = 0.4  # of its inertia that a third mass leaves it at a start


def starts(
    effect: str, peak_torque_nm: float, cycles: Sequence[float] | None = None
) -> list[dict[str, float]]:
    """Return the starting points of an effect by full parameter name.

    Args:
        effect: identifier.
        peak_torque_nm: greatest torque of the record; a drive that saturates does so below it,
            and far below where the loop then asks for more.
        cycles: ripples per turn of an angle-periodic effect; None for a coarse grid.
    """
    points = []
    entry = fx.EFFECTS[effect]
    limits = [p.name for p in entry.parameters if p.role == "limit"]
    for start in entry.starts:
        grid = dict(start)
        for name in limits:
            grid[name] = tuple(share * peak_torque_nm for share in grid[name])
        if cycles is not None and "cycles_per_turn" in grid:
            grid["cycles_per_turn"] = tuple(cycles)
        for values in itertools.product(*grid.values()):
            names = (f"{effect}.{name}" for name in grid)
            points.append(dict(zip(names, values, strict=True)))
    return points


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
    """

    nominal: Mapping[str, float]
    effects: tuple[str, ...] = ()
    units: tuple[float, ...] = ()
    tolerance: float = TOLERANCE

    def model(self, x: np.ndarray) -> Model:
        """Return the model at a point."""
        base = {
            name: value * float(np.exp(step))
            for (name, value), step in zip(self.nominal.items(), x, strict=False)
        }
        values = x[len(self.nominal) :] * np.array(self.units)
        effects = {
            name: value if abs(value) >= fx.parameter(name).negligible else 0.0
            for name, value in zip(self.effects, values.tolist(), strict=True)
        }
        return Model(base, effects)

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

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of a point."""
        scale = np.log1p(3.0 * self.tolerance)
        far = [_SCALES.get(n, 2.0) * scale if v else 0.0 for n, v in self.nominal.items()]
        low, high = [-f for f in far], far
        for name, unit in zip(self.effects, self.units, strict=True):
            least, most = fx.parameter(name).fit_bounds
            low.append(max(least / unit, -1e6))
            high.append(min(most / unit, 1e6))
        return np.array(low), np.array(high)


def space_for(nominal: Mapping[str, float], start: Mapping[str, float]) -> Space:
    """Return the space in which a start's effect parameters are free, in units of the start.

    A parameter that starts at zero has the unit of the other sizes of its effect, or 1. A rigid
    axis has no parameters of the link.
    """
    if "k0" not in nominal:
        start = {name: value for name, value in start.items() if not fx.parameter(name).of_link}
    units = []
    for name, value in start.items():
        effect = fx.EFFECTS[name.split(".", 1)[0]]
        if fx.parameter(name).role == "angle":
            units.append(1.0)
        elif value:
            units.append(abs(value))
        else:
            sizes = [abs(start[n]) for n in effect.size_names if start.get(n)]
            units.append(max(sizes) if sizes else 1.0)
    return Space(nominal, tuple(start), tuple(units))
