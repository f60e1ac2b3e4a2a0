"""From which values an effect is fitted: several starting points each, and natural scales."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fjr_sim_node import effects as fx
from fjr_sim_node import plant

from .model import Model

TOLERANCE = 0.1
"""How far a datasheet value may be off; fits look further, since a torque constant that is off
scales all values, and an encoder whose gain is off (an eccentric one, locally) once more."""

_SCALES = {"k1": 3.0}
"""How many factors of 1 + 3 TOLERANCE fits look away from a nominal value, where not two: k1 goes
with the cube of the position."""

_CYCLES = (1.0, 2.0, 4.0, 8.0, 16.0, 24.0, 36.0, 52.0, 72.0, 96.0, 120.0)
"""Ripples per turn to try where the loop cannot be repeated; else `ripples` finds better."""

_MODES_HZ = tuple(np.geomspace(4.0, 100.0, 44).tolist())
"""Frequencies of a light third mass, which shows in a band as narrow as its damping."""

_SHARES = (0.15, 0.25, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.94, 0.97, 1.0, 1.04, 1.1)
"""Torque limits over the greatest commanded torque: which peaks are clipped changes from one to
the next, and a knee is felt below its limit."""

_LEAST_LINK = 0.4  # of its inertia that a third mass leaves it at a start

STARTS: dict[str, tuple[dict[str, tuple[float, ...]], ...]] = {
    "stribeck_friction_motor": ({"torque_nm": (0.3, 2.0), "velocity_rad_s": (0.02, 0.1, 0.5)},),
    "stribeck_friction_link": ({"torque_nm": (0.3, 2.0), "velocity_rad_s": (0.02, 0.1, 0.5)},),
    "asymmetric_friction": (
        {"coulomb_nm": (0.3,), "viscous_nm_s_rad": (0.0,)},
        {"coulomb_nm": (0.0,), "viscous_nm_s_rad": (0.2,)},
    ),
    "torque_bias": ({"torque_nm": (0.3,)},),
    "presliding_friction": (
        {"motor_rad": (2e-5, 2e-4, 2e-3), "link_rad": (2e-5, 2e-4, 2e-3)},
    ),  # a side that starts below what is negligible never leaves it
    "load_friction": ({"coefficient": (0.01, 0.05)},),
    "position_friction": (
        {
            "amplitude_nm": (0.3,),
            "cycles_per_turn": _CYCLES,
            "phase_rad": (0.0, np.pi / 2),
        },
    ),
    "quadratic_friction": (
        {"motor_nm_s2_rad2": (0.05,), "link_nm_s2_rad2": (0.0,)},
        {"motor_nm_s2_rad2": (0.0,), "link_nm_s2_rad2": (0.05,)},
    ),
    "backlash": ({"half_gap_rad": (2e-4, 1e-3, 4e-3)},),
    "piecewise_stiffness": ({"zone_rad": (1e-3, 4e-3, 2e-2, 6e-2), "soft_ratio": (0.4, 0.9)},),
    "hysteresis": ({"torque_nm": (0.5, 4.0), "displacement_rad": (3e-4, 3e-3, 2e-2)},),
    "transmission_damping": ({"nm_s_rad": (0.1, 1.0)},),
    "kinematic_error": (
        {
            "amplitude_rad": (3e-4,),
            "cycles_per_turn": _CYCLES,
            "phase_rad": (0.0, np.pi / 2),
        },
    ),
    "extra_mode": (
        {"inertia_kg_m2": (1e-3,), "frequency_hz": _MODES_HZ, "damping_ratio": (0.03,)},
        {
            "inertia_kg_m2": (2e-2,),
            "frequency_hz": (8.0, 15.0, 22.0, 30.0, 40.0, 55.0),
            "damping_ratio": (0.03,),
        },
    ),
    "gravity": ({"torque_nm": (0.5, 4.0), "angle_rad": (0.0, np.pi / 2, np.pi)},),
    "cogging": (
        {
            "amplitude_nm": (0.3,),
            "cycles_per_turn": _CYCLES,
            "phase_rad": (0.0, np.pi / 2),
        },
    ),
    "delay": ({"time_s": (1e-4, 5e-4)},),
    "actuator_lag": ({"time_constant_s": (1e-4, 5e-4)},),
    "torque_saturation": ({"limit_nm": _SHARES, "knee": (0.1,)},),  # of the peak: see `starts`
    "torque_gain": ({"relative_error": (0.05,)},),
    "encoder_quantization": ({"resolution_rad": (1e-4, 5e-4)},),
    "encoder_eccentricity": ({"amplitude_rad": (1e-3, 3e-2), "phase_rad": (0.0, np.pi / 2)},),
}
"""Grids of starting values of each effect that can be fitted; nonstationarity is a gate."""


FIT_BOUNDS: dict[str, tuple[float, float]] = {
    "stribeck_friction_motor.velocity_rad_s": (0.01, 5.0),
    "stribeck_friction_link.velocity_rad_s": (0.01, 5.0),
    "hysteresis.displacement_rad": (5e-5, 0.3),
    "position_friction.cycles_per_turn": (0.3, 250.0),
    "kinematic_error.cycles_per_turn": (0.3, 250.0),
    "cogging.cycles_per_turn": (0.3, 250.0),
    "extra_mode.frequency_hz": (2.0, 120.0),
    "extra_mode.damping_ratio": (0.0, 0.5),
    "delay.time_s": (0.0, 2e-3),
    "actuator_lag.time_constant_s": (0.0, 5e-3),
    "load_friction.coefficient": (0.0, 0.5),
}
"""Narrower bounds of shape parameters: beyond them the data say nothing, or the loop diverges."""

NEGLIGIBLE: dict[str, float] = {
    "presliding_friction.motor_rad": 2e-6,
    "presliding_friction.link_rad": 2e-6,
    "actuator_lag.time_constant_s": 5e-6,
}
"""Sizes below which an effect counts as off, since it would only make the plant stiff."""


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
    for grid in STARTS[effect]:
        if effect == "torque_saturation":
            grid = {**grid, "limit_nm": tuple(s * peak_torque_nm for s in grid["limit_nm"])}
        if cycles is not None and "cycles_per_turn" in grid:
            grid = {**grid, "cycles_per_turn": tuple(cycles)}
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
            name: value if abs(value) >= NEGLIGIBLE.get(name, 0.0) else 0.0
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
            model.effects.get(name, _DEFAULT[name]) / unit
            for name, unit in zip(self.effects, self.units, strict=True)
        ]
        return np.array(base + values)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of a point."""
        scale = np.log1p(3.0 * self.tolerance)
        far = [_SCALES.get(n, 2.0) * scale if v else 0.0 for n, v in self.nominal.items()]
        low, high = [-f for f in far], far
        for name, unit in zip(self.effects, self.units, strict=True):
            parameter = _PARAMETER[name]
            least, most = FIT_BOUNDS.get(name, (parameter.low, parameter.high))
            low.append(max(least / unit, -1e6))
            high.append(min(most / unit, 1e6))
        return np.array(low), np.array(high)


_PARAMETER = {parameter.name: parameter for parameter in fx.PARAMETERS}
_DEFAULT = {parameter.name: float(parameter.default) for parameter in fx.PARAMETERS}


def space_for(nominal: Mapping[str, float], start: Mapping[str, float]) -> Space:
    """Return the space in which a start's effect parameters are free, in units of the start.

    A parameter that starts at zero has the unit of the other sizes of its effect, or 1. A rigid
    axis has no parameters of the link.
    """
    if "k0" not in nominal:
        start = {name: value for name, value in start.items() if ".link_" not in name}
    units = []
    for name, value in start.items():
        effect = fx.EFFECTS[name.split(".", 1)[0]]
        if name.endswith(("phase_rad", "angle_rad")):
            units.append(1.0)
        elif value:
            units.append(abs(value))
        else:
            sizes = [abs(start[n]) for n in effect.names[: effect.sizes] if start.get(n)]
            units.append(max(sizes) if sizes else 1.0)
    return Space(nominal, tuple(start), tuple(units))


BASE = plant.PLANT.names
