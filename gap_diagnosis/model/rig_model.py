"""The simulated rig's free parameters: bare plant times a few effects, and how stiff they are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fjr_sim_node import effects as fx
from fjr_sim_node import plant

_OF_LINK = ("j", "fs", "fv")
_MOST_STEPS, _MOST_STEPS_A_SAMPLE = 1e6, 20.0  # of the integration of one run


@dataclass(frozen=True)
class Model:
    """A plant with effects; immutable.

    Attributes:
        plant: the bare parameters by name (PLANT).
        effects: parameters of effects by full name (`effect.parameter`); missing ones are off.
    """

    plant: Mapping[str, float]
    effects: Mapping[str, float]

    @classmethod
    def nominal(cls, values: Mapping[str, Any]) -> Model:
        """Return the bare model with checked PLANT values.

        An infinite stiffness k0 means a rigid axis: motor and link are one body, of which only the
        sums of inertia and friction count; an infinite link inertia j means a held link.
        """
        sums = plant.rigid_sums(values)
        if sums is not None:
            return cls(sums, {})
        own = {name: float(values[name]) for name in plant.PLANT.names}
        if math.isinf(own["j"]):
            own = {name: value for name, value in own.items() if name not in _OF_LINK}
        return cls(own, {})

    @property
    def rigid(self) -> bool:
        """Whether there is no flexible transmission."""
        return "k0" not in self.plant

    def with_effects(self, effects: Mapping[str, float]) -> Model:
        """Return the model with further effect parameters set."""
        return replace(self, effects={**self.effects, **effects})

    @property
    def settles_slowly(self) -> bool:
        """Whether an effect remembers what may be longer past than the rig takes to settle."""
        return any(fx.EFFECTS[name.split(".")[0]].settles_slowly for name in self.effects)

    @property
    def whole_plant(self) -> dict[str, float]:
        """All bare parameters by the names of PLANT, those of a rigid axis or held link as well."""
        none = dict.fromkeys(plant.PLANT.names, 0.0)
        held = {} if self.rigid else {"j": math.inf}
        return {**none, "k0": math.inf, **held, **self.plant}

    @property
    def link_moves(self) -> bool:
        """Whether it has a link that moves apart from the motor."""
        return "j" in self.plant

    @property
    def rounds(self) -> bool:
        """Whether its encoder counts in coarse steps."""
        return any(name.startswith("encoder_quantization.") for name in self.effects)

    @property
    def smooth(self) -> Model:
        """The same with an encoder that does not round."""
        left = {n: v for n, v in self.effects.items() if not n.startswith("encoder_quantization.")}
        return replace(self, effects=left)

    @property
    def plant_coefficients(self) -> tuple[float, ...]:
        """Bare parameters as the compiled plant takes them."""
        return plant.coefficients({**self.whole_plant, **self.effects})

    @property
    def one_body(self) -> bool:
        """Whether motor and link move as one."""
        return plant.moves_as_one({"k0": math.inf, **self.plant, **self.effects})

    @property
    def effect_coefficients(self) -> np.ndarray | None:
        """Effects as the compiled plant takes them; None if all are off."""
        return fx.coefficients(self.effects)


def steps_a_sample(
    model: Model, sample_rate_hz: float, speed: float = 0.0, torque: float = 0.0
) -> float:
    """Return how many steps the integration of a sample takes.

    Args:
        model: the model.
        sample_rate_hz: rate of the samples.
        speed: of the motor (rad/s).
        torque: motor torque (N m).
    """
    p, e = model.plant_coefficients, model.effect_coefficients
    return plant.steps_per_second(speed, torque, p, e) / sample_rate_hz


def too_stiff(
    model: Model, samples: int, sample_rate_hz: float, speed: float, torque: float
) -> bool:
    """Tell whether a model would take so long to play as no record can call for.

    Args:
        model: the model.
        samples: of the run.
        sample_rate_hz: their rate.
        speed: rms speed of the motor (rad/s).
        torque: greatest torque (N m).
    """
    steps = samples * steps_a_sample(model, sample_rate_hz, speed, torque)
    return steps > max(_MOST_STEPS, _MOST_STEPS_A_SAMPLE * samples)
