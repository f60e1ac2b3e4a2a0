"""What a linear axis says for a rotary one: m for rad, N for N m, kg for kg m2.

Records of a linear axis hold m and N, and all else follows from them: whatever has a unit of a
rotary axis has the one that stands here in its place. Names keep their endings (`_rad`, `_nm`).
"""

from __future__ import annotations

import math
import re

_ROTARY = re.compile(r"(?<=/)\(N m\)|\bN m\b|\bkg m2\b|\brad(?=\d*\b)")
_LINEAR = {"(N m)": "N", "N m": "N", "kg m2": "kg", "rad": "m"}
PER_TURN = "per 2 pi m"
"""Unit of what is counted per turn: a turn is 2 pi m of a linear axis."""
NAMES = (
    "The axis is linear. Names are those of a rotary one: what is called inertia is a mass in kg, "
    "what ends in nm is in N, what ends in rad is in m, but for phases, which are angles; a turn "
    "is 2 pi m."
)
"""What a reader must know of names where units are those of the linear axis."""


def as_linear(text: str) -> str:
    """Return a unit, or a text with units, in those of a linear axis: `N m s/rad` is `N s/m`."""
    return _ROTARY.sub(lambda found: _LINEAR[found[0]], text)


def pitch_m(cycles_per_turn: float) -> float:
    """Return the length (m) of one of so many cycles per turn, of 2 pi m."""
    return 2.0 * math.pi / cycles_per_turn
