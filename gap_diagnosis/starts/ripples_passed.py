"""How many of its ripples the motion passes: what is seen of less than one has any shape.

A ripple of which a record shows a part is a curve over the angle, as gravity, a cushion or a spring
that hardens are; with a second harmonic it is any such curve.
"""

from __future__ import annotations

import math

from fjr_sim_node import effects as fx

from ..model.rig_model import Model
from .scales import Scales

LEAST_PASSED = 0.75
"""Ripples below which a second harmonic cannot be seen."""
_WHOLE = 1.5  # ripples from which it is seen that they repeat
_IF_NONE = 0.5  # of its presence, what is left to an effect of which no part of a ripple is passed


def ripples_passed(model: Model, effect: str, scales: Scales) -> float:
    """Return how many of an effect's ripples the motion passes; infinite for what has none."""
    if not fx.EFFECTS[effect].ripple:
        return math.inf
    return model.effects[f"{effect}.cycles_per_turn"] * scales.travel_rad / (2.0 * math.pi)


def fewest_cycles(scales: Scales) -> float:
    """Return the cycles per turn of which the motion passes enough to see a second harmonic."""
    return LEAST_PASSED * 2.0 * math.pi / scales.travel_rad


def doubt_of_shape(passed: float) -> float:
    """Return the factor of the presence of an effect by what is seen of its shape.

    Args:
        passed: how many of its ripples the motion passes.
    """
    return _IF_NONE + (1.0 - _IF_NONE) * min(passed / _WHOLE, 1.0)
