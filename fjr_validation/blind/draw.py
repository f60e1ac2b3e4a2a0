"""An effect with its shape drawn at random and its size left free, relative to what a rig does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

Settings = dict[str, float]


@dataclass(frozen=True)
class Scales:
    """What a rig does at its highest level: the measures of sizes, SI units, rms unless said."""

    torque: float
    torque_peak: float
    torque_rate_peak: float
    speed: float
    speed_peak: float
    angle: float
    deflection: float
    coulomb: float  # level on the motor
    damping: float  # 2 sqrt(k J_eff), N m s/rad; critical damping of the resonance
    link_inertia: float
    resonance_hz: float
    band_hz: float
    crossover_hz: float


@dataclass(frozen=True)
class Draw:
    """An effect with its shape drawn and its size free.

    Attributes:
        name: identifier of the catalogue, or a name of ours outside it.
        settings: returns settings of the second plant, or values of its bare plant, for a size.
        start: a size to start searches from.
        most: greatest size that makes sense.
        same_as: catalogue parameter by setting, where both mean the same.
        lacking: values of the bare plant that the datasheet then lacks.
    """

    name: str
    settings: Callable[[float], Settings]
    start: float
    most: float
    same_as: Mapping[str, str] = field(default_factory=dict)
    lacking: tuple[str, ...] = ()

    def truth(self, settings: Mapping[str, float]) -> Settings:
        """Return the true values of the catalogue's parameters, as far as both mean the same."""
        return {self.same_as[name]: value for name, value in settings.items()
                if name in self.same_as}  # fmt: skip


Drawer = Callable[[np.random.Generator, Scales], Draw]


def linear(
    name: str, scaled: Settings, start: float, most: float, shape: Settings | None = None,
    same_as: Mapping[str, str] | None = None,
) -> Draw:  # fmt: skip
    """Return a draw whose settings are proportional to its size, beside a shape."""
    fixed = shape or {}

    def settings(size: float) -> Settings:
        return fixed | {setting: factor * size for setting, factor in scaled.items()}

    full = {ours: f"{name}.{theirs}" for ours, theirs in (same_as or {}).items()}
    return Draw(name, settings, start, most, full)


def sign(rng: np.random.Generator) -> float:
    """Return -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def phase(rng: np.random.Generator) -> float:
    """Return an angle in (-pi, pi)."""
    return float(rng.uniform(-np.pi, np.pi))
