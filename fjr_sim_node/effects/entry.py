"""What the table says of one effect and of one of its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from fjr_interface.linear_axis import PER_TURN
from fjr_interface.parameters import Parameter

from .telltale import Telltale

if TYPE_CHECKING:
    from typing_extensions import Self

Part = Literal["motor", "transmission", "link", "drive", "encoder", "time"]
"""What of a rig an effect acts on."""
Role = Literal["size", "limit", "harmonic", "angle", "cycles", "shape"]
"""What a parameter is to a fit: a size is zero and a limit infinite while the effect is off; a
harmonic is the size of an optional second harmonic; an angle turns and has no size of its own;
cycles count ripples per turn."""
Start = Mapping[str, tuple[float, ...]]
"""Starting values by parameter name; all combinations are tried."""
FromPart = Callable[[Mapping[str, float], Mapping[str, float]], dict[str, float]]
"""Takes effect parameters by full name and bare parameters; returns effect parameters."""
AtVelocity = Callable[[np.ndarray], np.ndarray]
"""Takes velocities (rad/s); returns torques (N m) of a size of one."""


CONSTANT_TORQUE = "constant torque"
"""Family of near equivalents that follow laws of their own, of the angle or of direction, and look
alike only where the motion is short: there may be two of them. The members of any other family
differ by the form of one law."""


@dataclass(frozen=True)
class Load:
    """A torque on the joint that depends on nothing but the angle, linear in its sizes.

    Attributes:
        torques: takes angles (rad); returns the torque (N m) of each size of one.
        parameters: takes the sizes; returns the parameters of the effect by their short names, or
            None where no such load has these sizes.
    """

    torques: Callable[[np.ndarray], list[np.ndarray]]
    parameters: Callable[[Sequence[float]], dict[str, float] | None]


@dataclass(frozen=True)
class EffectParameter(Parameter):
    """One parameter of an effect.

    `low` and `high` are physical limits, in its unit. What fits need is relative to a scale of the
    record, which follows from the unit and the part that the effect acts on.

    Attributes:
        role: what it is to a fit.
        fit: narrower bounds than `low` and `high`, beyond which data say nothing or the loop
            diverges, relative; None for those.
        negligible: size below which the effect counts as off, since it would only make the plant
            stiff, relative.
        absolute: whether fits take it in its unit whatever the record, as what belongs to one turn.
        of_link: whether it belongs to the link alone, which a rigid axis does not have.
        falls_to: parameter of its effect, a speed at which this limit has fallen to zero: then its
            starts are relative to the limit that the record just reaches with that start. Empty
            for all others.
        adds_to: bare parameter that it adds to, for datasheets that lack it: fits free it only
            where that is zero. Empty for all others.
        at_velocity: friction of the motor at a velocity for a size of one, where it is proportional
            to the size; None for all others.
        usual: greatest size that machines have, in its unit; infinite where that depends on the
            machine. What is greater may be, but rather stands for something else.
    """

    role: Role = "shape"
    fit: tuple[float, float] | None = None
    negligible: float = 0.0
    absolute: bool = False
    of_link: bool = False
    falls_to: str = ""
    adds_to: str = ""
    at_velocity: AtVelocity | None = None
    usual: float = math.inf

    def fit_bounds(self, scale: float) -> tuple[float, float]:
        """Return the least and the greatest value that a fit may take.

        Args:
            scale: of the record, in the parameter's unit.
        """
        if self.fit is None:
            return self.low, self.high
        return max(self.low, self.fit[0] * scale), min(self.high, self.fit[1] * scale)

    def of_linear_axis(self) -> Self:
        """Return the parameter in its unit of a linear axis, where an angle is that of a phase."""
        if self.role == "angle":
            return self
        return replace(self, unit=PER_TURN) if self.role == "cycles" else super().of_linear_axis()

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
        telltale: how it shows in the data, and over what.
        source: where the parametrisation comes from.
        parameters: its parameters, sizes first; the defaults switch it off.
        starts: where fits begin, relative to the scales of the record (those of a limit to its
            greatest torque); empty for what only a gate looks for.
        looks_like: name of the family of effects that a motor-side encoder can hardly tell apart;
            empty if nothing is that near.
        looks_like_held: the same of effects that nothing tells apart while the link is held, where
            the deflection is the motor's angle.
        same_as: what it equals exactly, in words; empty if nothing.
        ripple: whether it is periodic in the motor angle, so that `cycles_per_turn` is searched.
        of_load: whether it goes with the torque in the gear.
        of_command: whether it changes a torque that is asked for: where none is, there is nothing
            to change.
        of_a_turn: whether it depends on the angle of a turn, so that a linear axis has none: weight
            is a constant force there.
        load: the torque on the joint if that depends on the angle alone; None for all others.
        scales: whether it scales the parameters of the bare plant: all of them everywhere, or about
            one angle; empty if it does not.
        contains: effects that it holds as limit cases, which explain what they can with less.
        from_part: where its fit begins if one of what it holds was fitted: its parameters by full
            name, from the parameters of that fit's effects and of its bare plant; None: as without.
        rarer_than: the commoner effect that is named where the data cannot tell it from this one.
        takes_from: the effect that does the part of both alone, so that no small step leads from a
            fit of that one to both, which begins with half its size in each; empty if steps do.
        modifies: the effect that brings in what this one changes, so that a rig which lacks that
            has nothing to change; empty if it stands by itself.
        on_request: whether a diagnosis looks for it only if it is asked to, or if a law that it
            contains leads.
        of_bare_plant: whether it is the bare plant with other values, so that its kernel is the
            bare one.
        axis: which axes can have it; empty: flexible ones if it acts on transmission or link, else
            both.
        settles_slowly: whether what it remembers may outlast the transient of the rig without it,
            so that a model with it is played from rest.
    """

    identifier: str
    summary: str
    acts_on: Part
    law: str
    telltale: Telltale
    source: str
    parameters: tuple[EffectParameter, ...]
    starts: tuple[Start, ...] = ()
    looks_like: str = ""
    looks_like_held: str = ""
    same_as: str = ""
    ripple: bool = False
    of_load: bool = False
    of_command: bool = False
    of_a_turn: bool = False
    load: Load | None = None
    scales: Literal["", "everywhere", "about one angle"] = ""
    contains: tuple[str, ...] = ()
    from_part: FromPart | None = None
    rarer_than: str = ""
    takes_from: str = ""
    modifies: str = ""
    on_request: bool = False
    of_bare_plant: bool = False
    axis: Literal["", "both", "rigid"] = ""
    settles_slowly: bool = False

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
    def by_its_own_law(self) -> bool:
        """Whether its near equivalents follow other laws than it, see `CONSTANT_TORQUE`."""
        return self.looks_like == CONSTANT_TORQUE

    @property
    def of_the_angle(self) -> bool:
        """Whether it is a torque on the joint that depends on the angle, and on nothing else."""
        return self.load is not None and len(self.load.torques(np.zeros(1))) > 1

    @property
    def depends_on_others(self) -> bool:
        """Whether what the effect changes depends much on the other causes beside it.

        Period and phase of a ripple are those of the error that these causes leave; a friction
        under load grows with the loads that they bring.
        """
        return self.ripple or self.of_load

    @property
    def on_rigid_axis(self) -> bool:
        """Whether a rig without a flexible transmission can have it."""
        return bool(self.axis) or self.acts_on not in ("transmission", "link")

    @property
    def on_flexible_axis(self) -> bool:
        """Whether a rig with a flexible transmission can have it."""
        return self.axis != "rigid"

    @property
    def on_held_link(self) -> bool:
        """Whether a rig with a flexible transmission whose link cannot move can have it."""
        return self.on_flexible_axis and self.acts_on != "link"

    @property
    def place_names(self) -> tuple[str, ...]:
        """Full names of what says where a ripple lies: laid down when the machine was made."""
        pairs = zip(self.names, self.parameters, strict=True)
        return tuple(n for n, p in pairs if self.ripple and p.role in ("cycles", "angle"))

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
    absolute: bool = False,
    adds_to: str = "",
    at_velocity: AtVelocity | None = None,
    usual: float = math.inf,
) -> EffectParameter:
    """Return a size: zero while the effect is off."""
    return EffectParameter(
        name, 0.0, unit, description, low, high,
        role="size", fit=fit, negligible=negligible, of_link=of_link, absolute=absolute,
        adds_to=adds_to, at_velocity=at_velocity, usual=usual,
    )  # fmt: skip


def angle(name: str, description: str) -> EffectParameter:
    """Return an angle in rad."""
    return EffectParameter(name, 0.0, "rad", description, -7.0, 7.0, role="angle")


QUARTERS = (0.0, 1.5707963267948966)
"""Phases of which any other is a sum."""


def ripple(name: str, unit: str, most: float, what: str) -> tuple[EffectParameter, ...]:
    """Return the parameters of what is periodic in the motor angle."""
    return (
        size(name, unit, f"Amplitude of {what}", 0.0, most),
        EffectParameter(
            "cycles_per_turn", 1.0, "", "Periods in one turn of the motor angle", 0.01, 1e6,
            role="cycles",
        ),
        angle("phase_rad", "Phase at angle zero"),
        EffectParameter(
            "second_ratio", 0.0, "", "Second harmonic over the first", 0.0, 10.0, role="harmonic"
        ),
        angle("second_phase_rad", "Phase of the second harmonic where the first is zero and rises"),
    )  # fmt: skip


def ripple_starts(name: str, amplitude: float) -> tuple[Start, ...]:
    """Return the starts of what is periodic in the motor angle, cycles left to the record."""
    return ({name: (amplitude,), "phase_rad": QUARTERS},)
