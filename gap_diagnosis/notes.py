"""Notes that a reader of a diagnosis must see."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .which.search_space import Space


def at_limits(space: Space, x: np.ndarray, plant: Mapping[str, float]) -> list[str]:
    """Return a note on inertias and stiffness that ended as far from the datasheet as fits may go.

    Args:
        space: of the fit.
        x: where it ended.
        plant: the base parameters there.
    """
    told = []
    for (name, stated), ended in zip(space.nominal.items(), space.at_limits(x), strict=True):
        if name in ("jm", "j", "k0") and ended:
            off = 100.0 * (plant[name] / stated - 1.0)
            told.append(f"{name} {abs(off):.0f} % {'above' if off > 0.0 else 'below'}")
    if not told:
        return []
    return [
        f"The fit ends as far from the datasheet as it may go ({', '.join(told)} it): check units "
        "of the datasheet and the factor of the torque, or give a greater --tolerance."
    ]
