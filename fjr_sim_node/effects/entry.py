"""What the table says of one effect and of one of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from fjr_interface.parameters import Parameter

Part = Literal["motor", "transmission", "link", "drive", "encoder", "time"]
"""What of a rig an effect acts on."""
Role = Literal["size", "limit", "harmonic", "angle", "shape"]
"""What a parameter is to a fit: a size is zero and a limit infinite while the effect is off; a
harmonic is the size of an optional second harmonic; an angle turns and has no size of its own."""
Start = Mapping[str, tuple[float, ...]]
"""Starting values by parameter name; all combinations are tried."""


@dataclass(frozen=True)
class EffectParameter(Parameter):
    """One parameter of an effect.

    Attributes:
        role: what it is to a fit.
        fit: narrower bounds than `low` and `high`, beyond which data say nothing or the loop
            diverges; None for those.
        negligible: size below which the effect counts as off, since it would only make the plant
            stiff.
        of_link: whether it belongs to the link alone, which a rigid axis does not have.
    """

    role: Role = "shape"
    fit: tuple[float, float] | None = None
    negligible: float = 0.0
    of_link: bool = False

    @property
    def fit_bounds(self) -> tuple[float, float]:
        """Least and greatest value that a fit may take."""
        return self.fit or (self.low, self.high)

    @property
    def may_be_negative(self) -> bool:
        """Whether the effect has two directions."""
        return self.low < 0.0


@dataclass(frozen=True, eq=False)
class Effect:
    """One entry of the table.

    Attributes:
        identifier: its fixed name.
        summary: what it is, one sentence.
        acts_on: the part of the rig.
        law: the compiled function that holds it, `module:function` within `fjr_sim_node`.
        telltale: how it shows in the data.
        source: where the parametrisation comes from.
        parameters: its parameters, sizes first; the defaults switch it off.
        starts: where fits begin; empty for what only a gate looks for. Starts of a limit are
            shares of the greatest torque of the record.
        looks_like: name of the family of effects that a motor-side encoder can hardly tell apart;
            empty if nothing is that near.
        same_as: what it equals exactly, in words; empty if nothing.
        ripple: whether it is periodic in the motor angle, so that `cycles_per_turn` is searched.
        scales: whether it scales the parameters of the bare plant, wholly or about one angle.
    """

    identifier: str
    summary: str
    acts_on: Part
    law: str
    telltale: str
    source: str
    parameters: tuple[EffectParameter, ...]
    starts: tuple[Start, ...] = ()
    looks_like: str = ""
    same_as: str = ""
    ripple: bool = False
    scales: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Full names of the parameters, `effect.parameter`."""
        return tuple(f"{self.identifier}.{parameter.name}" for parameter in self.parameters)

    @property
    def size_names(self) -> tuple[str, ...]:
        """Full names of sizes and limits: the parameters that switch the effect off."""
        pairs = zip(self.names, self.parameters, strict=True)
        return tuple(name for name, p in pairs if p.role in ("size", "limit"))

    @property
    def on_rigid_axis(self) -> bool:
        """Whether a rig without a flexible transmission can have it."""
        return self.acts_on not in ("transmission", "link")

    @property
    def full_parameters(self) -> tuple[EffectParameter, ...]:
        """The parameters under their full names, described with their effect."""
        return tuple(
            replace(p, name=name, description=f"{self.summary} {p.description}", source=self.source)
            for name, p in zip(self.names, self.parameters, strict=True)
        )


def size(
    name: str,
    unit: str,
    description: str,
    low: float = 0.0,
    high: float = 1e4,
    *,
    negligible: float = 0.0,
    of_link: bool = False,
    fit: tuple[float, float] | None = None,
) -> EffectParameter:
    """Return a size: zero while the effect is off."""
    return EffectParameter(
        name, 0.0, unit, description, low, high,
        role="size", fit=fit, negligible=negligible, of_link=of_link,
    )  # fmt: skip


def angle(name: str, description: str) -> EffectParameter:
    """Return an angle in rad."""
    return EffectParameter(name, 0.0, "rad", description, -7.0, 7.0, role="angle")


_CYCLES = (1.0, 2.0, 4.0, 8.0, 16.0, 24.0, 36.0, 52.0, 72.0, 96.0, 120.0)
"""Ripples per turn to try where the loop cannot be repeated; else a search finds better."""
QUARTERS = (0.0, 1.5707963267948966)
"""Phases of which any other is a sum."""


def ripple(name: str, unit: str, most: float, what: str) -> tuple[EffectParameter, ...]:
    """Return the parameters of what is periodic in the motor angle."""
    return (
        size(name, unit, f"Amplitude of {what}", 0.0, most),
        EffectParameter(
            "cycles_per_turn", 1.0, "", "Periods in one turn of the motor angle", 0.01, 1e4,
            fit=(0.3, 250.0),
        ),
        angle("phase_rad", "Phase at angle zero"),
        EffectParameter(
            "second_ratio", 0.0, "", "Second harmonic over the first", 0.0, 10.0, role="harmonic"
        ),
        angle("second_phase_rad", "Phase of the second harmonic where the first is zero and rises"),
    )  # fmt: skip


def ripple_starts(name: str, amplitude: float) -> tuple[Start, ...]:
    """Return the coarse grid of starts of what is periodic in the motor angle."""
    return ({name: (amplitude,), "cycles_per_turn": _CYCLES, "phase_rad": QUARTERS},)
