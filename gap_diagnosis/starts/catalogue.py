"""The effects that are looked for on a rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fjr_kit.errors import InputError
from fjr_sim_node import effects as fx

from .search_space import possible_effects


def catalogue(
    nominal: Mapping[str, float],
    asked: Sequence[str] | None = None,
    *,
    linear_axis: bool = False,
    swings_free: bool = False,
) -> list[str]:
    """Return the effects that a rig can have, or those of them that were asked for.

    A rigid axis has none of transmission and link, and friction is added only where there is none.
    What is looked for on request only has to be asked for (or see `equivalents.holders`).

    Args:
        nominal: datasheet values of the base parameters.
        asked: identifiers; None for all.
        linear_axis: whether the axis does not turn.
        swings_free: whether no torque is asked for at any time.

    Raises:
        InputError: an identifier of no effect, or none that this rig can have.
    """
    fx.check_identifiers(asked or ())
    found = [
        name
        for name in possible_effects(nominal)
        if (name in asked if asked is not None else not fx.EFFECTS[name].on_request)
        if not (linear_axis and fx.EFFECTS[name].of_a_turn)
        if not (swings_free and fx.EFFECTS[name].of_command)
    ]
    if asked is not None and not found:
        raise InputError(
            f"effects: none of {', '.join(asked) or 'the named effects'} can be fitted to this "
            "rig; name others, or none for all."
        )
    return found
