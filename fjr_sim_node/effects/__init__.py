"""The table of effects that the bare plant lacks: one entry for each, and nothing said elsewhere.

An entry (`entry.Effect`) holds identifier, law, parameters with unit, bounds and source, what the
effect acts on and depends on, starts of fits, near and exact equivalents, and `telltale`. Node
parameters, parameter files, fits, documents and reports all read it. To add an effect, add its
entry to `friction`, `transmission` or `drive` and write its law (in `plant` or `simulation.rig`),
where `fx.EFFECT_PARAMETER`, in capitals, is the place of a parameter among the coefficients. What
is the bare plant with other values (friction that a datasheet lacks) needs no kernel:
`plant.with_added`.

After the parameters stand three switches, one for the laws of each of these families in `plant`:
where none of them is on, they are passed over at once, and where no family is, the plant that is
integrated is the bare one.

An effect is off while its sizes have their defaults; then the plant is the bare one, bit for bit.
Parameter names in files and in ROS are `effect.parameter`. `document` writes the table of effects.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from fjr_interface.parameters import nearest
from fjr_kit.errors import InputError, shown

from .drive import DRIVE, ENCODER
from .entry import AtVelocity, Effect, EffectParameter, Load
from .friction import FRICTION
from .telltale import QUANTITIES, Over, Telltale
from .transmission import TRANSMISSION

__all__ = [
    "CATALOGUE",
    "DEFAULTS",
    "EFFECTS",
    "NAMES",
    "PARAMETERS",
    "QUANTITIES",
    "AtVelocity",
    "Effect",
    "EffectParameter",
    "Load",
    "Over",
    "Telltale",
    "check_identifiers",
    "coefficients",
    "contains",
    "holders",
    "near_equivalents",
    "parameter",
    "rare",
]

CATALOGUE: tuple[Effect, ...] = (*FRICTION, *TRANSMISSION, *DRIVE, *ENCODER)
"""All effects."""

EFFECTS: dict[str, Effect] = {effect.identifier: effect for effect in CATALOGUE}

PARAMETERS: tuple[EffectParameter, ...] = tuple(
    parameter for effect in CATALOGUE for parameter in effect.full_parameters
)
"""The parameters of all effects under their full names."""

NAMES: tuple[str, ...] = tuple(parameter.name for parameter in PARAMETERS)
DEFAULTS: tuple[float, ...] = tuple(float(parameter.default) for parameter in PARAMETERS)

_BY_NAME = {parameter.name: parameter for parameter in PARAMETERS}
_FAMILIES = {"FRICTION_ON": FRICTION, "TRANSMISSION_ON": TRANSMISSION, "DRIVE_ON": DRIVE}
_COEFFICIENTS = (*(name.upper().replace(".", "_") for name in NAMES), *_FAMILIES)
_PLACES = {name: place for place, name in enumerate(_COEFFICIENTS)}


def _sizes(family: Collection[Effect]) -> tuple[int, ...]:
    return tuple(NAMES.index(name) for e in family if not e.of_bare_plant for name in e.size_names)


_SIZES = _sizes(CATALOGUE)
_FAMILY_SIZES = tuple(
    _sizes([effect for effect in family if effect.law.startswith("plant.")])
    for family in _FAMILIES.values()
)


def __getattr__(name: str) -> int:
    """Return where a parameter stands among the coefficients: EFFECT_PARAMETER, in capitals."""
    try:
        return _PLACES[name]
    except KeyError:
        raise AttributeError(f"the table of effects has no parameter {name}") from None


def check_identifiers(identifiers: Iterable[str]) -> None:
    """Raise InputError where an identifier is that of no effect, with the nearest ones."""
    for name in identifiers:
        if name not in EFFECTS:
            raise InputError(
                f"There is no effect {shown(name)}; did you mean {nearest(name, EFFECTS)}?"
            )


def parameter(name: str) -> EffectParameter:
    """Return a parameter by its full name, `effect.parameter`."""
    return _BY_NAME[name]


def near_equivalents(identifier: str, *, held: bool = False) -> frozenset[str]:
    """Return the effects that a motor-side encoder can hardly tell from one, without it.

    Args:
        identifier: of the one.
        held: whether the link is held.
    """
    own = EFFECTS[identifier]

    def alike(other: Effect) -> bool:
        always = own.looks_like and other.looks_like == own.looks_like
        if_held = own.looks_like_held and other.looks_like_held == own.looks_like_held
        return bool(always or (held and if_held))

    return frozenset(e.identifier for e in CATALOGUE if alike(e)) - {identifier}


def holders(identifier: str) -> frozenset[str]:
    """Return the effects that hold one as a limit case and are looked for on request only."""
    found = (e.identifier for e in CATALOGUE if e.on_request and identifier in e.contains)
    return frozenset(found)


def rare(effects: Collection[str]) -> int:
    """Return how many of some effects are rarer than one that looks much like them."""
    return sum(bool(EFFECTS[effect].rarer_than) for effect in effects)


def contains(richer: Collection[str], simpler: Collection[str]) -> bool:
    """Tell whether effects are others but for one, which holds the other's as a limit case."""
    more, less = set(richer) - set(simpler), set(simpler) - set(richer)
    return len(more) == len(less) == 1 and less <= set(EFFECTS[min(more)].contains)


def coefficients(values: Mapping[str, Any]) -> np.ndarray | None:
    """Return the effects' parameters in the order of `NAMES`, then the switches of the families.

    None if no kernel needs them.

    Those of effects of the bare plant are in `plant.coefficients`.

    Args:
        values: checked parameter values by full name; missing ones have their defaults.
    """
    given = tuple(float(values.get(p.name, p.default)) for p in PARAMETERS)

    def on(places: tuple[int, ...]) -> bool:
        return any(given[place] != DEFAULTS[place] for place in places)

    return np.array([*given, *map(on, _FAMILY_SIZES)]) if on(_SIZES) else None
