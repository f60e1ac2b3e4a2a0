"""Whether two angles can be in one unit: what a position loop's motion says of its reference."""

from __future__ import annotations

import numpy as np

FOLLOWING_LIMIT = 10.0
"""Greatest ratio of y to r at the lowest excited lines. There a position loop follows its reference
or, sticking, lags behind it; even a resonance stays below, while degrees give 57.3."""
_TAKEN_FOR_RAD = {
    "degrees": 180.0 / np.pi,
    "mrad": 1e3,
    "urad": 1e6,
}
_NEAR = 3.0
"""Factor up to which a ratio is like that of a unit: the loop need not follow exactly."""


def following(reference: np.ndarray, position: np.ndarray) -> float:
    """Return |Y|/|R|, median over the lowest third of the excited lines, both of shape (F,)."""
    lowest = slice(0, max(1, reference.size // 3))
    return float(np.median(np.abs(position[lowest]) / np.abs(reference[lowest])))


def unit_taken_for_rad(ratio: float) -> str | None:
    """Return the unit that a ratio of y to r points at: the one of y, taken for rad; or None."""
    unit, factor = min(_TAKEN_FOR_RAD.items(), key=lambda item: abs(np.log(ratio / item[1])))
    return unit if max(ratio / factor, factor / ratio) < _NEAR else None


def unit_sentence(ratio: float) -> str | None:
    """Return what a ratio of y to r says against their units and the mend; None if nothing."""
    if not ratio > FOLLOWING_LIMIT:
        return None
    unit = unit_taken_for_rad(ratio)
    cause = "their units differ"
    if unit is not None:
        factor = _TAKEN_FOR_RAD[unit]
        cause = f"y seems to be in {unit} and taken for rad, which gives {factor:.4g}"
    return (
        f"y is {ratio:.3g} times r at the lowest excited lines, but a position loop follows its "
        f"reference: {cause}; give position and reference in rad (fjr import converts: "
        "position=COLUMN:deg)."
    )
