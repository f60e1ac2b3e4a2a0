"""The effects that are looked for on a rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fjr_kit.errors import InputError
from fjr_sim_node import effects as fx

from .search_space import possible_effects

_OF_AN_ANGLE = ("gravity",)
"""What depends on the angle of a turn; of a linear axis weight is a constant force."""

_OF_A_COMMAND = (
    "delay", "actuator_lag", "torque_saturation", "torque_speed_limit", "torque_slew_limit",
    "dead_band", "torque_constant_ripple", "torque_gain",
)  # fmt: skip
"""What changes a torque that is asked for; where none is, there is nothing to change."""


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
        if not (linear_axis and name in _OF_AN_ANGLE)
        if not (swings_free and name in _OF_A_COMMAND)
    ]
    if asked is not None and not found:
        raise InputError(
            f"effects: none of {', '.join(asked) or 'the named effects'} can be fitted to this "
            "rig; name others, or none for all."
        )
    return found
