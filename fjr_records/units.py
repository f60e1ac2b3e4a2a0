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
_NEAR_STICKING = 1.3
"""The same where a rig that hardly moves may be the reason."""


def following(reference: np.ndarray, position: np.ndarray) -> float:
    """Return |Y|/|R|, median over the lowest third of the excited lines, both of shape (F,)."""
    lowest = slice(0, max(1, reference.size // 3))
    return float(np.median(np.abs(position[lowest]) / np.abs(reference[lowest])))


def unit_taken_for_rad(ratio: float) -> str | None:
    """Return the unit that a ratio of y to r points at: the one of y, taken for rad; or None."""
    unit, factor = min(_TAKEN_FOR_RAD.items(), key=lambda item: abs(np.log(ratio / item[1])))
    return unit if max(ratio / factor, factor / ratio) < _NEAR else None


def may_stick(ratio: float) -> bool:
    """Tell whether a rig that hardly moves explains a small ratio of y to r."""
    degrees = _TAKEN_FOR_RAD["degrees"]
    return ratio < 1.0 and not degrees / _NEAR_STICKING < 1.0 / ratio < degrees * _NEAR_STICKING


def compare_units(ratio: float) -> tuple[float, str]:
    """Return what a ratio of y to r says of their units, and the mend if they differ.

    Returns:
        The ratio, of r to y where r is the one that seems to be too large, which is beyond
        FOLLOWING_LIMIT if the units differ; and a sentence.
    """
    mend = "give position and reference in rad (fjr import converts: {}=COLUMN:deg)."
    if ratio > FOLLOWING_LIMIT:
        unit = unit_taken_for_rad(ratio)
        cause = "their units differ (y may be in counts of an encoder)"
        mend = mend if unit else mend.replace(":deg", ":FACTOR")
        if unit is not None:
            factor = _TAKEN_FOR_RAD[unit]
            cause = f"y seems to be in {unit} and taken for rad, which gives {factor:.4g}"
        return ratio, (
            f"y is {ratio:.3g} times r at the lowest excited lines, but a position loop follows "
            f"its reference: {cause}; {mend.format('position')}"
        )
    if not 0.0 < ratio < 1.0 / FOLLOWING_LIMIT:
        return ratio, f"y is {ratio:.3g} times r at the lowest lines, as in one unit."
    if may_stick(ratio):
        return ratio, (
            f"y is {ratio:.3g} times r at the lowest lines: the joint hardly moves, or r is in "
            "another unit."
        )
    return 1.0 / ratio, (
        f"r is {1.0 / ratio:.3g} times y at the lowest excited lines: the joint hardly moves, or r "
        f"seems to be in degrees and taken for rad, which gives {_TAKEN_FOR_RAD['degrees']:.4g}; "
        f"{mend.format('reference')}"
    )
