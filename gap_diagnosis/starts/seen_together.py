"""Frictions, a load and inertia, seen together in the torque that a model lacks along a motion.

Of a joint whose datasheet is an inertia alone these hide each other: each fitted alone does a part
of what all do. The regression of a rigid robot sees them at once (Gautier, Khalil 1988, IEEE ICRA).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from fjr_sim_node import effects as fx

from ..model.rig_model import Model

_LOADS: Mapping[str, fx.Load] = {e.identifier: e.load for e in fx.CATALOGUE if e.load}
LOADS = tuple(sorted(_LOADS, key=lambda load: len(_LOADS[load].torques(np.zeros(1)))))
"""Effects whose torque does not depend on the motion but for the angle, the plainest first."""
LAWS: Mapping[str, fx.AtVelocity] = {p.name: p.at_velocity for p in fx.PARAMETERS if p.at_velocity}
"""Laws of friction whose torque at a velocity is proportional to their size."""
LACKED = tuple(effect.identifier for effect in fx.FRICTION if effect.of_bare_plant)
"""Frictions that a datasheet of inertias lacks."""
_FALLING, _FALLS_AT = "stribeck_friction_motor.torque_nm", "stribeck_friction_motor.velocity_rad_s"
_FALLEN = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Of the usual speed: where friction may have fallen from breakaway."""
_OF_LOAD = "load_friction.coefficient"
_SLIGHT = 1e-6  # of the squares of the torque: less of it says nothing
_NO_WORSE, _NEARLY_AS_WELL = 1.05, 1.3
"""Squares that are left over those of the best: a friction that explains no more is not needed; a
load that leaves no more does as well, and what falls from breakaway must leave so much less."""


@dataclass(frozen=True)
class Seen:
    """The torque that a model lacks along a recorded motion, where friction slides.

    Attributes:
        model: the model.
        angle, velocity, acceleration: (samples,), of the motor.
        missing: (places,), as it is seen there, N m.
        seen: makes of a torque, (samples,), what is seen of it, (places,).
        inertia: whether that of the model may be wrong.
    """

    model: Model
    angle: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    missing: np.ndarray
    seen: Callable[[np.ndarray], np.ndarray] = lambda torque: torque
    inertia: bool = True

    def together(self, effects: Sequence[str]) -> list[tuple[tuple[str, ...], Model]]:
        """Return what only together explains the torque, each set with a model that has it.

        Args:
            effects: identifiers of what may be there.

        Returns:
            Sets of two effects or more, the load last: the plainest one that does nearly as well as
            the best, and those as plain; the set that explains most first. After each the same with
            the frictions that every joint has, and no others: along moves of one speed they look
            like rarer ones, or like each other, and only fits tell which is there.
        """
        return self._explaining(self._laws(effects), effects, {})

    def falling(self, effects: Sequence[str]) -> list[tuple[tuple[str, ...], Model]]:
        """Return the same with friction that falls from breakaway, where that leaves much less.

        Args:
            effects: identifiers of what may be there.
        """
        if not {"coulomb_friction", _effect(_FALLING)} <= set(effects):
            return []
        laws, loads = self._laws(effects), self._loads(effects)
        usual = float(np.sqrt(np.mean(self.velocity**2)))
        left = min(self._regressed(laws, load)[1] for load in loads)
        found = []
        for velocity in (usual * share for share in _FALLEN):
            falls = -np.sign(self.velocity) * np.exp(-((self.velocity / velocity) ** 2))
            with_it = {**laws, _FALLING: self.seen(falls)}
            found.append(
                (min(self._regressed(with_it, load)[1] for load in loads), velocity, with_it)
            )
        least, velocity, with_it = min(found, key=lambda f: f[0])
        if _NEARLY_AS_WELL * least > left:
            return []
        sets = self._explaining(with_it, effects, {_FALLS_AT: velocity})
        return [one for one in sets if {"coulomb_friction", _effect(_FALLING)} <= set(one[0])]

    def _laws(self, effects: Sequence[str]) -> dict[str, np.ndarray]:
        """Return what is seen of each law of friction, (places,), for a size of one."""
        may_be = [name for name in LAWS if _effect(name) in effects]
        return {name: self.seen(LAWS[name](self.velocity)) for name in may_be}

    @staticmethod
    def _loads(effects: Sequence[str]) -> list[str]:
        """Return what may load the joint, nothing first; a law of parts goes with its parts."""
        every = {*effects, *(holder for effect in effects for holder in fx.holders(effect))}
        return ["", *(load for load in LOADS if load in every)]

    def _explaining(
        self, laws: Mapping[str, np.ndarray], effects: Sequence[str], shape: Mapping[str, float]
    ) -> list[tuple[tuple[str, ...], Model]]:
        """Return the sets of `together`.

        Args:
            laws: what is seen of each that may be needed, the commonest first.
            effects: identifiers of what may be there.
            shape: further parameters of the laws.
        """
        loads = self._loads(effects)
        left = {load: self._regressed(laws, load)[1] for load in loads}
        alike = [load for load in loads if left[load] <= _NEARLY_AS_WELL * min(left.values())]
        fewest = min(len(load_torques(load, self.angle)) for load in alike)
        plain = [load for load in alike if len(load_torques(load, self.angle)) == fewest]
        found = []
        for load in sorted(plain, key=lambda load: left[load]):
            needed = self._needed(laws, load, effects)
            common = [name for name in laws if _effect(name) in LACKED]
            sets = [needed] if {*needed} <= {*common} else [needed, common]
            for frictions in sets:
                names = [_effect(name) for name in frictions] + ([load] if load else [])
                own = {n: v for n, v in shape.items() if _effect(n) in names}
                models = [self._regressed({n: laws.get(n) for n in frictions}, load)[0]]
                if frictions == common and models[0] is not None:
                    nothing = [n for n in common if not models[0].effects.get(n)]
                    models += [self._regressed({n: laws[n]}, load)[0] for n in nothing]
                if len(names) > 1:
                    each = [model for model in models if model is not None]
                    found += [(tuple(names), model.with_effects(own)) for model in each]
        return found

    def _needed(
        self, laws: Mapping[str, np.ndarray], load: str, effects: Sequence[str]
    ) -> list[str]:
        """Return the laws, and that of friction under load, without which more is left.

        Of several that are not needed the rarest goes first: a drag that grows with the square of
        speed before viscous friction, friction under a constant load before Coulomb friction.
        """
        needed = list(laws)
        if load and _effect(_OF_LOAD) in effects:
            needed.append(_OF_LOAD)

        def left(names: Sequence[str]) -> float:
            return self._regressed({n: laws.get(n) for n in names}, load)[1]

        least = _NO_WORSE * left(needed)
        while needed:
            fewer = ([o for o in needed if o != name] for name in reversed(needed))
            rest = next((names for names in fewer if left(names) <= least), None)
            if rest is None:
                break
            needed = rest
        return needed

    def _regressed(
        self, laws: Mapping[str, np.ndarray | None], load: str
    ) -> tuple[Model | None, float]:
        """Return the model with laws and a load, inertia solved, too, and the squares left.

        No friction is below zero. Friction under load is that of the load which the laws without it
        leave. No model where a spring pushes.
        """
        columns = [seen for seen in laws.values() if seen is not None]
        order, frictions = [name for name in laws if name != _OF_LOAD], len(columns)
        columns += [self.seen(-self.acceleration)] if self.inertia else []
        carried = load_torques(load, self.angle)
        first = len(columns)
        columns += [self.seen(torque) for torque in carried]
        sizes, left = solved(columns, self.missing, frictions)
        if _OF_LOAD in laws:
            weight = np.abs(np.array(carried).T @ sizes[first:])
            columns.insert(frictions, self.seen(-np.sign(self.velocity) * weight))
            order.append(_OF_LOAD)
            sizes, left = solved(columns, self.missing, len(order))
        left = max(left, _SLIGHT * float(np.sum(self.missing**2)))
        rest = sizes[len(order) :]
        inertia = rest.pop(0) if self.inertia else 0.0
        seed = load_parameters(load, rest)
        if seed is None:
            return None, left
        found = {name: size for name, size in zip(order, sizes, strict=False) if size}
        return heavier(self.model, inertia, {**found, **seed}), left


def lacked(plant: Mapping[str, float]) -> frozenset[str]:
    """Return the frictions of `LACKED` that a datasheet has nowhere, by the names of PLANT."""
    adds = {e: [fx.parameter(name).adds_to for name in fx.EFFECTS[e].names] for e in LACKED}
    return frozenset(e for e, names in adds.items() if not any(plant.get(n or "") for n in names))


def load_torques(load: str, angle: np.ndarray) -> list[np.ndarray]:
    """Return the torques of a load at angles, for sizes of one; none for no load."""
    return _LOADS[load].torques(angle) if load else []


def load_parameters(load: str, sizes: Sequence[float]) -> dict[str, float] | None:
    """Return the parameters of a load by sizes of its torques; None for a spring that pushes."""
    if not load:
        return {}
    found = _LOADS[load].parameters(sizes)
    return found and {f"{load}.{name}": value for name, value in found.items()}


def solved(
    columns: Sequence[np.ndarray], torque: np.ndarray, positive: int = 0
) -> tuple[list[float], float]:
    """Return by least squares how much of each column is in a torque, and the squares left.

    Args:
        columns: (rows,) each.
        torque: (rows,).
        positive: so many of the first are not below zero.
    """
    if not columns:
        return [], float(np.sum(torque**2))
    scales = [float(np.sqrt(np.mean(column**2))) or 1.0 for column in columns]
    scaled = np.array(columns).T / scales
    corner = np.linalg.qr(np.column_stack([scaled, torque])).R  # as good as all rows
    if positive:
        least = np.where(np.arange(len(scales)) < positive, 0.0, -np.inf)
        sizes = lsq_linear(corner[:, :-1], corner[:, -1], (least, np.inf), method="bvls").x
    else:
        sizes = np.linalg.lstsq(corner[:, :-1], corner[:, -1], rcond=1e-9)[0]
    return (sizes / scales).tolist(), float(np.sum((torque - scaled @ sizes) ** 2))


def heavier(model: Model, inertia: float, sizes: Mapping[str, float]) -> Model | None:
    """Return a model with more inertia and with sizes of effects; None if no inertia is left."""
    plant = model.plant
    total = plant["jm"] + plant.get("j", 0.0)
    if not total + inertia > 0.0:
        return None
    masses = {n: plant[n] * (1.0 + inertia / total) for n in ("jm", "j") if n in plant}
    return Model({**plant, **masses}, {**model.effects, **sizes})


def _effect(parameter: str) -> str:
    return parameter.split(".")[0]
