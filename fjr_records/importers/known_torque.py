"""A torque on the joint that is known: what the other axes of an arm ask of this one, and gravity.

The inverse dynamics of a robot model tell it: the torque that this motion needs, less that of the
axis's own inertia and friction. Without it, it is in no model of a single axis.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

KNOWN = "known_torque"
"""Its name in a map; in the sign of the torque that it needs."""


def without_known(
    values: Mapping[str, np.ndarray],
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return signals whose torque is what moves the axis alone, and a note where any was known.

    Args:
        values: {quantity: float64 (samples,)} in SI, on one grid.
    """
    if KNOWN not in values:
        return dict(values), ()
    known, torque = values[KNOWN], values["torque"]
    share = np.std(known) / max(np.std(torque), 1e-300)
    note = (
        f"the known torque, whose rms about its mean is {share:.2g} times that of the torque, is "
        "taken off the torque"
    )
    left = {quantity: each for quantity, each in values.items() if quantity != KNOWN}
    return {**left, "torque": torque - known}, (note,)
