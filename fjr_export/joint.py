"""The joint that is exported: a rig's parameters, the effects that are on, and what is left out."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fjr_interface.linear_axis import as_linear
from fjr_interface.parameter_file import load_parameter_file
from fjr_kit.errors import InputError
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation.simulator import SIMULATOR

_ENCODER_NOISE = ("noise_std_rad", "noise_snr_db")


@dataclass(frozen=True)
class Joint:
    """A flexible or rigid joint with its effects.

    Attributes:
        values: checked SIMULATOR values, those of effects that are left out included.
        sample_rate_hz: rate at which the joint is commanded.
        source: the file that it comes from.
        without: effects that the export leaves out.
        linear: whether it slides: its values are in m, N and kg where a joint that turns has rad,
            N m and kg m2.
    """

    values: Mapping[str, Any]
    sample_rate_hz: float
    source: str
    without: frozenset[str] = frozenset()
    linear: bool = False

    def in_units(self, text: str) -> str:
        """Return a text with units of a joint that turns in those of this one."""
        return as_linear(text) if self.linear else text

    @property
    def title(self) -> str:
        """The name of the file, for what is exported."""
        return Path(self.source).name

    @cached_property
    def exported(self) -> dict[str, Any]:
        """The values without the effects that are left out."""
        off = {
            name: SIMULATOR[name].default
            for identifier in self.without
            for name in effects.EFFECTS[identifier].names
        }
        return {**self.values, **off}

    @cached_property
    def bare(self) -> dict[str, float]:
        """The bare parameters by the names of PLANT, with what effects add to them."""
        return plant.with_added(self.exported)

    @property
    def one_body(self) -> bool:
        """Whether motor and link move as one; all inertia and friction are the motor's then."""
        return plant.moves_as_one(self.exported)

    @cached_property
    def body(self) -> dict[str, float]:
        """Inertia and friction of motor and link, those of a rigid axis all under the motor's."""
        sums = plant.rigid_sums(self.bare) if self.one_body else None
        return {**self.bare, **(sums or {})}

    @cached_property
    def effects_on(self) -> tuple[str, ...]:
        """The effects that are on and not left out, in the order of the catalogue."""
        return tuple(e.identifier for e in effects.CATALOGUE if self._is_on(e))

    def has(self, identifier: str) -> bool:
        """Tell whether an effect is on and not left out."""
        return identifier in self.effects_on

    def of(self, identifier: str) -> dict[str, float]:
        """Return the parameters of an effect by their short names."""
        effect = effects.EFFECTS[identifier]
        pairs = zip(effect.parameters, effect.names, strict=True)
        return {short.name: float(self.exported[name]) for short, name in pairs}

    @property
    def has_encoder_noise(self) -> bool:
        """Whether the file gives the encoder noise, which no export holds."""
        return any(self.values[name] != SIMULATOR[name].default for name in _ENCODER_NOISE)

    def _is_on(self, effect: effects.Effect) -> bool:
        return any(self.exported[name] != SIMULATOR[name].default for name in effect.size_names)


def read_joint(path: Path | str, without: Collection[str] = (), *, linear: bool = False) -> Joint:
    """Read the joint of a parameter file, such as the `updated.yaml` of a diagnosis.

    Args:
        path: ROS parameter file with values below /rig/simulator; others have their defaults.
        without: identifiers of effects to leave out.
        linear: whether it slides, see `Joint`.

    Raises:
        InputError: no such file, no simulator in it, an unknown name, a value out of range, a link
            that is held, or an unknown effect to leave out.
    """
    given = load_parameter_file(path).get("simulator")
    if given is None:
        raise InputError(
            f"{path}: /rig/simulator is missing; give the updated.yaml of a diagnosis, or write "
            "the joint's values below it."
        )
    effects.check_identifiers(without)
    values = SIMULATOR.check(given, f"{path}: /rig/simulator")
    if math.isinf(values["j"]):
        raise InputError(
            f"{path}: j is infinite, a link that is held; give the inertia j (kg m2) of the link "
            "that the joint is to move."
        )
    return Joint(values, float(values["sample_rate_hz"]), str(path), frozenset(without), linear)
